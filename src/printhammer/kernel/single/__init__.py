"""One run of one hammer, its record, and quantities computed from the record."""
