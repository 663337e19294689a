"""Stages of a search for periodic orbits: blocks of starts, batches of guesses, branches through orbits.

*Branches.* A branch of periodic orbits through a known orbit may turn back at its folds and return to the
period of the drive, at orbits so unstable that no motion comes close to them. Such orbits are found by
following the branch.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from printhammer.chaos.continuation.arclength import Steps, follow
from printhammer.chaos.continuation.family import RegimeFamily
from printhammer.chaos.continuation.fixed_points import Corrector, between
from printhammer.chaos.orbits.collection import Orbits, index_sums, indices_add_up
from printhammer.chaos.orbits.guesses import (
    PHASES,
    Records,
    close_returns,
    displaced,
    firings_for,
    first_state,
    joined,
    motions,
    moves_near,
    record,
    spread,
    touches,
)
from printhammer.chaos.orbits.newton import Closing, ExactMaps, FastMaps, Guess, close_orbits
from printhammer.chaos.orbits.orbit import KINDS, Orbit, multipliers_of, orbit_of
from printhammer.chaos.strobe.map import mirror_image
from printhammer.errors import InputError
from printhammer.hammer.names import PERIOD
from printhammer.run.effort import Effort
from printhammer.run.problem import TOLERANCE
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray

SHARE: Final = 0.05
"""Half-range of drive periods over which a branch is followed, as a fraction of the period; arbitrary."""

_PARTS: Final = 5.0  # Ratio of parameter range to parameter scale, as in `continuation.tracer`
_STEPS: Final = Steps(most=150, precision=1e-10)


def crossings(orbit: Orbit) -> list[FloatArray]:
    """Follow the branch through an orbit; return the states at which it returns to the drive period."""
    regime, own = orbit.regime, orbit.regime.period
    if PERIOD not in regime.names:
        return []
    family = RegimeFamily(regime, PERIOD, orbit.firings, orbit.tolerance)
    scales = np.append(regime.window.half_widths, 2.0 * SHARE * own / _PARTS)
    bounds = ((1.0 - SHARE) * own, (1.0 + SHARE) * own)
    try:
        curve = follow(family, orbit.section, own, scales=scales, bounds=bounds, steps=_STEPS)
    except InputError:
        return []
    corrector = Corrector(family, scales, _STEPS.precision)
    states = []
    for here, ahead in itertools.pairwise(curve.nodes):
        if (here.parameter - own) * (ahead.parameter - own) >= 0.0:
            continue
        middle = between(corrector, here, ahead, (own - here.parameter) / (ahead.parameter - here.parameter))
        node = None if middle is None else corrector.at_parameter(corrector.scaled(middle.state, own))
        if node is not None:
            states.append(node.state)
    return states


_LONG: Final = 400  # Arbitrary
"""Number of firings of the long record, the train from rest, that is searched for close returns."""
_BLOCKS: Final = (128, 1024)  # Arbitrary
"""Allowed numbers of starts, ascending, continued by doubling the last; requests are rounded up."""
_BATCHES: Final = (8, 48)  # Arbitrary
"""Allowed numbers of guesses, ascending, continued by doubling the last; requests are rounded up."""
_EVEN: Final = 8
"""Orbit period, in firings, below which the number of guesses is raised in inverse proportion; arbitrary."""
_JOINED: Final = 48
"""Maximum number of guesses per stage and period that are concatenations of two shorter orbits; arbitrary."""
_TOUCHES: Final = 4  # Arbitrary
"""Ratio, among the starts, of evenly spread states to states just after a touch of a rigid backstop."""
_COMPLETED: Final = 6  # Arbitrary
"""Largest period, in firings, that is searched again if its fixed-point indices do not sum to 1."""
_MORE: Final = 512
"""Number of additional guesses for a period whose fixed-point indices do not sum to 1; arbitrary."""
_ROUNDS: Final = 8
"""Largest number of rounds of guesses near the states of all known orbits; arbitrary."""
_SAME: Final = 1e-6
"""Distance, in half-widths of the strobe window, below which two orbits share a state; arbitrary."""
_FAST: Final[dict[str, Any]] = {"goal": 1e-9, "enough": 1e-7, "iterations": 30}
"""Settings of Newton's method for all guesses; residuals in half-widths of the strobe window; arbitrary."""
_EXACT: Final[dict[str, Any]] = {"goal": 1e-13, "enough": 1e-9, "iterations": 8}
"""Settings of Newton's method for the orbits found with `_FAST`; arbitrary."""
LONE: Final[dict[str, Any]] = {"goal": 1e-13, "enough": 1e-9, "iterations": 60}
"""Settings of Newton's method for a single initial guess; arbitrary."""


