"""Map of printing regimes: all periodic orbits of a hammer, followed along the rate.

Stable and unstable orbits are searched for at several rates; each orbit that lies on no known branch is
followed in both directions. Period doublings and crossings lead to further branches. An isola, a closed loop
of orbits between two folds that is joined to no other branch, is missed if it lies between successive search
rates.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, SupportsIndex, Unpack

import numpy as np

from printhammer.chaos.continuation.arclength import Steps
from printhammer.chaos.continuation.branch import MOST, Branch, BranchEvent, branches_table
from printhammer.chaos.continuation.crossings import CROSSINGS
from printhammer.chaos.continuation.tracer import PRECISION, Tracer, read_bounds
from printhammer.chaos.orbits.orbit import Orbit
from printhammer.chaos.orbits.search import orbits
from printhammer.chaos.strobe.map import MAP_EFFORT
from printhammer.drive.base import Overlap
from printhammer.drive.input import period_of_rate, read_count, read_positive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import RATE
from printhammer.results import Column, Result, part
from printhammer.results.result import stacked
from printhammer.results.summary import (
    Grid,
    Summary,
    styled,
)
from printhammer.run.effort import Effort, Keywords, computation
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray

if TYPE_CHECKING:
    import pandas as pd

SEEDS: Final = 6
"""Default number of rates at which periodic orbits are searched for; arbitrary."""

_TOGETHER: Final = 4  # Arbitrary
"""Number of branches followed in parallel; fixed, so that the result does not depend on threads."""
_SAME: Final = 1e-4
"""Distance, in half-widths of the strobe window, within which an orbit lies on a branch; arbitrary."""


class Branches(Result):
    """Branches of periodic orbits continued in the same parameter.

    The list may be incomplete: further branches may exist.
    """

    found: tuple[Branch, ...] = part("branches, sorted by number of firings, then by order of discovery")
    refused: tuple[str, ...] = part(
        "one sentence per orbit that could not be followed, and per search that found no orbit", default=()
    )

    @property
    def title(self) -> str:
        """Title of the set of branches, with the name of the parameter."""
        return f"branches of periodic orbits along {self.found[0].parameter if self.found else ''}"

    def summary(self) -> Summary:
        """Summarise the branches, their events, and the reasons for stopping."""
        parts: list[str | Grid] = []
        for number, branch in enumerate(self, 1):
            parts.append(f"{styled('strong', number)}  {branch.message}")
            parts += [*branch.summary(), ""]
        refused = [f"{styled('poor', 'not followed')} {sentence}" for sentence in self.refused]
        return Summary([*parts, self.message, *refused])

    def __len__(self) -> int:
        return len(self.found)

    def __iter__(self) -> Iterator[Branch]:
        return iter(self.found)

    def __getitem__(self, place: int) -> Branch:
        return self.found[place]

    @property
    def message(self) -> str:
        """Summary of the branches in one line: number, periods, closed loops and failures."""
        if not self.found:
            return "; ".join(("no branch was found", *self.refused))
        counts = Counter(branch.firings for branch in self.found)
        kinds = ", ".join(f"{number} of period {firings}" for firings, number in sorted(counts.items()))
        islands = sum(branch.closed for branch in self.found)
        closed = f", {islands} of them closed loops" if islands else ""
        missed = f"; {len(self.refused)} could not be followed" if self.refused else ""
        number = len(self.found)
        return f"{number} branch{'es' if number > 1 else ''}: {kinds}{closed}{missed}"

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the first branch, which is the provenance of all branches."""
        return self.found[0].provenance if self.found else super().provenance

    def notes(self) -> dict[str, Any]:
        """Return messages and stable ranges of the branches, for the attributes of the Dataset."""
        first = self.found[0] if self.found else None
        names = ("parameter", "bounds", "phase")
        ends = {f"branch_{i}": branch.message for i, branch in enumerate(self.found)}
        stable = [[list(pair) for pair in branch.stable_ranges] for branch in self.found]
        return {**{name: getattr(first, name, None) for name in names}, **ends, "stable_ranges": stable}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables of all branches along `branch`, padded with NaN or -1."""
        return stacked(self.found, "branch", Branch)

    def to_dataframe(self) -> pd.DataFrame:
        """Convert the branches to a table with one row per branch, orbit and firing."""
        return branches_table(self.found, self.attributes)


class InterruptedBranches(KeyboardInterrupt):
    """Raised when the search for branches is interrupted.

    Attributes
    ----------
    branches : Branches
        The branches followed to their ends before the interrupt.
    """

    def __init__(self, branches: Branches) -> None:
        super().__init__("interrupted")
        self.branches = branches


@computation
def regimes(
    hammer: Hammer | Regime,
    rates: tuple[float | str, float | str],
    *,
    longest: SupportsIndex = 3,
    seeds: SupportsIndex = SEEDS,
    doublings: SupportsIndex = 0,
    waveform: Waveform | None = None,
    overlap: Overlap | None = None,
    most: SupportsIndex = MOST,
    effort: Effort = MAP_EFFORT,
    **_keywords: Unpack[Keywords],
) -> Branches:
    """Find the printing regimes of a hammer, stable or not, over a range of rates.

    Parameters
    ----------
    hammer : Hammer or Regime
        The hammer, or a regime, whose rate is ignored.
    rates : tuple
        Smallest and largest rate [Hz] or text with a unit.
    longest : int, optional
        Largest orbit period to search for, in firings.
    seeds : int, optional
        Number of rates, evenly spaced inside the range, at which orbits are searched for.
    doublings : int, optional
        Number of generations of new branches to follow, from period doublings and crossings.
    waveform, overlap
        For a hammer: as for `printhammer.Regime.of`.
    most
        As for `printhammer.continuation`, for every branch.

    Returns
    -------
    Branches
        Branches found, with a sentence for each rate without orbits and each orbit that could not be
        followed.

    Raises
    ------
    InputError
        An argument is not as described above.
    InterruptedBranches
        The search was interrupted (Ctrl-C); carries the branches finished by then.
    """
    try:
        low, high = (read_positive(rate, "Hz", "rates") for rate in rates)
    except (TypeError, ValueError):
        raise InputError.of("rates", rates, "the least and the largest rate") from None
    if not low < high:
        raise InputError.of("rates", rates, "the least and the largest rate, ascending")
    count, levels = read_count(seeds, "seeds"), read_count(doublings, "doublings", least=0)
    steps = Steps(most=read_count(most, "most"), precision=PRECISION)
    collected = _Collected((low, high), steps, effort.quiet)
    many = read_count(longest, "longest")
    period = None if isinstance(hammer, Regime) else period_of_rate(low)
    start = Regime.of(hammer, period=period, waveform=waveform, overlap=overlap)
    with collected.kept_at_interrupt():
        for k in range(count):
            rate = low + (high - low) * (k + 0.5) / count
            search = orbits(start.with_(RATE, rate), longest=many, threads=effort.threads)
            if not search.found:
                collected.refused.append(f"at {rate:.9g} Hz {search.message}")
            collected.add(list(search.found))
            effort.report(k + 1, count + levels)
        for k in range(levels):
            collected.switch(k)
            effort.report(count + k + 1, count + levels)
    return collected.result()


def follow_doublings(
    branch: Branch, levels: int, *, most: int = MOST, threads: int | None = None
) -> Branches:
    """Follow the branches born at period doublings and crossings of a branch, for `levels` generations.

    Returns the branch itself together with all branches found.

    Raises
    ------
    InterruptedBranches
        The search was interrupted (Ctrl-C); carries the branches finished by then.
    """
    steps = Steps(most=most, precision=PRECISION)
    collected = _Collected(branch.bounds, steps, Effort(branch.tolerance, threads))
    collected.found.append(branch)
    with collected.kept_at_interrupt():
        for k in range(levels):
            collected.switch(k)
    return collected.result()


class _Collected:
    """Branches found so far by a search, with methods that follow and add branches."""

    def __init__(self, bounds: tuple[float, float], steps: Steps, effort: Effort) -> None:
        self.bounds, self.steps, self.effort = bounds, steps, effort
        self.found: list[Branch] = []
        self.refused: list[str] = []
        self.done: set[tuple[int, int]] = set()

    def result(self) -> Branches:
        """Return all branches found, in ascending order of period."""
        return Branches(tuple(sorted(self.found, key=lambda branch: branch.firings)), tuple(self.refused))

    @contextmanager
    def kept_at_interrupt(self) -> Iterator[None]:
        """Context manager that converts an interrupt to `InterruptedBranches`, with the branches found."""
        try:
            yield
        except KeyboardInterrupt:
            raise InterruptedBranches(self.result()) from None

    def add(self, orbits: list[Orbit]) -> None:
        """Follow the branch through each orbit that lies on no known branch; append it to `found`."""
        left = list(orbits)
        while left:
            left = [orbit for orbit in left if not self.is_known(orbit)]
            now, left = left[:_TOGETHER], left[_TOGETHER:]
            for orbit, branch in zip(now, self.effort.mapped(self.followed, now, length=1), strict=True):
                if isinstance(branch, str):
                    self.refused.append(branch)
                elif not self.is_known(orbit):
                    self.found.append(branch)

    def followed(self, orbit: Orbit) -> Branch | str:
        """Follow the branch through an orbit; return the branch, or the failure as a sentence."""
        bounds = read_bounds(orbit.regime, RATE, self.bounds)
        tracer = Tracer(orbit.regime, RATE, bounds, self.effort.alone)
        try:
            return tracer.branch(np.array(orbit.section), orbit.firings, self.steps)
        except InputError as error:
            return f"{orbit.name} at {orbit.regime.rate:.9g} Hz: {error}"

    def is_known(self, orbit: Orbit) -> bool:
        """Whether an orbit lies on a branch that the search has already found."""
        alike = [branch for branch in self.found if branch.firings == orbit.firings]
        return any(_is_on(branch, orbit) for branch in alike)

    @staticmethod
    def switch_of(branch: Branch, event: BranchEvent) -> Callable[..., Branch] | None:
        """Return the method that follows the new branch at an event: a period doubling or a crossing.

        None if no other branch passes through the event.
        """
        if event.kind == "period doubling":
            return branch.doubled
        return branch.crossing if event.kind in CROSSINGS else None

    def switch(self, level: int) -> None:
        """Follow the new branches at period doublings and crossings of the branches in `found`.

        `level` is the index of the generation, counted from 0, for messages.
        """
        for number, branch in enumerate(list(self.found)):
            for place, event in enumerate(branch.events):
                follow = self.switch_of(branch, event)
                if follow is None or (number, place) in self.done:
                    continue
                self.done.add((number, place))
                if any(_has_end_at(other, event.value, event.state) for other in self.found):
                    continue
                try:
                    born = follow(event, most=self.steps.most, threads=self.effort.threads)
                except InputError as error:
                    self.refused.append(f"level {level + 1}, {event.kind} at {event.value:.9g}: {error}")
                    continue
                middle = born.orbit(len(born) // 2)
                alike = [other for other in self.found if other.firings == born.firings]
                if not middle.ok or not any(_is_on(other, middle) for other in alike):
                    self.found.append(born)


def _state_at(orbit: Orbit, phase: float) -> FloatArray:
    """Compute the state (m, m/s) of an orbit at the section with the phase `phase`."""
    if phase == orbit.phase:
        return orbit.section
    motion = orbit.motion()
    x, v = motion.at(motion.start + ((phase - orbit.phase) % 1.0) * orbit.regime.period)
    return np.array([x[0], v[0]])


def _has_end_at(branch: Branch, value: float, state: FloatArray) -> bool:
    """Whether a branch ends in a period doubling at the state `state` and the parameter value `value`."""
    scales = np.append(branch.regime.window.half_widths, (branch.bounds[1] - branch.bounds[0]))
    place = np.append(state, value)
    return any(
        stop.reason == "period doubling"
        and bool(np.abs((np.append(stop.state, stop.parameter) - place) / scales).max() < _SAME)
        for stop in branch.stops
    )


def _is_on(branch: Branch, orbit: Orbit) -> bool:
    """Whether an orbit lies on a branch, tested at the section of every segment of the branch."""
    return any(_is_at_section(branch, orbit, float(phase)) for phase in np.unique(branch.phases))


def _is_at_section(branch: Branch, orbit: Orbit, phase: float) -> bool:
    """Whether an orbit lies on any segment of the branch at the section with the phase `phase`."""
    value, state = orbit.regime.value(branch.parameter), _state_at(orbit, phase)
    half_widths = branch.regime.window.half_widths
    values = branch.values
    there = (branch.phases[:-1] == phase) & (branch.phases[1:] == phase)
    between = np.flatnonzero(((values[:-1] - value) * (values[1:] - value) <= 0.0) & there)
    work = Tracer(
        branch.regime, branch.parameter, branch.bounds, Effort(branch.tolerance, threads=1)
    ).at_phase(phase)
    for i in between:
        for k in range(branch.firings):
            # The distance from the chord is a quick test; the orbit itself is compared afterwards.
            ends = np.array([[branch.x[j, k], branch.v[j, k]] for j in (i, i + 1)]) / half_widths
            reach = float(np.abs(ends[1] - ends[0]).max()) + 0.05
            if np.abs(ends - state / half_widths).max(axis=1).min() > reach:
                continue
            share = 0.5 if values[i] == values[i + 1] else (value - values[i]) / (values[i + 1] - values[i])
            guess = (ends[0] + share * (ends[1] - ends[0])) * half_widths
            exact = work.at(value, guess, branch.firings)
            if exact is not None and np.abs((exact - state) / half_widths).max() < _SAME:
                return True
    return False
