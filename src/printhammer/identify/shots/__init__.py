"""Constants from displacement records of single shots."""
