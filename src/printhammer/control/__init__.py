"""Better drives: compensation tables, feedback, bursts of least work."""
