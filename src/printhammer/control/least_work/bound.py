"""How little positive work of the coil a burst can do with, whatever its current.

The positive work of a dot is at least what lifts the armature from where it turned to its largest
indentation and indents the pack: L + U(x_max) - U(x_turn), with L the loading work of the pack, and U the
energy stored in magnet (at zero current), spring and backstop. It does not matter how the armature came to
where it turned, nor how often it turned before. The first dot starts from rest. Each later one can turn no
nearer to the paper than at the front of the pack, since the contact before has to end, and no nearer than a
current within its bound can throw it from.

Instead it may come from the backstop, which gives energy back for nothing. That is no more than an undriven
armature takes from there, which falls with all that it had after the dot before; what the coil adds to the
fall counts as its positive work, and a backstop gives back less of it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.hammer.equilibrium import rest_state
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.static_force import StaticForce
from printhammer.printing.dots.nominal import Nominal
from printhammer.results import Declared, scalar
from printhammer.run.energy import stored_energy
from printhammer.run.ensemble import Ensemble
from printhammer.run.window import wait_of
from printhammer.support.arrays import FloatArray
from printhammer.support.roots import bisect

_POINTS: Final = 4001  # Places at which energies and forces are summed up
_CURRENTS: Final = 17  # Currents among which the strongest is sought
_SPEEDS: Final = 32  # Speeds with which an armature is thrown at the backstop
_STROBES: Final = 4001  # Instants at which it is looked at


class Bound(Declared):
    """Least positive work of the coil."""

    first: float = scalar("J", "for a dot from rest")
    later: float = scalar("J", "for each dot after it, thrown from where the armature turned before the pack")
    bounced: float = scalar("J", "for each dot after it, thrown after a bounce off the backstop")
    turn: float = scalar("m", "displacement nearest to the paper from which a later dot can be thrown")
    loading: float = scalar("J", "loading work of the pack for one dot")

    def burst(self, dots: int) -> float:
        """Return the least positive work of a burst of some dots, J."""
        return self.first + (dots - 1) * min(self.later, self.bounced)


def bound(hammer: Hammer, single: Nominal, force: float, largest: float) -> Bound:
    """Bound the positive work of dots of a force, in parts of that of the single pulse.

    The hammer has magnet, pack and backstop; `largest` is the largest current of either sign, A.
    """
    static = StaticForce(hammer)
    deepest, loading = _indented(static, single, force)
    x = np.linspace(rest_state(hammer), static.front + deepest, _POINTS)
    thrown = _strongest(static, x, largest)
    # Trapezoidal rule from every place to the last one.
    parts = 0.5 * float(x[1] - x[0]) * (thrown[1:] + thrown[:-1])
    supplied = np.append(np.cumsum(parts[::-1])[::-1], 0.0)
    enough = np.flatnonzero(supplied >= loading)
    # The place after it, so that the bound errs on the safe side by a step.
    turn = min(float(x[enough[-1] + 1]), static.front) if enough.size else float(x[0])
    # Where the energy has a crest on the way, it is best to turn on it.
    places = np.append(x[x < turn], turn)
    stored = np.array([stored_energy(hammer, place) for place in places.tolist()])
    top = stored_energy(hammer, float(x[-1]))
    first, later = loading + top - float(stored[0]), loading + top - float(stored.max())
    assert hammer.position is not None
    bottom = stored_energy(hammer, hammer.position)
    # The pack gives back less than it took, whatever its law.
    back = _given_back(hammer, top - bottom + loading)
    return Bound(first, later, loading + top - bottom - back, turn, loading)


def _strongest(static: StaticForce, x: FloatArray, largest: float) -> FloatArray:
    """Return the largest force of magnet and spring at some places, N, over all currents within a bound."""
    currents = np.linspace(-largest, largest, _CURRENTS).tolist()
    force = np.array([[static.free(place, current) for current in currents] for place in x.tolist()])
    rows, best = np.arange(x.size), np.clip(force.argmax(axis=1), 1, _CURRENTS - 2)
    before, at, after = (force[rows, best + shift] for shift in (-1, 0, 1))
    # The crest of the parabola through the three, exact for equation (3).
    bend = before - 2.0 * at + after
    crest = np.divide(0.5 * (before - after), bend, out=np.zeros_like(bend), where=bend < 0.0)
    between = at - 0.25 * (before - after) * np.clip(crest, -1.0, 1.0)
    return np.asarray(np.maximum(force.max(axis=1), between))


def _given_back(hammer: Hammer, most: float) -> float:
    """Return the largest energy, J, with which an undriven armature comes back from the backstop.

    It falls on it with any energy up to `most`.
    """
    bottom, front = hammer.position, hammer.front
    assert bottom is not None
    assert front is not None
    assert hammer.waveform is not None
    speeds = np.sqrt(2.0 * most / hammer.mass * np.linspace(0.0, 1.0, _SPEEDS + 1)[1:])
    longest = wait_of(hammer)
    never = PulseTrain(hammer.waveform, at=[2.0 * longest])
    grid = np.linspace(0.0, longest, _STROBES)
    states = np.stack([np.full(_SPEEDS, bottom), -speeds], axis=1)
    strobes = Ensemble(hammer, never, longest, states=states).run(strobes=[grid] * _SPEEDS).strobes
    assert strobes is not None
    places = np.linspace(bottom, front, _POINTS)
    stored = np.array([stored_energy(hammer, place) for place in places.tolist()])
    energy = 0.5 * hammer.mass * strobes.v**2 + np.interp(strobes.x, places, stored - stored[0])
    rising = (strobes.v > 0.0) & (strobes.x >= bottom) & (strobes.x <= front)
    return float(energy[rising].max(initial=0.0))


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
