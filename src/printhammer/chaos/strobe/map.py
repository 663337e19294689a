"""Strobe map: from the state at a section to the state some firings later, with its derivative.

The strobe map is the Poincaré map of a section at a fixed phase of the drive. Its derivative over a period of
an orbit is the monodromy matrix, whose eigenvalues are the Floquet multipliers; at a touch of a surface, the
tangent flow is multiplied by the saltation matrix (docs/tangent.md).

At a section the state is displacement and velocity, unless the armature is moving out of the pack: then the
memory of the pack belongs to the state, and the status of the image is "in the pack". A section at another
phase of the period avoids this. If a voltage drives the coil, no current may flow at the section, else the
status is "a current flows".

*Quiet section.* The quiet section of an orbit is at the phase of the drive farthest from all its contacts.

If an impact on a rigid backstop coincides with the section, the state jumps; if the armature is moving out of
the pack at the section, the state includes a memory. The same orbit can be observed at another phase.
"""

from __future__ import annotations

import math
from dataclasses import replace
from importlib import import_module
from typing import Final

import numpy as np
import numpy.typing as npt

from printhammer.derivatives.states import follow
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.parts.backstop.rigid import RigidBackstop
from printhammer.parts.pack.rigid import RigidFront
from printhammer.results import Declared, part
from printhammer.run.contacts import touches_of
from printhammer.run.effort import Effort
from printhammer.run.ensemble import MODE_NAMES
from printhammer.run.problem import Problem, Record
from printhammer.run.regime import Regime
from printhammer.run.start import initial_state
from printhammer.run.supply import emf, linkage
from printhammer.support.arrays import FloatArray

MAP_TOLERANCE: Final = 1e-13
"""Integration tolerance of the strobe map, which limits the accuracy of a fixed point; arbitrary."""

MAP_EFFORT: Final = Effort(MAP_TOLERANCE)

IN_PACK: Final = "in the pack"
"""Status of an image if the state at a section includes a memory of the pack."""

WITH_MEMORY: Final = tuple(
    MODE_NAMES.index(name) for name in ("unloading", "reloading", "held on the unloading branch")
)
"""Indices of the modes of motion whose state includes a memory of the pack."""
CURRENT: Final = "a current flows"
"""Status of an image if the coil carries a current at the section, which then belongs to the state."""
_OK: Final = "ok"
RANGE_LEFT: Final = "range left"
"""Status of an image whose initial displacement is inaccessible, e.g. behind a rigid backstop."""

_TURN_STEPS: Final = 60  # Iteration limit of the root search for an extremum; arbitrary
_STILL: Final = 1e-9  # Arbitrary
"""Relative speed at which the root search for an extremum stops; the displacement error is quadratic."""
STILL_COIL: Final = 1e-9  # Arbitrary
"""Current or flux linkage, relative to a typical value, below which the coil is treated as currentless."""


class Image(Declared):
    """Image of a state under the strobe map, with derivative, contacts and distance from a grazing."""

    state: FloatArray = part(
        'displacement [m] and velocity [m/s] at the end, shape (2,); NaN unless the status is "ok"'
    )
    jacobian: FloatArray = part(
        "derivative of the state at the end with respect to the state at the start, from the tangent flow,"
        ' shape (2, 2); NaN unless the status is "ok"'
    )
    status: str = part(
        '"ok"; the reason for an early end; "in the pack" if the state at the start or the end includes a'
        ' memory; or "a current flows" at the end'
    )
    smooth: bool = part(
        "whether the state has a derivative; False if the motion passes a touch without velocity"
    )
    contacts: tuple[tuple[str, float], ...] = part(
        'surface, "pack" or "backstop", and time of touch since the start, s, of every contact that begins'
        " in between, in order; empty if not requested"
    )
    margin: float = part(
        "signed distance from a grazing, in units of the distance from backstop to pack",
        more="overshoot of that local extremum of the displacement that is closest to the pack's front or to"
        " the backstop, positive beyond the surface in the direction of the extremum, so that it passes"
        " through 0 where a contact appears, vanishes, splits or merges. An impact on a rigid backstop"
        " counts with the square of its speed in units of the typical speed. NaN without an extremum, or"
        " if not requested",
    )

    @property
    def ok(self) -> bool:
        """Whether the run was completed."""
        return self.status == _OK


