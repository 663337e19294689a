"""Lower bound on the positive coil work of a burst, for any current.

The positive work of a dot is at least the energy that lifts the armature from its turning point to the
largest indentation and indents the pack: L + U(x_max) - U(x_turn), with L the loading work of the pack, and U
the energy stored in magnet (at zero current), spring and backstop. The motion before the turning point does
not matter. The first dot starts from rest. Before a later dot the armature turns no nearer to the paper than
the front of the pack, since the preceding contact has to end, and no nearer than the point from which a
current within its limit can still print the dot.

Alternatively the armature bounces off the backstop, which returns energy without coil work. The returned
energy is at most the rebound energy of an undriven armature that falls with all the energy left after the
preceding dot; energy that the coil adds to the fall counts as positive work, of which the backstop returns
only a fraction.
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

_POINTS: Final = 4001  # Quadrature points over the displacement; arbitrary
_CURRENTS: Final = 17  # Number of currents that are searched for the largest force; arbitrary
_SPEEDS: Final = 32  # Number of impact speeds at the backstop; arbitrary
_STROBES: Final = 4001  # Samples of each undriven rebound; arbitrary


class Bound(Declared):
    """Lower bounds on the positive coil work of the first and of each later dot of a burst."""

    first: float = scalar("J", "lower bound on the positive work for a dot from rest")
    later: float = scalar("J", "lower bound for each later dot, from a turning point in front of the pack")
    bounced: float = scalar("J", "lower bound for each later dot, after a bounce off the backstop")
    turn: float = scalar("m", "turning point nearest to the paper from which a later dot is possible")
    loading: float = scalar("J", "loading work of the pack for one dot")

    def burst(self, dots: int) -> float:
        """Return the lower bound on the positive coil work of a burst of `dots` dots, J."""
        return self.first + (dots - 1) * min(self.later, self.bounced)


def bound(hammer: Hammer, single: Nominal, force: float, largest: float) -> Bound:
    """Compute lower bounds on the coil work of dots with `force` times the single-pulse force.

    The hammer needs magnet, pack and backstop; `largest` is the largest absolute value of the current, A.
    """
    static = StaticForce(hammer)
    deepest, loading = _indentation(static, single, force)
    x = np.linspace(rest_state(hammer), static.front + deepest, _POINTS)
    thrown = _strongest(static, x, largest)
    # Trapezoidal rule from every point to the last point.
    parts = 0.5 * float(x[1] - x[0]) * (thrown[1:] + thrown[:-1])
    supplied = np.append(np.cumsum(parts[::-1])[::-1], 0.0)
    enough = np.flatnonzero(supplied >= loading)
    # One point farther, so that discretisation makes the bound smaller, not larger.
    turn = min(float(x[enough[-1] + 1]), static.front) if enough.size else float(x[0])
    # If the stored energy has a maximum before that point, turning there is cheapest.
    places = np.append(x[x < turn], turn)
    stored = np.array([stored_energy(hammer, place) for place in places.tolist()])
    top = stored_energy(hammer, float(x[-1]))
    first, later = loading + top - float(stored[0]), loading + top - float(stored.max())
    assert hammer.position is not None
    bottom = stored_energy(hammer, hammer.position)
    # Conservative for every pack law: a pack returns at most the energy that it absorbed.
    back = _given_back(hammer, top - bottom + loading)
    return Bound(first, later, loading + top - bottom - back, turn, loading)


def _strongest(static: StaticForce, x: FloatArray, largest: float) -> FloatArray:
    """Return the largest force [N] of magnet and spring at each displacement `x` [m].

    The maximum is over currents up to `largest` [A] of either sign.
    """
    currents = np.linspace(-largest, largest, _CURRENTS).tolist()
    force = np.array([[static.free(place, current) for current in currents] for place in x.tolist()])
    rows, best = np.arange(x.size), np.clip(force.argmax(axis=1), 1, _CURRENTS - 2)
    before, at, after = (force[rows, best + shift] for shift in (-1, 0, 1))
    # Vertex of the parabola through three points, exact for equation (3).
    bend = before - 2.0 * at + after
    crest = np.divide(0.5 * (before - after), bend, out=np.zeros_like(bend), where=bend < 0.0)
    between = at - 0.25 * (before - after) * np.clip(crest, -1.0, 1.0)
    return np.asarray(np.maximum(force.max(axis=1), between))


def _given_back(hammer: Hammer, most: float) -> float:
    """Return the largest rebound energy [J] of an undriven armature at the backstop.

    The maximum is over incident energies up to `most` [J].
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


def _indentation(static: StaticForce, single: Nominal, force: float) -> tuple[float, float]:
    """Return the indentation of the pack [m] and the loading work [J] of a dot.

    The peak force of the dot is `force` times the single-pulse force.
    """
    wanted, front = force * single.force, static.front
    deepest = single.indentation
    while -static.pack(front + deepest) < wanted:
        deepest *= 1.25
    depth = bisect(lambda place: wanted + static.pack(front + place), 0.0, deepest)
    places = np.linspace(0.0, depth, _POINTS)
    pressed = -np.array([static.pack(front + place) for place in places.tolist()])
    return depth, float(np.trapezoid(pressed, places))
