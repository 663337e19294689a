"""The estimator: an observer and a Kalman filter for noisy and delayed position samples."""
