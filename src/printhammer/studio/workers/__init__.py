"""Processes that compute for the studio's pages, and may be ended at any time."""
