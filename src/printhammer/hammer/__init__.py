"""Hammer: constants, file format, edits and statics."""
