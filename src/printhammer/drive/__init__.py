"""Drives: pulse trains, bursts, sequences and sinusoidal forces, and their files."""
