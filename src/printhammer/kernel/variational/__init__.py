"""Variational equations along a recorded run: derivatives of the motion by initial state and constants."""
