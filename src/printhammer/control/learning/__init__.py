"""Run-to-run calibration of a compensation table, on a hammer nobody has measured, from one number a dot."""
