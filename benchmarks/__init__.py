"""Benchmarks; they are in the repository, not in the wheel."""
