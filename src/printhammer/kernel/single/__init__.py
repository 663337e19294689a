"""One run of one hammer, its record, and what is read from that."""
