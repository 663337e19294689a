"""Run-to-run calibration of the compensation table of a hammer with unknown constants, by a sensor."""
