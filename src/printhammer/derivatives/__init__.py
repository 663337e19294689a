"""Derivatives of motion: of states and of constants."""
