"""The search for hammers that do what the paper tells."""
