"""How little positive work of the coil a burst can do with, whatever its current.

The positive work of a dot is at least what lifts the armature from where it turned to its largest
indentation and indents the pack: L + U(x_max) - U(x_turn), with L the loading work of the pack, and U the
energy stored in magnet (at zero current), spring and backstop. The first dot starts from rest; each later one
can turn no nearer to the paper than at the front of the pack, since the contact before has to end, and no
nearer than a current within its bound can throw it from. A backstop that gives energy back would lessen the
work by that energy; this bound holds as long as the backstop is not touched between the dots.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.equilibrium import rest_state
from printhammer.ledger import stored_energy
from printhammer.roots import bisect
from printhammer.static_force import StaticForce

if TYPE_CHECKING:
    from printhammer.hammer import Hammer
    from printhammer.printing.nominal import Nominal

_POINTS: Final = 4001
_CURRENTS: Final = 9


@dataclass(frozen=True)
class Bound:
    """Least positive work of the coil, J, without touches of the backstop between the dots.

    Attributes
    ----------
    first : float
        For a dot from rest.
    later : float
        For each dot after it.
    turn : float
        Displacement nearest to the paper from which a later dot can be thrown, m.
    loading : float
        Loading work of the pack for one dot.
    """

    first: float
    later: float
    turn: float
    loading: float

    def burst(self, dots: int) -> float:
        """Return the least positive work of a burst of some dots, J."""
        return self.first + (dots - 1) * self.later


def bound(hammer: Hammer, single: Nominal, force: float, largest: float) -> Bound:
    """Bound the positive work of dots of a given force.

    Parameters
    ----------
    hammer : Hammer
        A hammer with magnet, pack and backstop.
    single : Nominal
        Its single pulse.
    force : float
        Force of the dots in parts of that of the single pulse.
    largest : float
        Largest current, A.
    """
    static = StaticForce(hammer)
    deepest, loading = _indented(static, single, force)
    x = np.linspace(rest_state(hammer), static.front + deepest, _POINTS)
    step = float(x[1] - x[0])
    # The pull of a law may grow again with the current, so that the largest is not always the strongest.
    currents = np.linspace(0.0, largest, _CURRENTS).tolist()
    thrown = np.array([max(static.free(place, current) for current in currents) for place in x.tolist()])
    # Trapezoidal rule from every place to the last one.
    parts = 0.5 * step * (thrown[1:] + thrown[:-1])
    given = np.append(np.cumsum(parts[::-1])[::-1], 0.0)
    enough = np.flatnonzero(given >= loading)
    # The place after it, so that the bound errs on the safe side by a step.
    turn = min(float(x[enough[-1] + 1]), static.front) if enough.size else float(x[0])
    top = stored_energy(hammer, float(x[-1]))
    first, later = (loading + top - stored_energy(hammer, start) for start in (float(x[0]), turn))
    return Bound(first, later, turn, loading)


def _indented(static: StaticForce, single: Nominal, force: float) -> tuple[float, float]:
    """Return indentation, m, and loading work, J, at which the pack presses with a force, by its law."""
    wanted, front = force * single.force, static.front
    deepest = single.indentation
    while -static.pack(front + deepest) < wanted:
        deepest *= 1.25
    depth = bisect(lambda place: wanted + static.pack(front + place), 0.0, deepest)
    places = np.linspace(0.0, depth, _POINTS)
    pressed = -np.array([static.pack(front + place) for place in places.tolist()])
    return depth, float(np.trapezoid(pressed, places))
