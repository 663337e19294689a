"""Readout of a run as arrays: curves, contacts, dots, energies, maps, printed lines, strobe sections."""
