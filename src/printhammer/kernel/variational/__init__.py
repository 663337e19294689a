"""Variational equations along a recorded run: derivatives of the motion with initial state and constants."""
