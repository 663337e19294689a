"""Fits of constants to displacement records of single shots."""
