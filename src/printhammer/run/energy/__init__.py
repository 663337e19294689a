"""Where the energy of a run comes from and goes."""
