"""Benchmarks; they stay in the repository and are no part of the wheel."""