def shortest(closing: Closing, scales: FloatArray) -> Closing:
    """Shorten a closed orbit whose states repeat after a fraction of its firings to that fraction."""
    ends = np.cumsum(closing.firings)
    total = int(ends[-1])
    for k in range(1, len(closing.states)):
        after = int(ends[k - 1])
        gap = float(np.abs((closing.states[k] - closing.states[0]) / scales).max())
        if total % after == 0 and gap <= _SAME:
            parts = closing.states[:k], closing.firings[:k], closing.jacobians[:k]
            return Closing(*parts, closing.residual, closing.smooth, closing.reason)
    return closing


@dataclass
class _Known:
    """Orbit found by a search: number of guesses that led to it, and stages (block, batch) that found it."""

    closing: Closing
    stages: list[tuple[int, int]]
    hits: int = 1

    def is_visible(self, block: int, batch: int) -> bool:
        """Whether a search up to a stage (block of starts, batch of guesses) has found the orbit."""
        return any(i <= block and j <= batch for i, j in self.stages)


@dataclass
class Search:
    """Search for periodic orbits, run in stages.

    Starts are divided into blocks, guesses into batches. The result of a stage depends only on stages with no
    more starts and no more guesses, so that a larger search never loses an orbit of a smaller search; only
    the guesses of `_complete`, which end once the fixed-point indices sum to 1, may differ.
    """

    regime: Regime
    longest: int
    several: int
    follow: int
    effort: Effort

    def __post_init__(self) -> None:
        self.scales = self.regime.window.half_widths
        backstop = self.regime.hammer.backstop
        self.is_rigid = backstop is not None and backstop.law == "rigid"
        self.lowest = np.array([self.regime.hammer.position if self.is_rigid else -np.inf, -np.inf])
        self.failures: Counter[str] = Counter()
        self.tried = [0] * self.longest
        self.repeats = 0
        self.done, self.all = 0, 1

    def run(self, starts: int) -> Orbits:
        """Run the search with motions from at least `starts` states; return the orbits."""
        self.blocks, self.batches = _steps(_BLOCKS, starts), _steps(_BATCHES, self.several)
        rest = np.array([first_state(self.regime)])
        self.all = 3 + 2 * self.longest * len(self.blocks) * len(self.batches)
        (settling, *_others) = record(self.regime, rest, 1, _LONG, self.effort.threads)
        begun = np.vstack([rest, spread(self.regime, self.blocks[-1], settling.states[0])])
        if self.is_rigid:
            begun = np.vstack([begun, touches(self.regime, self.blocks[-1] // _TOUCHES)])
        records = record(self.regime, begun, firings_for(self.longest), _LONG, self.effort.threads)
        self._tell(1)
        known: list[tuple[Regime, _Known]] = []
        for place, (phase, kept) in enumerate(zip(PHASES, records, strict=True)):
            inside = np.isfinite(records[0].states).all(axis=2) & ~records[0].usable
            if place and not inside.any():
                continue
            regime = replace(self.regime, phase=phase)
            known += [(regime, orbit) for orbit in self._through(regime, kept)]
        self._tell(self.all - self.done - 2)
        described: list[tuple[Orbit, int]] = []
        self._describe(described, known)
        self._tell(1)
        if self.follow:
            self._along(described)
        self._mirror(described)
        self._tell(1)
        ordered = sorted(
            described,
            key=lambda pair: (pair[0].firings, KINDS.index(pair[0].kind), *pair[0].x, *pair[0].v),
        )
        return Orbits(
            regime=self.regime,
            found=tuple(orbit for orbit, _hits in ordered),
            longest=self.longest,
            starts=len(begun),
            guesses=tuple(self.tried),
            repeats=self.repeats,
            hits=tuple(hits for _orbit, hits in ordered),
            failures=dict(self.failures),
            tolerance=self.effort.tolerance,
        )

    def _tell(self, more: int) -> None:
        self.done += more
        self.effort.report(self.done, self.all)

    def _through(self, regime: Regime, records: Records) -> list[_Known]:
        """Find all distinct orbits from recorded motions, at the section phase of a regime."""
        fast = FastMaps(regime, self.longest, self.effort.at(TOLERANCE))
        different: list[_Known] = []
        seen: set[bytes] = set()
        ends = np.cumsum([1 + self.blocks[0], *np.diff(self.blocks)])
        for block, (begin, end) in enumerate(itertools.pairwise([0, *ends.tolist()])):
            part = records.rows(begin, end)
            lists = [
                close_returns(part, period, _share(self.batches[-1], period), self.scales, 2 * self.longest)
                for period in range(1, self.longest + 1)
            ]
            for batch in range(len(self.batches)):
                for period, both in enumerate(lists, 1):
                    tried = [guess for guesses in both for guess in self._batch(guesses, batch, period)]
                    seen.update(guess.states.tobytes() for guess in tried)
                    tried += self._concatenate(different, period, (block, batch))
                    self._try(fast, different, tried, (block, batch))
                    self._tell(1)
        self._further(fast, different, records, seen)
        if indices_add_up(regime):
            self._complete(fast, different, records)
        return self._refine(regime, different)

    def _further(self, fast: FastMaps, different: list[_Known], records: Records, seen: set[bytes]) -> None:
        """Try additional close returns: of longer motions, and of motions that start just after a touch.

        These guesses are tried last, so that no orbit of the earlier stages is lost.
        """
        first = len(different)
        begin, last = 0, len(self.batches) - 1
        for block, end in enumerate(1 + np.array(self.blocks)):
            parts = [records.rows(begin, int(end))]
            behind = [1 + self.blocks[-1] + (place - 1) // _TOUCHES for place in (max(begin, 1), int(end))]
            if behind[1] <= len(records.states):
                parts.append(records.rows(*behind))
            begin = int(end)
            for period in range(1, self.longest + 1):
                many = _share(self.batches[-1], period)
                ways = [(parts[0], 2 * most) for most in _doublings(period, self.longest)]
                ways += [(part, firings_for(period)) for part in parts]
                tried = {
                    guess.states.tobytes(): guess
                    for part, within in ways
                    for guesses in close_returns(part, period, many, self.scales, within)
                    for guess in guesses
                }
                fresh = [guess for key, guess in tried.items() if key not in seen]
                seen.update(tried)
                self._try(fast, different, fresh, (block, last))
        known = set(itertools.combinations(range(first), 2))
        closings = [orbit.closing for orbit in different]
        for period in range(2, self.longest + 1):
            if len(different) > first:
                more = joined(closings, period, _JOINED, self.scales, known)
                self._try(fast, different, more, (len(self.blocks) - 1, last))

    def _complete(self, fast: FastMaps, different: list[_Known], records: Records) -> None:
        """Try more guesses for every period whose fixed-point indices do not sum to 1.

        The guesses are close returns, then motions that start near states of known orbits, and, with a rigid
        backstop, displaced orbits of the period. Mirror images of known orbits come first, since the sums
        include the images.
        """
        stage = len(self.blocks) - 1, len(self.batches) - 1
        reflected = self._reflect(fast, different, 0)
        for period in range(1, min(self.longest, _COMPLETED) + 1):
            if _index_sum(different, period) == 1:
                continue
            returns = close_returns(records, period, _MORE, self.scales, firings_for(period))
            self._try(fast, different, [guess for both in returns for guess in both], stage)
            reflected = self._reflect(fast, different, reflected)
            rng = np.random.default_rng(period)
            for move in moves_near(rng, _ROUNDS) * self.scales:
                own = [known.closing for known in different if known.closing.firings.sum() <= period]
                if not own or _index_sum(different, period) == 1:
                    break
                starts = np.concatenate([closing.states for closing in own]) + move
                started = motions(fast, np.maximum(starts, self.lowest), period)
                self._try(fast, different, started, stage, hits=0)
                reflected = self._reflect(fast, different, reflected)
            if self.is_rigid and _index_sum(different, period) != 1:
                own = [known.closing for known in different if known.closing.firings.sum() == period]
                moved = displaced(own, period, rng, self.scales, self.lowest)
                self._try(fast, different, moved, stage, hits=0)
                reflected = self._reflect(fast, different, reflected)

    def _reflect(self, fast: FastMaps, different: list[_Known], begin: int) -> int:
        """Try the mirror images of known orbits from index `begin` on; return the number of known orbits."""
        images = []
        for known in different[begin:]:
            states = [
                mirror_image(fast.regime, state, self.effort.tolerance) for state in known.closing.states
            ]
            if any(state is None or not np.isfinite(state).all() for state in states):
                continue
            images.append(Guess(np.array(states), known.closing.firings))
        self._try(fast, different, images, (len(self.blocks) - 1, len(self.batches) - 1), hits=0)
        return len(different)

    def _batch(self, guesses: list[Guess], batch: int, period: int) -> list[Guess]:
        """Select, from guesses for orbits of `period` firings, those that a batch adds to earlier batches."""
        begin, end = (_share(count, period) // 2 for count in (0, *self.batches)[batch : batch + 2])
        return guesses[begin:end]

    def _concatenate(self, different: list[_Known], period: int, stage: tuple[int, int]) -> list[Guess]:
        """Concatenate pairs of orbits known to a stage, except pairs that an earlier stage has tried."""
        block, batch = stage
        seen = [orbit for orbit in different if orbit.is_visible(block, batch)]
        before = [
            {k for k, orbit in enumerate(seen) if orbit.is_visible(i, j)}
            for i, j in ((block - 1, batch), (block, batch - 1))
        ]
        known = {pair for places in before for pair in itertools.combinations(sorted(places), 2)}
        return joined([orbit.closing for orbit in seen], period, _JOINED, self.scales, known)

    def _try(
        self,
        maps: ExactMaps | FastMaps,
        different: list[_Known],
        tried: list[Guess],
        stage: tuple[int, int],
        hits: int = 1,
    ) -> None:
        """Converge guesses by Newton's method; append new orbits to `different`, add `hits` to known orbits.

        Guesses derived from known orbits have no hits, since `Orbits.coverage` assumes independent guesses.
        """
        options = _FAST if isinstance(maps, FastMaps) else LONE
        for guess in tried:
            self.tried[int(guess.firings.sum()) - 1] += 1
        for closing in _converge(maps, tried, self.scales, options):
            self._add(different, _Known(closing, [stage], hits))

    def _refine(self, regime: Regime, different: list[_Known]) -> list[_Known]:
        """Converge the orbits of a search again at the requested tolerance."""
        exact = ExactMaps(regime, self.effort)
        refined: list[_Known] = []
        closings = _converge(exact, [orbit.closing for orbit in different], self.scales, _EXACT)
        for orbit, closing in zip(different, closings, strict=True):
            self._add(refined, replace(orbit, closing=closing))
        return refined

    def _add(self, different: list[_Known], new: _Known) -> None:
        """Append a closed orbit to `different`, or count a hit of the known orbit that shares a state."""
        if not new.closing.closed:
            self.failures[new.closing.reason] += 1
            return
        closing = shortest(new.closing, self.scales)
        for other in different:
            gaps = np.abs((other.closing.states[:, np.newaxis] - closing.states) / self.scales).max(axis=2)
            if gaps.min() <= _SAME:
                self.repeats += 1
                other.hits += new.hits
                other.stages += [stage for stage in new.stages if stage not in other.stages]
                if closing.firings.sum() < other.closing.firings.sum():
                    other.closing = closing
                return
        different.append(replace(new, closing=closing))

    def _is_repeat(self, orbit: Orbit) -> bool:
        """Whether an orbit that converged as one segment repeats after a fraction of its firings."""
        return any(
            self._is_same(orbit, replace(orbit, x=orbit.x[[k]], v=orbit.v[[k]], memory=orbit.memory[[k]]))
            for k in range(1, orbit.firings)
            if orbit.firings % k == 0
        )

    def _describe(self, described: list[tuple[Orbit, int]], known: Sequence[tuple[Regime, _Known]]) -> None:
        """Compute properties of orbits; append to `described` each orbit not yet found at another section."""
        quiet = self.effort.quiet
        orbits = quiet.mapped(lambda pair: orbit_of(pair[0], pair[1].closing, quiet.tolerance), known)
        for orbit, (_regime, own) in zip(orbits, known, strict=True):
            if not orbit.ok:
                self.failures[orbit.status] += 1
                continue
            if self._is_repeat(orbit):
                self.repeats += 1
                continue
            for place, (other, hits) in enumerate(described):
                if self._is_same(orbit, other):
                    self.repeats += 1
                    described[place] = other, hits + own.hits
                    break
            else:
                described.append((orbit, own.hits))

    def _along(self, described: list[tuple[Orbit, int]]) -> None:
        """Append to `described` orbits on the branches through short orbits, and concatenations with them."""
        first = [orbit for orbit, _hits in described]
        short = [orbit for orbit in first if orbit.firings <= self.follow and orbit.smooth]
        states = self.effort.quiet.mapped(crossings, short)
        for orbit, ways in zip(short, states, strict=True):
            exact = ExactMaps(orbit.regime, self.effort.alone)
            different: list[_Known] = []
            firings = np.array([orbit.firings])
            self._try(exact, different, [Guess(state[np.newaxis], firings) for state in ways], (0, 0))
            self._describe(described, [(orbit.regime, known) for known in different])
        by_phase: dict[float, list[Orbit]] = {}
        for orbit, _hits in described:
            by_phase.setdefault(orbit.phase, []).append(orbit)
        for phase, every in by_phase.items():
            # Pairs of the earlier orbits, first in the list, have been tried already.
            old = sum(orbit.phase == phase for orbit in first)
            if old == len(every):
                continue
            known = set(itertools.combinations(range(old), 2))
            exact = ExactMaps(every[0].regime, self.effort)
            closings = [_guess(orbit, exact) for orbit in every]
            tried = [
                guess
                for period in range(2, self.longest + 1)
                for guess in joined(closings, period, _JOINED, self.scales, known)
            ]
            different = []
            self._try(exact, different, tried, (0, 0))
            self._describe(described, [(every[0].regime, known) for known in different])

    def _mirror(self, described: list[tuple[Orbit, int]]) -> None:
        """Append to `described` the mirror images of known orbits, x -> -x half a period later.

        Contacts and drive must be symmetric. If other forces are not odd, Newton's method may find no orbit.
        """
        for orbit, _hits in list(described):
            regime = orbit.regime
            image = mirror_image(regime, orbit.section, self.effort.tolerance)
            if image is None or not np.isfinite(image).all():
                continue
            exact = ExactMaps(regime, self.effort)
            guess = _guess(replace(orbit, section=image), exact)
            for closing in _converge(exact, [guess], self.scales, LONE):
                if closing.closed:
                    self._describe(described, [(regime, _Known(closing, [], 0))])

    def _is_same(self, orbit: Orbit, other: Orbit) -> bool:
        if orbit.firings != other.firings:
            return False
        gaps = np.maximum(
            np.abs(orbit.x[0] - other.x) / self.scales[0], np.abs(orbit.v[0] - other.v) / self.scales[1]
        )
        nearest = int(np.argmin(gaps))
        memory = abs(orbit.memory[0] - other.memory[nearest]) / self.scales[0]
        return bool(max(gaps[nearest], memory) <= _SAME and orbit.branch[0] == other.branch[nearest])


def _index_sum(different: Sequence[_Known], period: int) -> int:
    """Sum the fixed-point indices of known orbits over `period` firings; see `index_sums`."""
    own = [(int(known.closing.firings.sum()), multipliers_of(known.closing.jacobians)) for known in different]
    return index_sums(own, period)[period]


def _share(guesses: int, period: int) -> int:
    """Scale the number of guesses for a period, so that all periods take about the same computation time."""
    return guesses * max(1, _EVEN // period)


def _doublings(first: int, below: int) -> list[int]:
    """Return `first` times the powers of 2, ascending, as long as the product is less than `below`."""
    return [first << k for k in range(below.bit_length()) if first << k < below]


def _steps(ladder: Sequence[int], most: int) -> list[int]:
    """Extend an ascending sequence by doubling its last term, up to the first term of at least `most`."""
    rungs = list(ladder)
    while rungs[-1] < most:
        rungs.append(2 * rungs[-1])
    return rungs[: 1 + next(k for k, rung in enumerate(rungs) if rung >= most)]


def _guess(orbit: Orbit, maps: ExactMaps) -> Guess:
    """Build a guess from the states of an orbit at its sections; a single segment if one is in the pack."""
    states = [orbit.section]
    for _ in range(orbit.firings - 1):
        images = maps(states[-1][np.newaxis], np.ones(1, np.int64))
        if images.reasons[0]:
            return Guess(orbit.section[np.newaxis], np.array([orbit.firings]))
        states.append(images.states[0])
    return Guess(np.array(states), np.ones(orbit.firings, np.int64))


def _converge(
    maps: ExactMaps | FastMaps,
    tried: Sequence[Guess],
    scales: FloatArray,
    options: Mapping[str, Any],
) -> list[Closing]:
    """Converge guesses by `close_orbits` with `options`; return one outcome per guess, in input order."""
    known: dict[int, Closing] = {}
    counts = [len(guess.firings) for guess in tried]
    for segments in sorted(set(counts)):
        rows = [i for i, count in enumerate(counts) if count == segments]
        states, firings = (
            np.array([getattr(tried[i], name) for i in rows]) for name in ("states", "firings")
        )
        closings = close_orbits(maps, states, firings, scales, **options)
        known |= dict(zip(rows, closings, strict=True))
    return [known[i] for i in range(len(tried))]
