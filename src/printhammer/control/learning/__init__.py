"""Run-to-run calibration of the compensation table of a unit with unknown constants, from sensor readings."""
