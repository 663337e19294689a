"""Pictures of strobes, exponents, orbits, branches and basins."""
