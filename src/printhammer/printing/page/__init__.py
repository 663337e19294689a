"""Printed pages: dot patterns by wire and column, and the dots that a print head prints on the paper."""
