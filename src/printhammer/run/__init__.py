"""Runs: one hammer or many, from a state through a drive."""
