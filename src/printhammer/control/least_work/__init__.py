"""Bursts of least work: the current that prints a burst with least energy, by optimal control."""
