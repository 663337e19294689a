"""Initial guesses of periodic orbits: segments of motions that nearly return to their starts.

Close returns of a recorded motion lie near unstable orbits (D. Auerbach et al., Phys. Rev. Lett. 58 (1987)
2387). Here the record is one long train from rest, and many short motions from states spread evenly over the
plane, to find orbits that no train from rest approaches.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from printhammer.chaos.orbits.newton import CLOSED, FastMaps, Guess
from printhammer.chaos.strobe.map import WITH_MEMORY, front_with_memory, state_later
from printhammer.errors import InputError
from printhammer.hammer.equilibrium import rest_state
from printhammer.results import Declared, part
from printhammer.run.ensemble import Ensemble
from printhammer.run.problem import TOLERANCE
from printhammer.run.regime import Regime
from printhammer.support.arrays import BoolArray, FloatArray

PHASES: Final = (0.0, 0.5)  # Arbitrary
"""Section phases of the search; orbits inside the pack at the first phase are found at the second."""

_ALIKE: Final = 0.02
"""Distance, in half-widths of the strobe window, below which two guesses are duplicates; arbitrary."""
_EARLY_ALIKE: Final = 0.1  # Arbitrary
"""Distance, in half-widths, below which two guesses from the first firings of motions are duplicates."""
_LOOKED_AT: Final = 4000
"""Maximum number of close returns, closest first, that are tested for duplicates; arbitrary."""
_EARLY: Final = 2
"""Number of firings from the start of a motion within which a close return is early; arbitrary."""
_LEAST: Final = 16
"""Smallest number of firings over which a motion is recorded; arbitrary."""
_ROOM: Final = 1.2
"""Extent of the initial states beyond the strobe window, in half-widths of the window; arbitrary."""
# Extent of the initial states without a bound: a ball with one bounce per period rises to 5 half-widths;
# arbitrary
_SCALES: Final = 6.0
_NEAR: Final = 64  # Number of guesses near each known orbit of a period whose index sum is not 1; arbitrary
_SIZES: Final = (-6.0, -1.5)
"""Range of decimal logarithms of the displacements of known orbits, in half-widths of the strobe window.

