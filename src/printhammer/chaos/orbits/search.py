"""Search for periodic orbits, stable and unstable: guesses from motions, closed by Newton's method."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, SupportsIndex, Unpack

import numpy as np

from printhammer.chaos.orbits.guesses import PHASES, close_returns, first_state, joined, record, spread
from printhammer.chaos.orbits.maps import ExactMaps, FastMaps
from printhammer.chaos.orbits.newton import Closing, Guess, close_orbits
from printhammer.chaos.orbits.orbit import KINDS, STABLE, Orbit, no_orbit, orbit_of, orbits_table
from printhammer.chaos.strobe.map import MAP_TOLERANCE, read_state
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.results import Column, Result, part, scalar
from printhammer.results.stacking import stacked
from printhammer.run.problem import TOLERANCE, check_tolerance
from printhammer.run.regime import Firing, Regime
from printhammer.support.threads import Progress, mapped, thread_count

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import numpy.typing as npt
    import pandas as pd

    from printhammer.chaos.orbits.guesses import Records
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

LONGEST: Final = 8
"""Largest number of firings of the orbits that are looked for unless told otherwise."""

MOST_FIRINGS: Final = 64
STARTS: Final = 1024
GUESSES: Final = 48
"""Number of states from which motions are followed, and of guesses for each number of firings."""

_LONG: Final = 400
"""Firings of the train from rest in which close returns are looked for."""
_SAME: Final = 1e-6
"""Distance, in half-widths of the window, up to which states of two orbits are one."""
_FAST: Final[dict[str, Any]] = {"goal": 1e-9, "enough": 1e-7, "iterations": 30}
_EXACT: Final[dict[str, Any]] = {"goal": 1e-13, "enough": 1e-9, "iterations": 8}
_LONE: Final[dict[str, Any]] = {"goal": 1e-13, "enough": 1e-9, "iterations": 60}


class Orbits(Result):
    """The periodic orbits that a search has found, and what became of the search.

    That an orbit is not among them does not prove that there is none.
    """

    regime: Regime = part("hammer and periodic drive")
    found: tuple[Orbit, ...] = part("the orbits, by number of firings, stable ones first")
    longest: int = scalar("1", "largest number of firings that was looked for")
    starts: int = scalar("1", "number of motions in which close returns were looked for")
    guesses: tuple[int, ...] = scalar("1", "number of guesses for orbits of 1, 2, ... firings")
    repeats: int = scalar("1", "how many guesses led to an orbit of another one, or to one of fewer firings")
    failures: Mapping[str, int] = part("how many guesses led nowhere, by reason")
    tolerance: float = part("tolerance of the integration")

    @property
    def title(self) -> str:
        """One line that says what the orbits are."""
        return f"periodic orbits of {self.regime.hammer.name}, every {self.regime.period:.9g} s"

    def __len__(self) -> int:
        return len(self.found)

    def __iter__(self) -> Iterator[Orbit]:
        return iter(self.found)

    def __getitem__(self, place: int) -> Orbit:
        return self.found[place]

    @property
    def stable(self) -> tuple[Orbit, ...]:
        """Those that are stable."""
        return tuple(orbit for orbit in self.found if orbit.kind == STABLE)

    @property
    def counts(self) -> dict[str, int]:
        """Number of orbits of each kind that there is."""
        counts = Counter(orbit.kind for orbit in self.found)
        return {kind: counts[kind] for kind in KINDS if counts[kind]}

    @property
    def message(self) -> str:
        """What was found and what became of the other guesses, in one line."""
        what = ", ".join(f"{number} {kind}" for kind, number in self.counts.items())
        count = len(self.found)
        most = "1 firing" if self.longest == 1 else f"up to {self.longest} firings"
        head = f"{count or 'no'} orbit{'' if count == 1 else 's'} of {most}"
        tried = f"{sum(self.guesses)} guesses in motions from {self.starts} states"
        ends = [f"{self.repeats} led to one of these again"] if self.repeats else []
        ends += [f"{number}: {reason}" for reason, number in sorted(self.failures.items())]
        return f"{head}{f' ({what})' if what else ''}; {tried}{': ' if ends else ''}{'; '.join(ends)}"

    def notes(self) -> dict[str, Any]:
        """Return what became of the search, for the attributes of the Dataset."""
        ends = "; ".join(f"{number}: {reason}" for reason, number in sorted(self.failures.items()))
        return {"failures": ends, "search": self.message}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return what is known of the orbits over `orbit`, `firing` and `multiplier`.

        Beyond the last firing of an orbit numbers are NaN, and the mode is -1.
        """
        number = Column("1", "number of the orbit", ("orbit",), "coordinate", name="orbit", dtype=np.int32)
        return {"orbit": (number, np.arange(len(self.found))), **stacked(self.found, "orbit", Orbit)}

    def to_dataframe(self) -> pd.DataFrame:
        """Return a row for each firing of each orbit."""
        return orbits_table(self.found, self.attributes)


