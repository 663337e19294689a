"""Synthetic laboratory: simulated test benches and sensors."""
