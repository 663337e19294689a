"""The benchmark: printhammer compared with its reference and other solvers, and timings of ensembles."""
