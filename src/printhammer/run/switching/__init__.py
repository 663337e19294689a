"""Switching times of electrical contacts, as measured by makers of relays."""
