"""Worker processes of the studio, which may be terminated at any time."""
