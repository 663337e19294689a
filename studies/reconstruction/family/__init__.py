"""The family of clearly different hammers, and what holds for all of them."""
