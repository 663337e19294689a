"""The synthetic laboratory: benches, sensors, recovery."""
