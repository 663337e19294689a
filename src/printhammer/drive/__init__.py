"""Drives: when a hammer is fired, and with what."""
