"""Ensembles of runs: vector code in lanes, and the scalar loop over members."""
