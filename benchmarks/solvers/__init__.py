"""The benchmark: printhammer against its reference and other solvers, and its ensembles by the clock."""
