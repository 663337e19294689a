"""State of a studio page: hammer, drive, edits."""
