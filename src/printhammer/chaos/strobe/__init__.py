"""Strobe maps: states of a pulse train at its firings, and classification of the motion."""
