"""Integration of one run of a hammer, the record of the run, and quantities computed from the record."""
