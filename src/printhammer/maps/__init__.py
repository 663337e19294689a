"""Frequency-time maps, computed and measured."""
