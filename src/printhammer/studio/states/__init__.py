"""The state of a studio page: hammer, drive, edits."""
