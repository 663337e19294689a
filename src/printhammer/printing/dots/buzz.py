"""Buzz printing: a train of pulses that prints while the armature stays clear of the backstop.

F. Hendriks (1983), Fig. 7: "Instead of allowing the armature to return fully to the backstop, current pulses
can be issued that are synchronized with the return of the armature from the paper." `find_buzz_train`
searches for such a train of the hammer's own pulses in two families: trains at a constant rate, and delayed
trains, in which each pulse follows the armature's departure from the pack by a constant delay. A delayed
train needs a sensor, and can stabilise a motion that is unstable at a constant period. Each train starts from
rest; if the first excursions are too large for a steady buzz, the armature may touch the backstop once before
the dots that count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final, Literal

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.nominal import pulse_of
from printhammer.printing.dots.settling import touches
from printhammer.results import Declared, part
from printhammer.run.ensemble import DotTable, Ensemble
from printhammer.run.motion import Motion
from printhammer.run.simulate import simulate
from printhammer.support.arrays import BoolArray

MAX_CURRENT: Final = 2.0  # Default limit on the coil current of a train, A: the range of the paper's Fig. 2

FORCES: Final = (0.3, 0.95)
"""Range of acceptable peak forces, as fractions of the single-pulse force; arbitrary."""

FEWEST: Final = 6
"""Smallest number of consecutive dots, without a backstop touch, accepted as buzz printing; arbitrary."""

_PULSES: Final = 9  # Number of pulses of a train, as in the paper
_PERIODS: Final = 96  # Number of trial periods of trains at a constant rate; arbitrary
_DELAY_STEP: Final = 2e-6
"""Spacing of the grid of trial delays, s; arbitrary."""

_DELAYS: Final = 400
"""Maximum number of delays searched; a slow hammer gets a wider spacing instead; arbitrary."""

PATIENCE: Final = 3.0  # Arbitrary
"""Time limit for a dot, as a multiple of the single pulse's time from firing to the end of contact."""

_ZOOMS, _PER_ZOOM = 2, 4  # Number of refinements, and divisor of the spacing per refinement; arbitrary


class Run(Declared):
    """Longest run of consecutive dots within the force range, without a backstop touch in between.

    Every firing of the run prints exactly one dot.
    """

    first: int = part("index of the firing that made the first dot of the run")
    forces: tuple[float, ...] = part("peak forces of the dots, as fractions of the single-pulse force")
    clear: bool = part(
        "whether no dot is lost and the backstop is not touched from the first dot of the train, which starts"
        " from rest, to the last dot of the run",
        more="the whole burst, not only the run, stays clear of the backstop",
    )
    touches: tuple[int, int, int] = part(
        "backstop touches before the first dot of the run, between its first and last dot, and after its last"
        " dot until the simulation ends",
        more="the simulation lasts long enough for a dot after the last firing",
    )

    @property
    def count(self) -> int:
        """Number of dots in the run; 0 if no dot is within the force range."""
        return len(self.forces)

    @property
    def weakest(self) -> float:
        """Smallest peak force of the run, as a fraction of the single-pulse force; 0 if the run is empty."""
        return min(self.forces, default=0.0)

    @property
    def touches_text(self) -> str:
        """Sentence for a report: number of backstop touches before, within and after the run."""
        before, between, after = self.touches
        return (
            f"Touches of the backstop: {before} before the first dot that counts, {between} between it and"
            f" the last, {after} after"
        )


class BuzzTrain(Run):
    """A simulated pulse train, with its longest run of dots within the force range."""

    kind: Literal["uniform", "delayed"] = part(
        '"uniform": pulses one period apart; "delayed": each a constant delay after leaving the pack'
    )
    interval: float = part("period of an even train, or delay of a delayed train, s")
    times: tuple[float, ...] = part("firing times, s")
    peak_current: float = part("largest value of the drive, A (N for a force drive)")


