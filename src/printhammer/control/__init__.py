"""Drive control: compensation tables, learning, feedback, bursts of least coil work, thermal limits."""
