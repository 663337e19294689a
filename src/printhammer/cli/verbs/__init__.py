"""The verbs, a folder each family."""
