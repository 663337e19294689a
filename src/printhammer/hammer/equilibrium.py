"""Statics of a hammer: equilibria of the armature, their stability, and the holding margin.

An equilibrium is a displacement at which the static forces cancel: magnet at a constant current, spring,
elastic force of the backstop, and the loading branch of the pack (as when fresh paper is pressed slowly;
equilibria inside the pack neglect the hysteresis of the paper). The paper finds the rest state "by an
iteration on x such that Ft = 0" at zero current, with the armature compressing the backstop.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from printhammer.errors import InputError
from printhammer.hammer.static_force import HammerLike, StaticForce, statics_of
from printhammer.hammer.statics import (
    CRUSHED,
    EMPTY,
    FARTHER,
    LIFTED,
    MOST_PLACES,
    RESTS,
    UNSTABLE,
    Work,
    compressed,
    fill_grid,
    is_stable,
    rest_position,
)
from printhammer.support.arrays import FloatArray
from printhammer.support.roots import MOST_POINTS, Root, roots

_PLACES: Final = 401  # Number of grid points of the search for sign changes of the pull; arbitrary
_LARGEST_CURRENT: Final = 1e6  # Current limit of magnet laws without a stated range, A; arbitrary

NO_REST: Final = {
    CRUSHED: (
        "at zero current the backstop is crushed down to {1:.6g} m",
        "a backstop that holds the armature",
    ),
    LIFTED: ("at the backstop the net force at zero current is {1:.6g} N", "a negative force"),
    UNSTABLE: ("it has no stable equilibrium at zero current", None),
}
"""Reason why a hammer has no rest state, and the expectation in the error message, by search outcome."""


@dataclass(frozen=True)
class Equilibrium:
    """Equilibrium of the armature at a constant current."""

    x: float
    """Displacement of the armature, m."""
    stable: bool
    """Whether the force returns the armature to the equilibrium after a small displacement in either
    direction."""
    frequency: float | None
    """Natural frequency of small undamped oscillations, Hz; None if unstable, on a rigid stop, or in a pack
    with memory, which has no unique stiffness."""
    surface: str | None
    """Surface in contact with the armature, "backstop" or "pack"; None for a free armature."""


@dataclass(frozen=True)
class EquilibriumPicture:
    """Statics of a hammer: equilibria, release current and holding margin."""

    rest: float | None
    """Rest position of the armature at zero current, m; None without a rest state."""
    no_rest: str
    """Reason why there is no rest state; empty if the hammer has a rest state."""
    equilibria: tuple[Equilibrium, ...]
    """Equilibria at zero current, in ascending order."""
    release_current: float | None
    """Coil current at which the armature lifts off the backstop, A; None without such a current."""
    x: FloatArray
    """Displacements from the backstop to the end of the stroke, m."""
    margin: FloatArray
    """Holding margin at each displacement of `x`, N."""
    weakest: tuple[float, float]
    """Smallest holding margin on the grid `x`: its displacement, m, and its value, N."""
    positive_intervals: tuple[tuple[float, float], ...]
    """Intervals of x, m, where the net force at zero current drives the armature toward the paper."""


def rest_state(hammer: HammerLike) -> float:
    """Return the displacement at which the armature rests at zero current, m.

    If the net force of magnet and spring presses the armature against an elastic backstop, the armature rests
    where the compressed backstop balances this net force; on a rigid backstop, it rests at the position of
    the backstop. If the net force at the backstop is zero, and the hammer has a magnet or a rigid pack, the
    armature rests at the position of the backstop. In all other cases the armature rests at the stable
    equilibrium nearest to the origin.

    Raises
    ------
    InputError
        The hammer has no rest state, e.g. because magnet and spring pull the armature off the backstop.
    """
    out = [math.nan, math.nan]
    code = rest_position(statics_of(hammer), _work(), out)
    if code == RESTS:
        return float(out[0])
    if code == EMPTY:
        raise _empty(*out)
    because, expected = NO_REST[code]
    raise InputError(
        f"{_named(hammer)} has no rest state: {because.format(*out)}", key="rest", expected=expected
    )


def equilibria(
    hammer: HammerLike, current: float = 0.0, within: tuple[float, float] | None = None
) -> list[Equilibrium]:
    """Find all equilibria of the armature at a constant current, in ascending order.

    The search covers the displacements at which the laws of magnet and spring are valid, from a rigid
    backstop on, and up to a rigid stop on the paper side, to the platen or to the back of the pack. It is
    also limited to 1 m on either side of the origin, extended to 10, 100 and 1000 m as long as no stable
    equilibrium is found. Intervals in which the net force is zero throughout are not reported.

    Parameters
    ----------
    hammer
        Hammer whose equilibria are searched for.
    current
        Coil current, A.
    within
        Lower and upper end of the search interval, m, instead of the default interval.

    Raises
    ------
    InputError
        The current is not finite or outside the range of the magnet's law, or the search interval is empty.
    """
    force = StaticForce(hammer)
    smallest, largest = _currents(hammer)
    if not smallest <= current <= largest:
        bounds = f"is expected to be from {smallest:g} to {largest:g} A"
        raise InputError(
            f"current = {current!r} {bounds}, where the law of the magnet holds", key="current", value=current
        )
    resting = [_equilibrium_at(force, root, current) for root in _same_rest(force, current, within)]
    if force.rigid and hammer.backstop is not None:
        position = hammer.backstop.position
        inside = within is None or within[0] <= position <= within[1]
        if inside and force.free(position, current) < 0.0:
            resting.insert(0, Equilibrium(position, True, None, "backstop"))
    if force.statics.rigid_front:
        inside = within is None or within[0] <= force.front <= within[1]
        if inside and force.free(force.front, current) > 0.0:
            resting.append(Equilibrium(force.front, True, None, "pack"))
    return resting


def release_current(hammer: HammerLike) -> float:
    """Return the smallest current that lifts the armature off the backstop, A.

    At that current the force of magnet and spring at the position of the backstop vanishes. For equation (3),
    I = (Am - sqrt((F0 + Fs(b)) sqrt(b))) / Bm. Of two solutions of opposite sign, the solution of smaller
    magnitude is returned; 0 if the net force at zero current is not negative.

    Raises
    ------
    InputError
        The hammer has no backstop or magnet, or no current within the range of the magnet's law lifts the
        armature.
    """
    force = StaticForce(hammer)
    if hammer.backstop is None or hammer.magnet is None:
        missing = "magnet" if hammer.magnet is None else "backstop"
        raise InputError(f"{_named(hammer)} has no release current: it has no {missing}", key="release")
    position = hammer.backstop.position

    def net(current: float) -> float:
        return force.free(position, current)

    if net(0.0) >= 0.0:
        return 0.0
    low, high = _currents(hammer)
    lifting: list[float] = []
    for sign, limit in ((1.0, high), (-1.0, -low)):
        if limit > 0.0:
            grid = [sign * size for size in _away_from_zero(1e-9, limit)]
            crossed = [root.x for root in roots(net, sorted(grid))]
            lifting += sorted(crossed, key=abs)[:1]
    if not lifting:
        because = f"none from {low:g} to {high:g} A lifts the armature"
        raise InputError(f"{_named(hammer)} has no release current: {because}", key="release")
    return min(lifting, key=abs)


def holding_margin(hammer: HammerLike, x: npt.ArrayLike) -> FloatArray:
    """Return the force [N] that holds the armature back at zero current, at displacements x [m].

    The margin is minus the net force of magnet and spring, without contacts: positive where the net force
    drives the armature to the backstop. At rest it equals the force on the backstop. NaN outside the range of
    the magnet's law.
    """
    force = StaticForce(hammer)
    places = np.asarray(x, dtype=np.float64)
    return np.array([-force.free(float(place)) for place in places.ravel()]).reshape(places.shape)


def positive_intervals(hammer: HammerLike) -> list[tuple[float, float]]:
    """Return the intervals of displacement [m] in which the net force at zero current is positive.

    In such an interval the net force of magnet and spring drives the armature toward the paper, and the
    armature may never return to the backstop. The search runs from the backstop to the platen or, without a
    platen, to the back of the pack. The list is empty for a hammer without a backstop.
    """
    if hammer.backstop is None:
        return []
    force = StaticForce(hammer)
    start, end = max(force.low, hammer.backstop.position), force.end
    if not start < end:
        return []
    crossings = [root.x for root in roots(force.free, _grid(force, start, end))]
    marks = [start, *(x for x in crossings if start < x < end), end]
    positive: list[tuple[float, float]] = []
    for left, right in itertools.pairwise(marks):
        if force.free(0.5 * (left + right)) > 0.0:
            joined = bool(positive) and positive[-1][1] == left
            positive.append((positive.pop()[0] if joined else left, right))
    return positive


def pull_reversals(hammer: HammerLike) -> list[float]:
    """Return the displacements [m] at which the pull of a measured magnet changes sign, ascending.

    The pull is the force at the largest current of the table minus the force at zero current; the search runs
    from the backstop to the end of the table. The list is empty for a law that is not a table.
    """
    most = max(_currents(hammer), key=abs)
    if hammer.magnet is None or abs(most) >= _LARGEST_CURRENT:
        return []
    force = StaticForce(hammer)
    low, high = hammer.magnet.domain
    start = low if hammer.backstop is None else max(low, hammer.backstop.position)
    if not (math.isfinite(start) and math.isfinite(high) and start < high):
        return []
    crossings = roots(
        lambda x: force.magnet(x, most) - force.magnet(x), np.linspace(start, high, _PLACES).tolist()
    )
    return [root.x for root in crossings if start < root.x < high]


def equilibrium_picture(hammer: HammerLike, points: int = 241) -> EquilibriumPicture:
    """Compute the statics of a hammer, with the holding margin on a uniform grid of `points` points."""
    force = StaticForce(hammer)
    try:
        rest, reason = rest_state(hammer), ""
    except InputError as error:
        rest, reason = None, str(error)
    try:
        release = release_current(hammer)
    except InputError:
        release = None
    start = hammer.backstop.position if hammer.backstop is not None else force.low
    x = np.linspace(start, force.end, points)
    margin = holding_margin(hammer, x)
    least = int(np.nanargmin(margin)) if np.isfinite(margin).any() else 0
    return EquilibriumPicture(
        rest=rest,
        no_rest=reason,
        equilibria=tuple(equilibria(hammer)),
        release_current=release,
        x=x,
        margin=margin,
        weakest=(float(x[least]), float(margin[least])),
        positive_intervals=tuple(positive_intervals(hammer)),
    )


def _work() -> Work:
    """Allocate the working space of a search as lists, which are faster than arrays in Python code."""
    room = MOST_POINTS * MOST_PLACES
    return Work([0.0] * MOST_PLACES, [0.0] * room, [0.0] * room, np.empty((room, 3)), _ascending)


def _ascending(numbers: list[float], count: int) -> int:
    """Sort the first `count` numbers of a list and drop duplicates; return the number of distinct numbers."""
    different = sorted(set(numbers[:count]))
    numbers[: len(different)] = different
    return len(different)


def _empty(low: float, high: float) -> InputError:
    return InputError(
        f"the range {low:g} to {high:g} m is empty", key="range", expected="the lower end first"
    )


def _equilibrium_at(force: StaticForce, root: Root, current: float) -> Equilibrium:
    """Convert a root of the net force to an `Equilibrium`, with stability, frequency and surface."""
    stable = _is_stable(root, force)
    surface = None
    if force.hammer.backstop is not None and root.x < force.hammer.backstop.position:
        surface = "backstop"
    elif root.x > force.front:
        surface = "pack"
    frequency = None
    if stable and not (surface == "pack" and force.memory):
        slope = force.slope(root.x, current)
        frequency = math.sqrt(max(-slope, 0.0) / force.hammer.mass) / (2.0 * math.pi)
    return Equilibrium(root.x, stable, frequency, surface)


def _is_stable(root: Root, force: StaticForce) -> bool:
    """Whether the force drives the armature back to the root from each side that no rigid stop blocks."""
    return is_stable(root.x, root.before, root.after, force.statics)


def _roots(force: StaticForce, current: float, within: tuple[float, float] | None = None) -> list[Root]:
    low, high = within if within is not None else (force.low, force.high)
    low, high = max(low, force.limits[0]), min(high, force.limits[1])
    if not low < high:
        raise _empty(low, high)
    crossings = roots(lambda x: force.total(x, current), _grid(force, low, high))
    if within is not None:
        return crossings
    # Dimensionless oscillators may have their equilibria some metres away.
    for far in FARTHER[1:]:
        if any(_is_stable(root, force) for root in crossings) or force.reach(far) == (low, high):
            break
        low, high = force.reach(far)
        wider = roots(lambda x: force.total(x, current), _grid(force, low, high))
        crossings = wider or crossings
    return crossings


def _same_rest(force: StaticForce, current: float, within: tuple[float, float] | None) -> list[Root]:
    """Find all roots of the net force; the root at the backstop is exactly the result of `rest_state`."""
    crossings = _roots(force, current, within)
    backstop = force.hammer.backstop
    if backstop is None or force.rigid or not force.free(backstop.position, current) < 0.0:
        return crossings
    rest = compressed(current, force.low, force.statics)
    if math.isnan(rest):
        return crossings
    same = 1e-9 * (backstop.position - rest) + 4.0 * math.ulp(rest)
    return [replace(root, x=rest) if abs(root.x - rest) <= same else root for root in crossings]


def _grid(force: StaticForce, low: float, high: float) -> list[float]:
    """Return a search grid from `low` to `high` [m], ascending and without duplicates; see `fill_grid`."""
    places = [0.0] * MOST_PLACES
    return sorted(set(places[: fill_grid(low, high, force.statics, places)]))


def _away_from_zero(first: float, limit: float) -> list[float]:
    """Return 0 and a geometric sequence of currents from `first` to `limit` [A], 12 points per decade."""
    if limit <= first:
        return [0.0, limit]
    count = max(2, math.ceil(12.0 * math.log10(limit / first)) + 1)
    return [0.0, *np.geomspace(first, limit, count).tolist()]


def _currents(hammer: HammerLike) -> tuple[float, float]:
    """Return the range of currents [A] in which the magnet's law is valid."""
    low, high = getattr(hammer.magnet, "current_range", (-_LARGEST_CURRENT, _LARGEST_CURRENT))
    return float(low), float(high)


def _named(hammer: HammerLike) -> str:
    return f"the hammer {hammer.name!r}"
