"""Integration methods, and location of switches within a step."""
