"""Curves in two constants."""
