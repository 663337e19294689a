"""Basins of attraction and their entropy, and how a second pulse quenches the first."""
