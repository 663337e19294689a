"""Periodic orbits, stable or not, found as fixed points of the stroboscopic map."""
