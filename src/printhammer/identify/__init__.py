"""Identification: fit the constants of a hammer to measurements, with their uncertainty, for hammer files."""
