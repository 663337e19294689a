"""Parameter sweeps over hammers and drives: spec, members, blocks of work, and a resumable store."""

from printhammer.sweep.api import sweep

__all__ = ["sweep"]
