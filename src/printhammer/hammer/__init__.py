"""Hammer: constants, file format and statics."""
