"""Continuation: periodic orbits followed along a constant, with their bifurcations."""
