"""Sweeps over hammers and drives: a spec, its members, their work in blocks, and a store that survives."""

from printhammer.sweep.api import sweep

__all__ = ["sweep"]
