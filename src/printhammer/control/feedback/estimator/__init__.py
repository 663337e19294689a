"""The estimator: what the controller knows of the hammer from noisy, late samples."""
