"""Numerical kernel: integration of the motion on arrays in SI units, without files or plots."""
