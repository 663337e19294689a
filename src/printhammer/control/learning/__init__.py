"""Run-to-run calibration of an unmeasured hammer's compensation table, from sensor readings of dots."""
