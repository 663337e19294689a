"""Bifurcation diagrams: states at the firings against a parameter."""
