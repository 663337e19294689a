"""Rates: how well dots come out at one, up to which they do, and what tolerances and materials change."""
