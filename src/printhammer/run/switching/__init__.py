"""Switching of electrical contacts, as makers of relays measure it."""
