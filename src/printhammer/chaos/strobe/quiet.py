"""A quiet section: the phase of the drive at which an orbit is farthest from all its contacts.

Where an impact on a rigid backstop meets the section the state there jumps, and in the pack on its way out
the armature has a memory beside its state. Any orbit can be looked at elsewhere.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.run.problem import Problem

if TYPE_CHECKING:
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray

_BEYOND: Final = 0.01


def quiet_section(
    regime: Regime, state: FloatArray, firings: int, tolerance: float
) -> tuple[Regime, FloatArray] | None:
    """Return the regime with the quietest phase for an orbit, and the state of the orbit there.

    Parameters
    ----------
    regime : Regime
        With the phase at which the state is known.
    state : array, shape (2,)
        Displacement, m, and velocity, m/s.
    firings : int
        After which the orbit repeats.
    tolerance : float
        Error allowed in one step.

    Returns
    -------
    tuple or None
        None where a run does not come through.
    """
    train, _ = regime.train(firings + 1)
    begin, *_, end = (float(time) for time in regime.moments(train, firings))
    problem = Problem(regime.hammer, train, (float(state[0]), float(state[1])), begin, tolerance)
    # An orbit that begins at a contact ends at one, or just before it.
    record = problem.run(end + _BEYOND * regime.period)
    if record.status_name != "ok":
        return None
    busy = _busy(record.contacts, begin, end) % regime.period
    if not busy.size:
        return regime, state
    # Of all firings at once: the section is at the same phase after each.
    times = np.unique(busy)
    gaps = np.diff(np.append(times, times[0] + regime.period))
    widest = int(np.argmax(gaps))
    late = (times[widest] + 0.5 * gaps[widest]) % regime.period
    (row,) = problem.resample(record, np.array([begin + late]))
    phase = (regime.phase + late / regime.period) % 1.0
    return replace(regime, phase=float(phase)), row[:2].copy()


def _busy(contacts: FloatArray, begin: float, end: float) -> FloatArray:
    """Return times since the section at which there is a contact, close enough together."""
    times = [np.zeros(0)]
    for _surface, t_in, _v_in, t_out, *_ in contacts:
        low, high = (begin if np.isnan(t_in) else t_in), (end if np.isnan(t_out) else t_out)
        times.append(np.linspace(low, high, 20 if high > low else 1) - begin)
    return np.concatenate(times)
