"""Studies that use the package; they are in the repository, not in the wheel."""
