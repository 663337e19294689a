"""Derivatives of states and dots with respect to initial states and constants."""
