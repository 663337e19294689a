"""The estimator, an observer and a Kalman filter: what noisy, late samples tell of the hammer."""
