"""Fits of the constants of a single part to static measurements and rebound speeds."""
