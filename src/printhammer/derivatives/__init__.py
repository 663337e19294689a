"""Derivatives of states and dots, with respect to states and constants."""
