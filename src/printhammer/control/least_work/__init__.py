"""Bursts of least work: optimal control of the current that prints a burst with least coil work."""
