"""Numerical kernel: integration of the motion on numbers and arrays in SI units, without files or plots."""
