"""Feedback: an observer, a controller by dynamic programming, and their closed loop."""
