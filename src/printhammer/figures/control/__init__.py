"""Figures of compensation tables, feedback, bursts of least work, and coil studies."""
