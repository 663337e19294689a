"""Kernels for ensembles of runs: vector lanes that step many members together, and a scalar loop."""
