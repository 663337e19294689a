"""Dots: drive strategies, comparison of dots with the single-pulse dot, and settling after a dot."""
