"""Drive control: compensation tables, learning, feedback, bursts of least work, thermal limits."""
