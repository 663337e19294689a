"""The synthetic laboratory: benches and sensors."""
