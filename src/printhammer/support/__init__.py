"""Helpers without physics."""
