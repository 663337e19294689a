"""Chaos: strobe points of trains, and what kind of motion they tell of."""

from printhammer.chaos.strobe import Strobe, strobe, strobes
from printhammer.chaos.verdict import Verdict

__all__ = ["Strobe", "Verdict", "strobe", "strobes"]
