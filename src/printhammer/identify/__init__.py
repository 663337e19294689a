"""Constants of a hammer from measurements: tables, fits with their uncertainty, fragments of hammer files."""
