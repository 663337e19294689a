"""Runs of a hammer under a drive: integration, motion, contacts, dots, energies, and ensembles."""
