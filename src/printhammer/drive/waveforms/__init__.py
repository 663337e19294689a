"""Waveforms: current, force or voltage of one firing as a function of time."""