class BuzzSearch(Declared):
    """Result of the search for a buzz-printing train: the best train, or the reason why none was found."""

    train: BuzzTrain | None = part("the best train, if it prints enough dots; otherwise None")
    reason: str = part("reason why no train prints enough dots, in one sentence; otherwise empty")
    best: BuzzTrain | None = part(
        "the best train simulated, equal to `train` on success; None if no train has a dot in the force range"
    )
    reference_force: float = part("peak force of the single-pulse dot, N; 0 if the single pulse makes no dot")
    tried: int = part("number of trains simulated")


def find_buzz_train(
    hammer: Hammer,
    *,
    pulses: int = _PULSES,
    fewest: int = FEWEST,
    forces: tuple[float, float] = FORCES,
    max_current: float = MAX_CURRENT,
) -> BuzzSearch:
    """Search for a pulse train that prints without touching the backstop.

    The search is a grid search over one number, the period or the delay, refined around the three best
    values. Trains at a constant rate come first, since they need no sensor: periods from half the flight time
    of a single pulse up to the time of the return to the backstop. If no such train both prints enough dots
    and stays clear of the backstop after its first dot, delayed trains follow: delays from 0, at the
    departure from the pack, up to the return to the backstop, at intervals of 2 us, or longer intervals if
    more than 400 delays would be needed. A delayed train is built firing by firing; a dot counts as missing
    after three times the single pulse's time from firing to departure. Trains are ranked by four criteria in
    order: enough dots, clear of the backstop, number of dots, force of the weakest dot. The search is
    deterministic.

    Parameters
    ----------
    hammer : Hammer
        The hammer; it needs a waveform, a pack and a backstop.
    pulses : int, optional
        Number of pulses in a train. The train starts from rest, so its first dots may be too strong to count.
    fewest : int, optional
        Number of consecutive dots required.
    forces : tuple of float, optional
        Range of acceptable peak forces, as fractions of the single-pulse force; other dots do not count.
    max_current : float, optional
        Largest sum of the currents of overlapping pulses, A.

    Returns
    -------
    BuzzSearch
        The train, or the reason for the failure and the best train simulated.

    Raises
    ------
    InputError
        The hammer has no waveform, pack, backstop or rest state, or `pulses` is less than `fewest`.
    """
    return _Search(hammer, pulses, fewest, forces, max_current).result()


def longest_run(motion: Motion, reference_force: float, forces: tuple[float, float] = FORCES) -> Run:
    """Return the longest run of dots whose relative peak force is within `forces`.

    Peak forces are relative to `reference_force` [N]. The first run wins a tie. If no dot is in the range,
    all backstop touches are counted as touches before the run.
    """
    returns = [contact.t_in for contact in touches(motion)]
    best: list[tuple[int, float, float]] = []
    run: list[tuple[int, float, float]] = []
    opening, clear, stays_clear = math.inf, True, False
    for dot in motion.dots:
        # The peak force of a contact that is still open at the end of the simulation is unknown.
        if dot.flight_time is None or dot.peak_force is None or dot.contact_time is None:
            run, clear = [], False
            continue
        touch, force = dot.fired_at + dot.flight_time, dot.peak_force / reference_force
        opening = min(opening, touch)
        clear = clear and not any(opening < t <= touch for t in returns)
        if not forces[0] <= force <= forces[1]:
            run = []
            continue
        if run and any(run[-1][1] < t <= touch for t in returns):
            run = []
        run.append((dot.index, touch, force))
        if len(run) > len(best):
            best, stays_clear = list(run), clear
    begin, end = (best[0][1], best[-1][1]) if best else (math.inf, math.inf)
    before, until = (sum(t <= moment for t in returns) for moment in (begin, end))
    return Run(
        best[0][0] if best else 0,
        tuple(force for _index, _touch, force in best),
        stays_clear,
        (before, until - before, len(returns) - until),
    )


def delayed_train(hammer: Hammer, delay: float, pulses: int = _PULSES) -> tuple[float, ...]:
    """Compute the firing times [s] of a train that fires at a delay [s] after each pack contact ends.

    The train has fewer than `pulses` firings if a firing makes no dot, since no contact then ends.
    """
    leaving = _departure(_run(hammer, [0.0], None))
    return (0.0,) if leaving is None else delayed_trains([hammer], [delay], [PATIENCE * leaving], pulses)[0]


