"""Numerical kernel: arrays and numbers only, without units, files or pictures."""
