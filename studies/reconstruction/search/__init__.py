"""Search for hammers that reproduce the observations of the paper."""