def read_state(state: npt.ArrayLike) -> FloatArray:
    """Parse a state, displacement in m and velocity in m/s; raise InputError unless both are finite."""
    pair = np.asarray(state, dtype=np.float64)
    if pair.shape != (2,) or not np.isfinite(pair).all():
        raise InputError.of("state", state, "two finite numbers, displacement in m and velocity in m/s")
    return pair


def image_of(
    regime: Regime, state: FloatArray, firings: int, tolerance: float, *, contacts: bool = True
) -> Image:
    """Compute the image of a state, (m, m/s), under the iterated strobe map, with its derivative.

    Pulses of earlier firings are still active at the start, as in an endless train. A run that ends early, or
    a state outside the range of a force law, sets the status and raises no exception. If `contacts`, the
    contacts and the distance from a grazing are computed, too, which takes about a third of the total time.
    """
    regime.check_planar()
    train, _ = regime.train(firings)
    moments = regime.moments(train, firings)
    start = float(state[0]), float(state[1])
    if not is_possible(regime.hammer, *start):
        return _no_image(RANGE_LEFT)
    if not is_usable(regime.hammer, *start):
        return _no_image(IN_PACK)
    problem = Problem(regime.hammer, train, start, float(moments[0]), tolerance)
    columns = np.eye(problem.state_size)[:, :3]
    if problem.laws.circuit:
        # Without a current the flux linkage follows from the displacement.
        columns[3, 0] = emf(regime.hammer, start[0], 0.0)
    followed = follow(problem, moments[[0, -1]], columns, renormalise=False)
    if followed.status_name != _OK:
        return _no_image(followed.status_name)
    if problem.laws.circuit:
        x, linked = float(followed.states[-1, 0]), float(followed.states[-1, 4])
        limit = STILL_COIL * problem.linkage_scale
        if not abs(linked - linkage(regime.hammer, x, 0.0)) <= limit:
            return _no_image(CURRENT)
    if int(followed.states[-1, 2]) in WITH_MEMORY:
        return _no_image(IN_PACK)
    touched: tuple[tuple[str, float], ...] = ()
    margin = math.nan
    if contacts:
        record = problem.run(float(moments[-1]))
        touched = tuple((surface, t - float(moments[0])) for surface, t in touches_of(record))
        margin = margin_of(problem, record)
    return Image(
        state=followed.states[-1, :2].copy(),
        jacobian=followed.columns[:2, :2].copy(),
        status=_OK,
        smooth=followed.smooth,
        contacts=touched,
        margin=margin,
    )


def is_possible(hammer: Hammer, x: float, v: float) -> bool:
    """Whether (x, v), m and m/s, is a valid initial state: inside the laws' ranges, not behind a backstop."""
    try:
        initial_state(hammer, (x, v))
    except InputError:
        return False
    return True


def is_usable(hammer: Hammer, x: float, v: float) -> bool:
    """Whether (x, v), m and m/s, is the complete state; False for an armature moving out of the pack."""
    return not (v <= 0.0 and x > front_with_memory(hammer))


def front_with_memory(hammer: Hammer) -> float:
    """Return the front position of a pack whose law has a memory, m; infinite for every other hammer."""
    if hammer.pack is None or not getattr(import_module(hammer.pack.module), "MEMORY", False):
        return math.inf
    return hammer.pack.front


def _no_image(status: str) -> Image:
    return Image(np.full(2, np.nan), np.full((2, 2), np.nan), status, False, (), math.nan)


