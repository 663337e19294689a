"""Time from switching on to impact, as a table for the firmware."""
