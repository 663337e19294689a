"""Evaluation of the claims for candidates, and base rates: how often claims hold by chance."""
