"""Pictures of compensation tables, feedback and bursts of least work."""
