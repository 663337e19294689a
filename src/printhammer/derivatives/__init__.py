"""Derivatives of a motion: with respect to states and to constants."""