def margin_of(problem: Problem, record: Record) -> float:
    """Compute the signed relative distance of a run from a grazing; see the field `margin` of `Image`."""
    hammer, (way, speed) = problem.hammer, problem.scales
    surfaces = [place for place in (hammer.position, hammer.front) if place is not None]
    _, x, sign = turns(problem, record)
    margins = [sign * (x - place) / way for place in surfaces]
    nodes = record.nodes
    rebound = (nodes[1:, 0] == nodes[:-1, 0]) & (nodes[:-1, 2] < 0.0) & (nodes[1:, 2] >= 0.0)
    margins.append((nodes[:-1, 2][rebound] / speed) ** 2)
    every = np.concatenate(margins)
    return float(every[np.argmin(np.abs(every))]) if every.size else math.nan


def turns(problem: Problem, record: Record) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Locate the local extrema of the displacement in a run.

    Returns the times [s] and the displacements [m] of the extrema, and their signs: 1 for a maximum, -1 for a
    minimum.
    """
    nodes = record.nodes
    before, after = nodes[:-1, 2], nodes[1:, 2]
    rows = np.flatnonzero(
        ((before * after < 0.0) | ((after == 0.0) & (before != 0.0))) & (nodes[1:, 0] > nodes[:-1, 0])
    )
    sign = np.sign(before[rows])
    if not rows.size:
        return np.zeros(0), np.zeros(0), sign
    low, high = nodes[rows, 0].copy(), nodes[rows + 1, 0].copy()
    f_low, f_high = before[rows].copy(), after[rows].copy()
    time, kept = high.copy(), np.zeros(len(rows))
    table = problem.resample(record, time)
    # Regula falsi with the Illinois rule: halve the function value at an end that is retained twice.
    for _ in range(_TURN_STEPS):
        open_ = (np.abs(table[:, 1]) > _STILL * problem.scales[1]) & (high - low > 4.0 * np.spacing(high))
        if not open_.any():
            break
        share = np.divide(f_low, f_low - f_high, out=np.full(len(rows), 0.5), where=f_low != f_high)
        time = np.where(open_, low + share * (high - low), time)
        table = problem.resample(record, time)
        v = table[:, 1]
        left = open_ & (v * sign > 0.0)
        right = open_ & ~left
        f_high = np.where(left & (kept < 0.0), 0.5 * f_high, f_high)
        f_low = np.where(right & (kept > 0.0), 0.5 * f_low, f_low)
        low, f_low = np.where(left, time, low), np.where(left, v, f_low)
        high, f_high = np.where(right, time, high), np.where(right, v, f_high)
        kept = np.where(left, -1.0, np.where(right, 1.0, kept))
    return time, table[:, 0], sign


_BEYOND: Final = 0.01
"""Time by which a run extends beyond the last section, as a fraction of the period; arbitrary."""
# Time between an impact and a section, as a fraction of the period, below which the two coincide; arbitrary
_ON_IMPACT: Final = 1e-3


def quiet_section(
    regime: Regime, state: FloatArray, firings: int, tolerance: float
) -> tuple[Regime, FloatArray] | None:
    """Choose the phase farthest from all contacts of an orbit; return regime and state at that phase.

    Parameters
    ----------
    regime : Regime
        Regime with the phase at which the state is known.
    state : array, shape (2,)
        Displacement [m] and velocity [m/s].
    firings : int
        Number of firings after which the orbit repeats.
    tolerance : float
        Tolerance of the integration.

    Returns
    -------
    tuple or None
        Regime with the new phase, and state at its section; None if a run ends early.
    """
    flight = _around(regime, state, firings, tolerance)
    if flight is None:
        return None
    problem, record, times = flight
    begin = problem.start
    if not times.size:
        return regime, state
    # Contacts of all firings count together: the section is at the same phase after each.
    gaps = np.diff(np.append(times, times[0] + regime.period))
    widest = int(np.argmax(gaps))
    late = (times[widest] + 0.5 * gaps[widest]) % regime.period
    (row,) = problem.resample(record, np.array([begin + late]))
    phase = (regime.phase + late / regime.period) % 1.0
    return replace(regime, phase=float(phase)), row[:2].copy()


def is_on_impact(regime: Regime, state: FloatArray, firings: int, tolerance: float) -> bool:
    """Whether an orbit hits a rigid backstop within a thousandth of a period of the strobe section."""
    backstop = regime.hammer.backstop
    if backstop is None or backstop.law != "rigid":
        return False
    flight = _around(regime, state, firings, tolerance)
    if flight is None:
        return False
    times = flight[2] / regime.period
    return bool((np.minimum(times, 1.0 - times) < _ON_IMPACT).any())


def _around(
    regime: Regime, state: FloatArray, firings: int, tolerance: float
) -> tuple[Problem, Record, FloatArray] | None:
    """Integrate an orbit over `firings` drive periods from its state at the section; None if the run fails.

    Returns the problem, the record of the run, and sampled times of contact [s]. These times are measured
    from the section, modulo the drive period.
    """
    train, _ = regime.train(firings + 1)
    begin, *_, end = (float(time) for time in regime.moments(train, firings))
    try:
        problem = Problem(regime.hammer, train, (float(state[0]), float(state[1])), begin, tolerance)
    except InputError:
        return None
    # An orbit that begins at a contact ends at one, or just before it.
    record = problem.run(end + _BEYOND * regime.period)
    if record.status_name != "ok":
        return None
    return problem, record, np.unique(_busy(record.contacts, begin, end) % regime.period)


def state_later(regime: Regime, state: FloatArray, phase: float, tolerance: float) -> FloatArray:
    """Follow a motion from its state at a section to the next time of the section phase `phase`.

    Returns displacement [m] and velocity [m/s] at that time; NaN if the run ends early.
    """
    train, _ = regime.train(2)
    begin = float(regime.moments(train, 1)[0])
    problem = Problem(regime.hammer, train, (float(state[0]), float(state[1])), begin, tolerance)
    end = begin + (phase - regime.phase) % 1.0 * regime.period
    record = problem.run(end)
    return record.nodes[-1, 1:3].copy() if record.status_name == "ok" else np.full(2, np.nan)


def mirror_image(regime: Regime, state: FloatArray, tolerance: float) -> FloatArray | None:
    """Compute the state (m, m/s) at which the mirror image of a motion passes the section.

    The mirror image, x -> -x about a center, half a period later, is a motion of the same hammer if the
    forces are odd about the center, as in Duffing's equation. The center is the hammer's origin, or the
    middle between two rigid stops with the same restitution. None if a pack, a backstop or pulses act on one
    side only; NaN if a run ends early.
    """
    center = _center(regime.hammer)
    if center is None or regime.drive is None:
        return None
    half = state_later(regime, state, (regime.phase + 0.5) % 1.0, tolerance)
    return np.array([2.0 * center, 0.0]) - half


def _center(hammer: Hammer) -> float | None:
    """Return the position [m] about which the contacts of a hammer are symmetric; None without symmetry."""
    front, backstop = hammer.pack, hammer.backstop
    if front is None and backstop is None:
        return hammer.origin
    if not (isinstance(front, RigidFront) and isinstance(backstop, RigidBackstop)):
        return None
    return 0.5 * (front.front + backstop.position) if front.restitution == backstop.restitution else None


def _busy(contacts: FloatArray, begin: float, end: float) -> FloatArray:
    """Sample every contact of a run at 20 evenly spaced times; return these times minus `begin` [s].

    The run lasts from `begin`, a section, to `end`. A contact that is open at either end is sampled up to
    that end.
    """
    times = [np.zeros(0)]
    for _surface, t_in, _v_in, t_out, *_ in contacts:
        low, high = (begin if np.isnan(t_in) else t_in), (end if np.isnan(t_out) else t_out)
        times.append(np.linspace(low, high, 20 if high > low else 1) - begin)
    return np.concatenate(times)
