"""Figures of strobe points, exponents, orbits, branches, basins and sensitivities."""
