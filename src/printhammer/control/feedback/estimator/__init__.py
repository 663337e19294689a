"""The estimator, an observer and a Kalman filter: what noisy, late samples show of the hammer."""
