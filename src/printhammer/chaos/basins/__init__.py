"""Basins of attraction and their entropy, and the quench map of two pulses."""
