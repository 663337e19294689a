"""The reconstruction of the hammer of the paper: search, verdicts, base rates, and the family."""