def delayed_trains(
    hammers: Sequence[Hammer],
    delays: Sequence[float],
    patience: Sequence[float],
    pulses: int,
    *,
    states: Sequence[tuple[float, float]] | None = None,
    hopeless: Callable[[DotTable, list[int]], BoolArray] | None = None,
    **options: Any,
) -> list[tuple[float, ...]]:
    """Compute the firing times [s] of many trains that fire at a delay after each pack contact ends.

    Each hammer has its own entry of `delays` [s]; see `delayed_train`. The trains are extended by one firing
    at a time, and one ensemble simulates all trains.

    `patience` is the longest time [s] to wait after each firing for the end of the pack contact, and `pulses`
    the number of firings of a complete train. The trains start from rest, or from `states`: displacement, m,
    and velocity, m/s. `hopeless` is called with the dots of the unfinished trains and their indices, and
    returns a mask of the trains to abandon. Further `options` are the `tolerance` of the simulations and
    `threads`, as for `printhammer.Ensemble`.
    """
    threads = options.pop("threads", None)
    trains = [[0.0] for _ in delays]
    growing = list(range(len(delays)))
    waveforms = {id(hammer): pulse_of(hammer) for hammer in hammers}
    for number in range(pulses - 1):
        if not growing:
            break
        ensemble = Ensemble(
            [hammers[i] for i in growing],
            [PulseTrain(waveforms[id(hammers[i])], at=trains[i]) for i in growing],
            [trains[i][-1] + patience[i] for i in growing],
            states=None if states is None else [states[i] for i in growing],
            **options,
        )
        dots = ensemble.run(dots=True, threads=threads).dots
        assert dots is not None
        leavings = (dots.fired_at + dots.flight_time + dots.contact_time)[:, number]
        firings = leavings + np.array([delays[i] for i in growing])
        grows = firings > np.array([trains[i][-1] for i in growing])
        if hopeless is not None:
            grows &= ~hopeless(dots, growing)
        for i, firing in zip(np.array(growing)[grows], firings[grows].tolist(), strict=True):
            trains[i].append(firing)
        growing = [i for i, goes_on in zip(growing, grows, strict=True) if goes_on]
    return [tuple(times) for times in trains]


def _run(hammer: Hammer, times: Sequence[float], patience: float | None) -> Motion:
    drive = PulseTrain(pulse_of(hammer), at=list(times))
    duration = None if patience is None else times[-1] + patience
    return simulate(hammer, drive, duration=duration, points=2)


def _departure(motion: Motion) -> float | None:
    """Return the time [s] at which the pack contact of the first firing ends; None without a contact."""
    dot = motion.dots[0]
    if dot.flight_time is None or dot.contact_time is None or not dot.peak_force:
        return None
    return dot.fired_at + dot.flight_time + dot.contact_time


