"""Continuation: periodic orbits followed in a parameter, with their bifurcations."""
