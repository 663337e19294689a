"""Static force on the armature as plain functions, which can be compiled as entry points.

`Statics` holds the law functions of the parts with their constants: in Python the functions are defined in
the part modules, in compiled code in the kernel.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

from printhammer.support.roots import bisected, find_roots

NEAREST: Final = 1e-18
"""Smallest distance from an anchor in the search for equilibria, m; arbitrary, far below any compression."""

LEAST: Final = 5e-324
"""Smallest positive number of double precision."""

LEAST_NORMAL: Final = 2.2250738585072014e-308
"""Smallest normal number of double precision."""

FARTHER: Final = (1.0, 10.0, 100.0, 1000.0)
"""Search radii about the origin, m, used in turn if the hammer sets no limit; arbitrary."""

EVEN: Final = 1025
"""Number of evenly spaced points of the search grid for equilibria; arbitrary."""

DECADE: Final = 12.0
"""Number of grid points per decade of distance from an anchor (see `StaticForce.anchors`); arbitrary."""

RESTS, CRUSHED, LIFTED, UNSTABLE, EMPTY = range(5)
"""Outcomes of the search for a rest position: found; the backstop is compressed beyond the range of the
magnet law; the force at the backstop is not negative; no stable equilibrium; an empty range."""

MOST_PLACES: Final = 8192
"""Largest number of points of the search grid for equilibria, i.e. the length of its array; arbitrary."""


class Statics(NamedTuple):
    """Law functions and constants that determine the static force of a hammer.

    The law functions of absent parts are defined in `printhammer.parts.absent`.
    """

    magnet_force: Any
    """Force of the magnet, N."""
    spring_force: Any
    """Force of the spring, N."""
    pack_loading: Any
    """Force of the pack on its loading branch, N."""
    backstop_elastic: Any
    """Elastic force of the backstop, N."""
    spring_level: Any
    """Position of the kink of the spring law with a given index, m."""
    magnet: Any
    """Packed constants of the magnet."""
    spring: Any
    """Packed constants of the spring."""
    pack: Any
    """Packed constants of the pack."""
    backstop: Any
    """Packed constants of the backstop."""
    position: float
    """Position of the backstop, m; minus infinity without a backstop."""
    front: float
    """Front of the pack, m; infinity without a pack."""
    rigid: bool
    """Whether the backstop is rigid."""
    rigid_front: bool
    """Whether the front of the pack is a rigid stop."""
    memory: bool
    """Whether the force of the pack depends on its largest past indentation."""
    has_magnet: bool
    """Whether the hammer has a magnet."""
    low: float
    """Smallest displacement for which the laws of magnet and spring are valid, m."""
    high: float
    """Largest displacement for which the laws of magnet and spring are valid, m."""
    platen: float
    """Position of the platen, m; NaN without a platen."""
    thickness: float
    """Thickness of the pack, m; NaN without a pack."""


def free_force(x: float, current: float, s: Statics) -> float:
    """Return the net force [N] of magnet and spring, without contacts."""
    return float(s.magnet_force(s.magnet, x, current)) + float(s.spring_force(s.spring, x))


def total_force(x: float, current: float, s: Statics) -> float:
    """Return the net force including the contacts, N; the pack acts on its loading branch."""
    force = float(s.magnet_force(s.magnet, x, current)) + float(s.spring_force(s.spring, x))
    depth = s.position - x
    if depth > 0.0 and not s.rigid:
        force += float(s.backstop_elastic(s.backstop, math.sqrt(depth)))
    if x > s.front:
        force += float(s.pack_loading(s.pack, x, 0.0))
    return force


def force_at(x: float, about: tuple[float, Statics]) -> float:
    """Return the net force [N] at a displacement [m]; `about` is the pair of current [A] and statics."""
    return total_force(x, about[0], about[1])


def nearest_level(x: float, s: Statics) -> float:
    """Return the distance [m] from `x` to the nearest kink of the spring law; infinity without such a kink.

    A kink at `x` itself is ignored.
    """
    nearest = math.inf
    k = 0.0
    level = float(s.spring_level(s.spring, k))
    while level < math.inf:
        if level != x:
            nearest = min(nearest, abs(level - x))
        k += 1.0
        level = float(s.spring_level(s.spring, k))
    return nearest


def origin_of(s: Statics) -> float:
    """Return the position of the backstop, m, or 0 without a backstop."""
    return 0.0 if s.position == -math.inf else s.position


def limits_of(s: Statics) -> tuple[float, float]:
    """Return the range of displacements [m] that the laws of magnet and spring and rigid stops permit."""
    return max(s.low, s.position) if s.rigid else s.low, min(s.high, s.front) if s.rigid_front else s.high


def reach_of(far: float, s: Statics) -> tuple[float, float]:
    """Return the search interval for equilibria [m], at most `far` [m] from the origin."""
    low, high = limits_of(s)
    origin = origin_of(s)
    if not math.isnan(s.platen):
        high = min(high, s.platen)
    elif s.front < math.inf and not s.rigid_front:
        # A pack without thickness is searched to a depth equal to the distance of its front from the origin.
        depth = abs(s.front - origin) if math.isnan(s.thickness) else s.thickness
        high = min(high, s.front + depth)
    return max(low, origin - far), min(high, origin + far)


def compressed(current: float, low: float, s: Statics) -> float:
    """Return the displacement [m] at which a compressed elastic backstop balances magnet and spring.

    Of several such equilibria, the equilibrium nearest to the surface of the backstop is returned; NaN
    without an equilibrium above `low` [m]. `current` is the coil current, A.
    """
    depth = max(NEAREST, spacing(s.position))
    above = s.position
    while s.position - depth > low:
        below = s.position - depth
        if total_force(below, current, s) >= 0.0:
            return bisected(force_at, (current, s), below, above)
        above = below
        depth *= 1.25
    return math.nan


def spacing(x: float) -> float:
    """Return the distance from a number to the next number of larger magnitude, as `math.ulp` does."""
    x = abs(x)
    if x < LEAST_NORMAL:
        return LEAST
    power = 1.0
    while power > x:
        power *= 0.5
    while 2.0 * power <= x:
        power *= 2.0
    return power * 2.0**-52


def is_stable(x: float, before: float, after: float, s: Statics) -> bool:
    """Whether the force drives the armature back to the root `x` from each side that no rigid stop blocks.

    `before` and `after` are the force, or its sign, just below and just above the root.
    """
    low, high = limits_of(s)
    held = before > 0.0 or (s.rigid and x == low)
    return held and (after < 0.0 or (s.rigid_front and x == high))


def put_cluster(anchor: float, sign: float, limit: float, grid: Any, count: int) -> int:
    """Append an anchor and points on one side of it to the first `count` points of a grid.

    The points lie above the anchor if `sign` is 1, below if `sign` is -1; their distances from the anchor
    form a geometric sequence up to `limit` [m].

    Returns
    -------
    int
        New number of points of the grid.
    """
    grid[count] = anchor
    if limit <= NEAREST:
        grid[count + 1] = anchor + sign * limit
        return count + 2
    steps = max(2, math.ceil(DECADE * math.log10(limit / NEAREST)) + 1)
    first = math.log10(NEAREST)
    step = (math.log10(limit) - first) / (steps - 1)
    for k in range(steps):
        size = 10.0 ** (k * step + first)
        if k == 0 or k == steps - 1:
            size = NEAREST if k == 0 else limit
        grid[count + 1 + k] = anchor + sign * size
    return count + 1 + steps


def fill_grid(low: float, high: float, s: Statics, grid: Any) -> int:
    """Write an unsorted search grid from `low` to `high` [m] into `grid`.

    The grid consists of evenly spaced points, and of clusters of points at the anchors: the backstop, the
    front of the pack, the origin, and the ends of the range.

    Returns
    -------
    int
        Number of points, at most `MOST_PLACES`.
    """
    count = 0
    for k in range(EVEN):
        grid[count] = high if k == EVEN - 1 else low + k * ((high - low) / (EVEN - 1))
        count += 1
    first, last = reach_of(FARTHER[0], s)
    for place in (first, last, s.position, s.front, origin_of(s), 0.0, low, high):
        if first <= place <= last or place in (low, high):
            if high - place > 0.0:
                count = put_cluster(place, 1.0, high - place, grid, count)
            if place - low > 0.0:
                count = put_cluster(place, -1.0, place - low, grid, count)
    kept = 0
    for k in range(count):
        if low <= grid[k] <= high:
            grid[kept] = grid[k]
            kept += 1
    return kept


class Work(NamedTuple):
    """Working space of a search for equilibria."""

    grid: Any
    """Search grid, m, shape (`MOST_PLACES`,)."""
    places: Any
    """Points at which the force was evaluated, m, shape (3 `MOST_PLACES`,)."""
    values: Any
    """Net force at each of the `places`, N, shape (3 `MOST_PLACES`,)."""
    found: Any
    """Roots, m, with the signs of the force on both sides, shape (3 `MOST_PLACES`, 3)."""
    ascending: Any
    """Function that sorts the first numbers of the grid, drops duplicates and returns the count."""


def equilibria_between(low: float, high: float, current: float, s: Statics, work: Work) -> int:
    """Write the roots of the net force from `low` to `high` [m] into `work.found`; return their number."""
    count = work.ascending(work.grid, fill_grid(low, high, s, work.grid))
    return int(find_roots(force_at, (current, s), work.grid, count, work.places, work.values, work.found))


def has_stable(count: int, s: Statics, work: Work) -> bool:
    """Whether any of the first `count` roots in `work.found` is a stable equilibrium."""
    found = False
    for k in range(count):
        found = found or is_stable(work.found[k, 0], work.found[k, 1], work.found[k, 2], s)
    return found


def rest_position(s: Statics, work: Work, out: Any) -> int:
    """Find the position at which the armature rests at zero current; see `hammer.equilibrium.rest_state`.

    Returns
    -------
    int
        Outcome, such as `RESTS`. For `RESTS`, ``out[0]`` is the position [m]; otherwise `out` contains the
        numbers stated in the error message: ends of the range, m, or force at the backstop, N.
    """
    first, last = reach_of(FARTHER[0], s)
    if s.position > -math.inf:
        pressing = free_force(s.position, 0.0, s)
        if pressing < 0.0:
            out[0], out[1] = s.position if s.rigid else compressed(0.0, first, s), first
            return CRUSHED if math.isnan(out[0]) else RESTS
        if s.has_magnet or (s.rigid_front and pressing == 0.0):
            # Without any force, as for a plunger without a spring or a gear in its play, the armature stays
            # at the backstop.
            out[0], out[1] = s.position, pressing
            return RESTS if pressing == 0.0 else LIFTED
    if not first < last:
        out[0], out[1] = first, last
        return EMPTY
    count = equilibria_between(first, last, 0.0, s, work)
    # Dimensionless oscillators may have their equilibria some metres away.
    for far in FARTHER[1:]:
        low, high = reach_of(far, s)
        if has_stable(count, s, work) or (low == first and high == last):
            break
        first, last = low, high
        count = equilibria_between(first, last, 0.0, s, work)
    nearest = math.inf
    for k in range(count):
        x = work.found[k, 0]
        if not is_stable(x, work.found[k, 1], work.found[k, 2], s) or (x > s.front and s.memory):
            continue
        if abs(x - origin_of(s)) < nearest:
            nearest = abs(x - origin_of(s))
            out[0] = x
    if nearest == math.inf and s.rigid_front and free_force(s.front, 0.0, s) > 0.0:
        out[0] = s.front
        return RESTS
    return RESTS if nearest < math.inf else UNSTABLE


def sorted_in_place(numbers: Any, count: int) -> int:
    """Heapsort the first `count` numbers and drop duplicates; return the number of distinct numbers."""
    for step in range(count // 2 + count - 1, 0, -1):
        if step >= count:
            root, end = step - count, count
        else:
            root, end = 0, step
            numbers[0], numbers[end] = numbers[end], numbers[0]
        while 2 * root + 1 < end:
            child = 2 * root + 1
            if child + 1 < end and numbers[child] < numbers[child + 1]:
                child += 1
            if numbers[root] >= numbers[child]:
                break
            numbers[root], numbers[child] = numbers[child], numbers[root]
            root = child
    different = 0
    for k in range(count):
        if k == 0 or numbers[k] != numbers[different - 1]:
            numbers[different] = numbers[k]
            different += 1
    return different