Near chatter, orbits that differ by one bounce lie close together. Tuned on the ball of Tufillaro at 60 Hz."""
_NEARBY: Final = (-1.5, -0.5)  # Arbitrary
"""Range of decimal logarithms of the distances of starts from states of known orbits, in half-widths."""
_PLASTIC: Final = 1.324717957244746
"""Real root of x^3 = x + 1, whose inverse powers spread points evenly over a square."""


class Records(Declared):
    """States of many motions at the sections of one phase, as a source of close returns."""

    states: FloatArray = part(
        "displacement, m, and velocity, m/s, shape (M, n, 2)", more="NaN after the end of a run"
    )
    usable: BoolArray = part("whether displacement and velocity are the whole state, shape (M, n)")
    begins: bool = part("whether the first record is the long record of the train from rest", default=True)

    def rows(self, begin: int, end: int) -> Records:
        """Return the records of the motions with indices from `begin` up to, but excluding, `end`."""
        return Records(self.states[begin:end], self.usable[begin:end], begins=not begin)


def firings_for(period: int) -> int:
    """Compute the number of firings to record per motion in a search for orbits of `period` firings."""
    return max(2 * period, _LEAST)


def record(
    regime: Regime, starts: FloatArray, firings: int, long: int, threads: int | None = None
) -> list[Records]:
    """Simulate motions from the initial states `starts`, displacement [m] and velocity [m/s], shape (M, 2).

    The motion from the first state lasts `long` firings; every other motion lasts `firings` firings. Returns,
    for each section phase in `PHASES`, the states at the sections.
    """
    longest = max(firings, long) if len(starts) else 0
    drive, _ = regime.train(longest + 1)
    moments = {phase: regime.moments(drive, longest, phase) for phase in PHASES}
    counts = np.where(np.arange(len(starts)) == 0, long, firings)
    times = np.sort(np.concatenate([*moments.values()]))
    ends = moments[PHASES[-1]][counts]
    result = Ensemble(
        regime.hammer,
        drive,
        ends,
        states=starts,
        starts=float(moments[0.0][0]),
        tolerance=TOLERANCE,
    ).run(strobes=[times[times <= end] for end in ends], threads=threads)
    table = result.strobes
    assert table is not None
    records = []
    for own in moments.values():
        columns = np.searchsorted(times, own)
        x, v, branch = (part[:, columns] for part in (table.x, table.v, table.branch))
        out = (x > front_with_memory(regime.hammer)) & (v <= 0.0)
        usable = np.isfinite(x) & ~np.isin(branch, WITH_MEMORY) & ~out
        records.append(Records(np.stack([x, v], axis=2), usable))
    return records


def spread(regime: Regime, count: int, visited: FloatArray) -> FloatArray:
    """Distribute `count` initial states evenly: half over the strobe window, half over a larger rectangle.

    The rectangle contains the window, the states `visited` and the range up to the pack. If backstop and pack
    do not both bound the displacement, the rectangle extends over at least six half-widths of the window on
    either side: in the bouncing-ball model, an orbit with one impact per period rises to five half-widths.
    Each row of the result contains displacement [m] and velocity [m/s].
    """
    window = regime.window
    low, high = np.array([window.x[0], window.v[0]]), np.array([window.x[1], window.v[1]])
    known = visited[np.isfinite(visited).all(axis=1)]
    wide_low, wide_high = low.copy(), high.copy()
    if len(known):
        middle, half = 0.5 * (known.max(axis=0) + known.min(axis=0)), 0.5 * np.ptp(known, axis=0)
        wide_low = np.minimum(low, middle - _ROOM * half)
        wide_high = np.maximum(high, middle + _ROOM * half)
    if regime.hammer.front is not None:
        wide_high[0] = max(wide_high[0], regime.hammer.front)
    if regime.hammer.front is None or regime.hammer.position is None:
        reach = _SCALES * window.half_widths
        wide_low = np.minimum(wide_low, np.array([regime.hammer.origin, 0.0]) - reach)
        wide_high = np.maximum(wide_high, np.array([regime.hammer.origin, 0.0]) + reach)
    wide_high[1] = max(wide_high[1], -wide_low[1])
    wide_low[1] = -wide_high[1]
    number = np.arange(1, count + 1)[:, np.newaxis]
    share = (0.5 + number * np.array([1.0 / _PLASTIC, 1.0 / _PLASTIC**2])) % 1.0
    odd = (number % 2).astype(bool)
    states: FloatArray = np.where(odd, wide_low + share * (wide_high - wide_low), low + share * (high - low))
    # Outside the range of the laws, or behind a rigid backstop, no motion can start.
    backstop = regime.hammer.backstop
    least, most = regime.hammer.domain
    if backstop is not None and backstop.law == "rigid":
        least = max(least, backstop.position)
    states[:, 0] = np.clip(states[:, 0], least, most)
    return states


def first_state(regime: Regime) -> tuple[float, float]:
    """Return the rest state (m, m/s) of the hammer; without a rest state, the middle of its strobe window."""
    try:
        return rest_state(regime.hammer), 0.0
    except InputError:
        window = regime.window
        return 0.5 * (window.x[0] + window.x[1]), 0.0


def touches(regime: Regime, count: int) -> FloatArray:
    """Compute `count` states at a firing of motions that left a rigid backstop since the previous firing.

    Each row contains displacement [m] and velocity [m/s]. The phases at which the motions leave are spread
    evenly, their speeds more densely at low values: near chatter, an accumulation of ever lower bounces,
    orbits are so dense that no even spread over the plane resolves them. If a run ends before the firing, the
    state is that of `first_state`.
    """
    number = np.arange(1, count + 1)
    phases, shares = ((0.5 + number / _PLASTIC**k) % 1.0 for k in (1, 2))
    place, fastest = regime.hammer.position, _SCALES * regime.window.half_widths[1]
    states = np.array(
        [
            state_later(replace(regime, phase=float(phase)), np.array([place, speed]), 0.0, TOLERANCE)
            for phase, speed in zip(phases, fastest * shares**2, strict=True)
        ]
    ).reshape(-1, 2)
    return np.where(np.isfinite(states).all(axis=1, keepdims=True), states, first_state(regime))


def close_returns(
    records: Records, period: int, most: int, scales: FloatArray, within: int
) -> tuple[list[Guess], list[Guess]]:
    """Select segments of motions that return closest to their starts after `period` firings, as guesses.

    Only the first `within` firings of the short records are used. Two lists without duplicates are returned:
    the closest of all returns, and the closest of the returns that begin within the first `_EARLY` firings of
    a motion. Each contains at most half of `most` guesses; a larger `most` extends both lists. Distances are
    divided by `scales`, the half-widths of the strobe window.
    """
    scaled = records.states / scales
    count = scaled.shape[1] - period
    if count <= 0:
        return [], []
    gap = np.abs(scaled[:, period:] - scaled[:, :count]).max(axis=2)
    gap = np.where(records.usable[:, period:] & records.usable[:, :count], gap, np.inf)
    # The first record is the long record.
    rows = slice(1, None) if records.begins else slice(None)
    gap[rows, max(within - period + 1, 0) :] = np.inf
    # Late returns are close to attractors, early returns cover the plane.
    early = gap.copy()
    early[:, _EARLY:] = np.inf
    lists: list[list[Guess]] = []
    for among, up_to, apart in ((gap, most - most // 2, _ALIKE), (early, most // 2, _EARLY_ALIKE)):
        guesses: list[Guess] = []
        kept = np.empty((up_to, period, 2))
        flat = among.reshape(-1)
        known = int(np.isfinite(flat).sum())
        for place in np.argsort(flat, kind="stable")[: min(known, _LOOKED_AT)]:
            if len(guesses) == up_to:
                break
            member, first = divmod(int(place), count)
            cycle = scaled[member, first : first + period]
            if _is_new(cycle, kept[: len(guesses)], apart):
                kept[len(guesses)] = cycle
                starts = np.flatnonzero(records.usable[member, first : first + period])
                lengths = np.diff(np.append(starts, period)).astype(np.int64)
                guesses.append(Guess(records.states[member, first + starts], lengths))
        lists.append(guesses)
    return lists[0], lists[1]


def joined(
    shorter: Sequence[Guess], period: int, most: int, scales: FloatArray, known: Collection[tuple[int, int]]
) -> list[Guess]:
    """Concatenate pairs of the orbits `shorter` into initial guesses for orbits of `period` firings.

    At most `most` pairs are used, in ascending order of the distance between the two orbits, scaled by
    `scales`. Pairs whose indices are in `known` are skipped.
    """
    guesses: list[tuple[float, Guess]] = []
    for k, orbit in enumerate(shorter):
        for j, other in enumerate(shorter[:k]):
            if (j, k) in known or int(orbit.firings.sum() + other.firings.sum()) != period:
                continue
            gaps = np.abs((orbit.states[:, np.newaxis] - other.states) / scales).max(axis=2)
            here, there = (int(place) for place in np.unravel_index(np.argmin(gaps), gaps.shape))
            states = [np.roll(orbit.states, -here, axis=0), np.roll(other.states, -there, axis=0)]
            firings = [np.roll(orbit.firings, -here), np.roll(other.firings, -there)]
            guess = Guess(np.concatenate(states), np.concatenate(firings))
            guesses.append((float(gaps[here, there]), guess))
    return [guess for _gap, guess in sorted(guesses, key=lambda pair: pair[0])[:most]]


def moves_near(rng: np.random.Generator, count: int) -> FloatArray:
    """Draw `count` random offsets of states, in half-widths of the strobe window, shape (count, 2)."""
    sizes, angles = 10.0 ** rng.uniform(*_NEARBY, count), rng.uniform(0.0, 2.0 * np.pi, count)
    return np.asarray(sizes[:, np.newaxis] * np.column_stack([np.cos(angles), np.sin(angles)]))


def motions(maps: FastMaps, starts: FloatArray, period: int) -> list[Guess]:
    """Simulate motions from `starts` over `period` firings, as guesses; omit motions whose run fails.

    The motions need not return to their starts: Newton's method often leads from such a guess to an orbit
    near which no recorded motion returns closely.
    """
    table = starts[:, np.newaxis]
    for _ in range(period - 1):
        images = maps(table[:, -1], np.ones(len(table), np.int64))
        kept = images.reasons == CLOSED
        table = np.concatenate([table[kept], images.states[kept, np.newaxis]], axis=1)
    return [Guess(cycle, np.ones(period, np.int64)) for cycle in table]


def displaced(
    orbits: Sequence[Guess], period: int, rng: np.random.Generator, scales: FloatArray, lowest: FloatArray
) -> list[Guess]:
    """Build guesses from known orbits of `period` firings by random displacements of their states.

    Displacements are in units of `scales`. No component of a state becomes smaller than that of `lowest`.
    """
    # The same displacements for every orbit, so that a larger search includes those of a smaller search.
    sizes = 10.0 ** rng.uniform(*_SIZES, (_NEAR, 1, 1))
    moves = sizes * scales * rng.uniform(-1.0, 1.0, (_NEAR, period, 2))
    return [
        Guess(np.maximum(orbit.states + move[: len(orbit.states)], lowest), orbit.firings)
        for orbit in orbits
        for move in moves
    ]


def _is_new(cycle: FloatArray, kept: FloatArray, apart: float) -> bool:
    """Whether a cycle of scaled states differs by more than `apart` from every cycle in `kept`.

    All cyclic shifts of a cycle are equivalent.
    """
    if not len(kept):
        return True
    return all(
        float(np.abs(kept - np.roll(cycle, shift, axis=0)).max(axis=(1, 2)).min()) > apart
        for shift in range(len(cycle))
    )
