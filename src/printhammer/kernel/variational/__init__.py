"""Variational equations along a recorded run."""
