"""Verbs of what is printed, how well, and how to drive better."""
