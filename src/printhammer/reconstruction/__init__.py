"""The reconstruction of the hammer of the paper: what was found by search, and how well it is known."""
