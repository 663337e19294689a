"""Elements shared by the figures: style, scales, marks, output files."""
