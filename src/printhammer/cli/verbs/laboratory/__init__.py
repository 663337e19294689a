"""Verbs of hammers: their files, constants from measurements, and the hammer of the paper."""
