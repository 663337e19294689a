"""Periodic orbits, stable or not: fixed points of the strobe map, found by Newton's method."""
