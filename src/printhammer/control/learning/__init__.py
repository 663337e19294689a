"""Run-to-run calibration of a compensation table for an unmeasured hammer, from sensor readings of dots."""
