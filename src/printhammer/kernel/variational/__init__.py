"""Variational equations along a recorded run: derivatives with respect to initial state and constants."""
