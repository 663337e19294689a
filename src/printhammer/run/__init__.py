"""Runs of a hammer: drive, motion and contacts."""
