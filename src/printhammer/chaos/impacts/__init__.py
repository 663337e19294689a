"""Impacts: Poincaré sections at the contacts, and the times between them."""
