"""Integration methods, and location of switching events within a step."""
