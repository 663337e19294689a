"""Lyapunov exponents, the 0-1 test for chaos and recurrence plots."""
