"""Stroboscopic maps: states of a train at its firings, and what kind of motion they show."""