class _Search:
    """Search for a buzz-printing train of one hammer: settings, and the best train so far."""

    def __init__(
        self, hammer: Hammer, pulses: int, fewest: int, forces: tuple[float, float], max_current: float
    ) -> None:
        for name in ("pack", "backstop", "waveform"):
            if getattr(hammer, name) is None:
                raise InputError(
                    f"the hammer {hammer.name!r} has no {name}", key=name, expected="one for buzz printing"
                )
        if not 1 <= fewest <= pulses:
            raise InputError.of(
                "pulses", pulses, f"at least the {fewest} dots that must count", written=str(pulses)
            )
        self.hammer, self.pulses, self.fewest, self.forces = hammer, pulses, fewest, forces
        self.limit = max_current if pulse_of(hammer).quantity == "current" else math.inf
        self.tried = 0
        self.best: BuzzTrain | None = None
        single = _run(hammer, [0.0], None)
        leaving = _departure(single)
        self.reference = 0.0
        if leaving is not None:
            dot = single.dots[0]
            assert dot.peak_force is not None
            assert dot.flight_time is not None
            self.reference, self.flight, self.leaving = dot.peak_force, dot.flight_time, leaving
            returned = (contact.t_in for contact in touches(single))
            self.back = next((t for t in returned if t > leaving), 2.0 * leaving)
            self.patience = PATIENCE * leaving

    def result(self) -> BuzzSearch:
        if not self.reference:
            return BuzzSearch(None, "a single pulse makes no dot", None, 0.0, 0)
        # Within half a flight time of the last firing, the armature has hardly responded.
        self._scan(np.linspace(0.5 * self.flight, self.back, _PERIODS, endpoint=False), self._even)
        if not self._is_done:
            way = self.back - self.leaving
            # At least two delays, even if the armature returns at once.
            step = min(max(_DELAY_STEP, way / _DELAYS), 0.5 * way)
            self._scan(np.arange(0.0, way, step), self._delayed)
        if self.best is not None and self.best.count >= self.fewest:
            return BuzzSearch(self.best, "", self.best, self.reference, self.tried)
        count = self.best.count if self.best is not None else 0
        reason = (
            f"of {self.tried} trains tried, even or fired a constant delay after each leaving of the pack,"
            f" none makes more than {count} {'dot' if count == 1 else 'dots'} of {self.forces[0]:g} to"
            f" {self.forces[1]:g} of the single-pulse force without a touch of the backstop, where"
            f" {self.fewest} are expected"
        )
        return BuzzSearch(None, reason, self.best, self.reference, self.tried)

    @property
    def _is_done(self) -> bool:
        """Whether the best train is good enough to end the search: enough dots, and clear of the backstop."""
        return self.best is not None and self.best.clear and self.best.count >= self.fewest

    def _scan(self, grid: np.ndarray, trial: Callable[[Sequence[float]], list[BuzzTrain]]) -> None:
        """Simulate the trains of a grid of periods or delays [s]; refine the grid around the best trains.

        `trial` simulates the trains for given grid values. The refinement ends when the search is done.
        """
        trains = {train.interval: train for train in trial(grid.tolist())}
        step, known = float(grid[1] - grid[0]), set(grid.tolist())
        for _ in range(_ZOOMS):
            if self._is_done:
                return
            step /= _PER_ZOOM
            ranked = sorted(trains.values(), key=self._merit, reverse=True)
            steps = [k * step for k in range(1 - _PER_ZOOM, _PER_ZOOM)]
            near = [train.interval + change for train in ranked[:3] for change in steps]
            new = [value for value in near if grid[0] <= value <= grid[-1] and value not in known]
            known.update(new)
            trains |= {train.interval: train for train in trial(list(dict.fromkeys(new)))}

    def _even(self, periods: Sequence[float]) -> list[BuzzTrain]:
        trains = [tuple(k * period for k in range(self.pulses)) for period in periods]
        return self._simulate("uniform", periods, trains)

    def _delayed(self, delays: Sequence[float]) -> list[BuzzTrain]:
        count = len(delays)
        trains = delayed_trains([self.hammer] * count, delays, [self.patience] * count, self.pulses)
        return self._simulate("delayed", delays, trains)

    def _simulate(
        self,
        kind: Literal["uniform", "delayed"],
        intervals: Sequence[float],
        trains: Sequence[tuple[float, ...]],
    ) -> list[BuzzTrain]:
        """Simulate trains; return the trains with a dot in the force range and a current within the limit.

        `intervals` are the periods or, for the kind "delayed", the delays of the trains, s; `trains` are
        their firing times, s.
        """
        self.tried += len(trains)
        judged = []
        for interval, times in zip(intervals, trains, strict=True):
            motion = _run(self.hammer, times, self.patience)
            run = longest_run(motion, self.reference, self.forces)
            if run.forces and (peak := motion.drive.peak) <= self.limit:
                judged.append(
                    BuzzTrain(**vars(run), kind=kind, interval=interval, times=times, peak_current=peak)
                )
        self.best = max(judged + ([self.best] if self.best else []), key=self._merit, default=None)
        return judged

    def _merit(self, train: BuzzTrain) -> tuple[bool, bool, int, float]:
        """Return the sort key by which trains are ranked; larger is better."""
        return train.count >= self.fewest, train.clear, train.count, train.weakest