def orbits(
    hammer: Hammer | Regime,
    *,
    longest: SupportsIndex = LONGEST,
    starts: SupportsIndex = STARTS,
    guesses: SupportsIndex = GUESSES,
    tolerance: float = MAP_TOLERANCE,
    threads: int | None = None,
    progress: Progress | None = None,
    **firing: Unpack[Firing],
) -> Orbits:
    """Search for the periodic orbits of a hammer under a periodic drive, stable and unstable.

    Motions from rest and from states spread over the plane are followed; where one nearly comes back to
    where it was some firings before, Newton's method on the strobe map is tried. Nothing is left to chance:
    the same search finds the same orbits, whatever the number of threads.

    Parameters
    ----------
    hammer : Hammer or Regime
        The hammer; or the hammer with all that `firing` says of it. The search chooses the phase itself.
    longest : int, optional
        Largest number of firings of an orbit, at most 64.
    starts : int, optional
        Number of states from which motions are followed beside that from rest.
    guesses : int, optional
        Number of guesses for each number of firings; at most as many again are made of shorter orbits that
        are known by then.
    tolerance : float, optional
        Error allowed in one step of the runs that the orbits are found with in the end.
    threads : int, optional
        By default as many as there are cores.
    progress : callable, optional
        Called now and then with the amount of work that is done and of all.
    **firing
        How the hammer is fired, as for `printhammer.Regime.of`.

    Returns
    -------
    Orbits
        With a count of what became of the guesses; a search that finds nothing is no exception.

    Raises
    ------
    InputError
        An argument is not what is described above.
    """
    regime = Regime.of(hammer, **firing)
    most, several = read_count(longest, "longest"), read_count(guesses, "guesses")
    count = read_count(starts, "starts")
    if most > MOST_FIRINGS:
        raise InputError(f"longest = {most}, expected at most {MOST_FIRINGS} firings")
    check_tolerance(tolerance)
    return _Search(regime, most, several, tolerance, thread_count(threads), progress).run(count)


def orbit(
    regime: Regime,
    state: npt.ArrayLike,
    *,
    firings: SupportsIndex = 1,
    phase: float | None = None,
    tolerance: float = MAP_TOLERANCE,
    threads: int | None = None,
) -> Orbit:
    """Return the periodic orbit near a strobe point.

    Parameters
    ----------
    regime : Regime
        Hammer and periodic drive.
    state : array, shape (2,)
        Displacement, m, and velocity, m/s, at a section.
    firings : int, optional
        Number of firings after which the motion is to repeat.
    phase : float, optional
        Instead of that of the regime. The armature must not be on its way out of the pack there, where the
        state has a memory.
    tolerance, threads
        As for `orbits`.

    Returns
    -------
    Orbit
        Of fewer firings where the motion repeats after a divisor of theirs. With a status: that there is
        none near is no exception.

    Raises
    ------
    InputError
        An argument is not what is described above.
    """
    regime, count = Regime.of(regime, phase=phase), read_count(firings, "firings")
    check_tolerance(tolerance)
    states = [read_state(state)]
    if count > MOST_FIRINGS:
        raise InputError(f"firings = {count}, expected at most {MOST_FIRINGS}")
    scales = regime.window.half_widths
    exact = ExactMaps(regime, tolerance, threads)
    for _ in range(count - 1):
        images = exact(states[-1][np.newaxis], np.ones(1, np.int64))
        if images.reasons[0] or not np.isfinite(images.states).all():
            break
        states.append(images.states[0])
    # Where a section in between falls into the pack, the orbit is closed as a whole.
    segments = np.ones(count, np.int64) if len(states) == count else np.array([count])
    guess = np.array(states[: len(segments)])
    (closing,) = close_orbits(exact, guess[np.newaxis], segments[np.newaxis], scales, **_LONE)
    if not closing.closed:
        return no_orbit(regime, count, tolerance, closing.reason)
    return orbit_of(regime, shortest(closing, scales), tolerance)


