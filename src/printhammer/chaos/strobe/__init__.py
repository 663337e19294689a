"""Strobe maps: states of a hammer at the firings of a pulse train, and classification of the motion."""