def shortest(closing: Closing, scales: FloatArray) -> Closing:
    """Return an orbit that is not the repeat of a shorter one."""
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
class _Search:
    """A search that is under way."""

    regime: Regime
    longest: int
    several: int
    tolerance: float
    threads: int
    progress: Progress | None

    def __post_init__(self) -> None:
        self.scales = self.regime.window.half_widths
        self.failures: Counter[str] = Counter()
        self.tried = [0] * self.longest
        self.repeats = 0
        self.done, self.all = 0, 1

    def run(self, starts: int) -> Orbits:
        rest = np.array([first_state(self.regime)])
        self.all = 2 + 2 * self.longest
        (settling, *_others) = record(self.regime, rest, 1, _LONG, self.threads)
        begun = np.vstack([rest, spread(self.regime, starts, settling.states[0])])
        records = record(self.regime, begun, 2 * self.longest, _LONG, self.threads)
        self._tell(1)
        closed: list[tuple[Regime, Closing]] = []
        for place, (phase, kept) in enumerate(zip(PHASES, records, strict=True)):
            inside = np.isfinite(records[0].states).all(axis=2) & ~records[0].usable
            if place and not inside.any():
                continue
            regime = replace(self.regime, phase=phase)
            closed += [(regime, closing) for closing in self._through(regime, kept)]
        self._tell(self.all - self.done - 1)
        described = self._described(closed)
        self._tell(1)
        return Orbits(
            regime=self.regime,
            found=tuple(described),
            longest=self.longest,
            starts=len(begun),
            guesses=tuple(self.tried),
            repeats=self.repeats,
            failures=dict(self.failures),
            tolerance=self.tolerance,
        )

    def _tell(self, more: int) -> None:
        self.done += more
        if self.progress is not None:
            self.progress(self.done, self.all)

    def _through(self, regime: Regime, records: Records) -> list[Closing]:
        """Return the different orbits through one section."""
        fast = FastMaps(regime, TOLERANCE, self.longest, self.threads)
        different: list[Closing] = []
        for period in range(1, self.longest + 1):
            tried = close_returns(records, period, self.several, self.scales)
            tried += joined(different, period, self.several, self.scales)
            self.tried[period - 1] += len(tried)
            for closing in _closed(fast, tried, self.scales, _FAST):
                self._add(different, closing)
            self._tell(1)
        exact = ExactMaps(regime, self.tolerance, self.threads)
        refined: list[Closing] = []
        for closing in _closed(exact, different, self.scales, _EXACT):
            self._add(refined, closing)
        return refined

    def _add(self, different: list[Closing], closing: Closing) -> None:
        """Add an orbit that closes unless it is among them: orbits that share a state are one."""
        if not closing.closed:
            self.failures[closing.reason] += 1
            return
        closing = shortest(closing, self.scales)
        for k, other in enumerate(different):
            gaps = np.abs((other.states[:, np.newaxis] - closing.states) / self.scales).max(axis=2)
            if gaps.min() <= _SAME:
                self.repeats += 1
                if closing.firings.sum() < other.firings.sum():
                    different[k] = closing
                return
        different.append(closing)

    def _described(self, closed: Sequence[tuple[Regime, Closing]]) -> list[Orbit]:
        """Return all about the orbits, without those that were found at another section too."""
        different: list[Orbit] = []
        for orbit in mapped(lambda pair: orbit_of(*pair, self.tolerance), closed, self.threads):
            if not orbit.ok:
                self.failures[orbit.status] += 1
            elif any(self._same(orbit, other) for other in different):
                self.repeats += 1
            else:
                different.append(orbit)
        return sorted(
            different, key=lambda orbit: (orbit.firings, KINDS.index(orbit.kind), *orbit.x, *orbit.v)
        )

    def _same(self, orbit: Orbit, other: Orbit) -> bool:
        if orbit.firings != other.firings:
            return False
        gaps = np.maximum(
            np.abs(orbit.x[0] - other.x) / self.scales[0], np.abs(orbit.v[0] - other.v) / self.scales[1]
        )
        nearest = int(np.argmin(gaps))
        memory = abs(orbit.memory[0] - other.memory[nearest]) / self.scales[0]
        return bool(max(gaps[nearest], memory) <= _SAME and orbit.branch[0] == other.branch[nearest])


def _closed(
    maps: ExactMaps | FastMaps,
    tried: Sequence[Guess],
    scales: FloatArray,
    options: Mapping[str, Any],
) -> list[Closing]:
    """Return what becomes of guesses, in their order; those with as many segments are closed together."""
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
