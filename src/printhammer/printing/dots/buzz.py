"""Buzz printing: a train of pulses that prints while the armature stays clear of the backstop.

F. Hendriks (1983), Fig. 7: "Instead of allowing the armature to return fully to the backstop, current pulses
can be issued that are synchronized with the return of the armature from the paper." No such train is known
beforehand for a hammer; `find_buzz_train` looks for one, with the hammer's own waveform, in two families:
even trains, and trains in which each pulse follows the leaving of the pack by a constant delay. The latter
watch the armature, and can hold a motion that no even train holds, being unstable under a constant period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.printing.dots.nominal import pulse_of
from printhammer.printing.dots.settling import touches
from printhammer.run.simulate import simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from printhammer.hammer.hammer import Hammer
    from printhammer.run.contacts import Contact
    from printhammer.run.motion import Motion

MAX_CURRENT: Final = 2.0
"""Largest coil current of a train, A: the range of the paper's Fig. 2."""

FORCES: Final = (0.3, 0.95)
"""Peak force of a dot that counts, in units of that of a single pulse."""

FEWEST: Final = 6
"""Number of dots without a touch of the backstop that makes buzz printing."""

_PULSES: Final = 9
_PERIODS, _DELAYS = 96, 32
_ZOOMS, _PER_ZOOM = 2, 4


@dataclass(frozen=True)
class BuzzTrain:
    """One train that was tried."""

    kind: Literal["uniform", "delayed"]
    """"uniform": pulses one period apart; "delayed": each a constant delay after leaving the pack."""
    interval: float
    """That period or delay, s."""
    times: tuple[float, ...]
    """Firing times, s."""
    first: int
    count: int
    """Number of the firing that made the first dot of the longest run that counts, and number of its dots,
    which may be 0: one for each firing, each with a peak force within limits, no touch of the backstop
    between the first and the last."""
    forces: tuple[float, ...]
    """Peak forces of the dots of the run, in units of that of a single pulse."""
    clear: bool
    """Whether there is no lost dot and no touch of the backstop from the first dot of the train, which starts
    from rest, to the last of the run: not only the dots that count, the whole burst stays clear."""
    peak_current: float
    """Largest value of the drive, A (N under a drive that is a force)."""

    @property
    def weakest(self) -> float:
        """Smallest of the relative peak forces of the run; 0 if it is empty."""
        return min(self.forces, default=0.0)


@dataclass(frozen=True)
class BuzzSearch:
    """Result of a search for buzz printing."""

    train: BuzzTrain | None
    """The train found."""
    reason: str
    """Why there is none, in one sentence; empty if there is one."""
    best: BuzzTrain | None
    """The best attempt, which is `train` if there is one; None if no dot of any train counts."""
    reference_force: float
    """Peak force of the dot of a single pulse, N; 0 if it makes none."""
    tried: int
    """Number of trains tried."""


def find_buzz_train(
    hammer: Hammer,
    *,
    pulses: int = _PULSES,
    fewest: int = FEWEST,
    forces: tuple[float, float] = FORCES,
    max_current: float = MAX_CURRENT,
) -> BuzzSearch:
    """Look for a train of the hammer's own waveform that prints without touching the backstop.

    Even trains come first, since they need no sensor: periods from half the flight time of a single pulse up
    to its return to the backstop, ever more finely around the best. If none does and stays clear from its
    first dot on, delays from the leaving of the pack up to that return, each train built pulse by pulse. Of
    several, a train that stays clear is preferred, then one with more dots, then the one whose weakest dot is
    strongest. Same hammer, same result.

    Parameters
    ----------
    hammer : Hammer
        A hammer with waveform, pack and backstop.
    pulses : int, optional
        Pulses of a train; it starts from rest, so the first dots may be stronger than those that count.
    fewest : int, optional
        Dots that must count.
    forces : tuple of float, optional
        Limits of their peak force, in units of that of a single pulse.
    max_current : float, optional
        Largest sum of the currents of overlapping pulses, A.

    Returns
    -------
    BuzzSearch
        The train, or the reason why there is none and the best attempt.

    Raises
    ------
    InputError
        The hammer has no waveform, pack, backstop or rest state, or `pulses` is less than `fewest`.
    """
    return _Search(hammer, pulses, fewest, forces, max_current).result()


def longest_run(
    motion: Motion, reference_force: float, forces: tuple[float, float] = FORCES
) -> tuple[int, tuple[float, ...], bool]:
    """Judge a train: the longest run of dots whose peak forces count, in units of a reference, N.

    Returns
    -------
    first : int
        Number of the firing of its first dot; 0 if it is empty.
    forces : tuple of float
        Relative peak forces of its dots, one for each firing.
    clear : bool
        As for `BuzzTrain`.
    """
    returns = [c.t_in for c in touches(motion)]
    best: tuple[int, tuple[float, ...], bool] = (0, (), False)
    run: list[tuple[int, float, float]] = []
    opening = math.inf
    clear = True
    for dot in motion.dots:
        # A contact still open at the end of the run has not shown its peak force.
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
        if len(run) > len(best[1]):
            best = (run[0][0], tuple(force for _index, _touch, force in run), clear)
    return best


def delayed_train(
    hammer: Hammer,
    delay: float,
    pulses: int = _PULSES,
    *,
    patience: float | None = None,
    until_touch: bool = False,
) -> tuple[float, ...]:
    """Return firing times, s, of which each but the first follows the leaving of the pack by a delay.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    delay : float
        From the leaving of the pack contact that a firing made to the next firing, s.
    pulses : int, optional
        Number of firings; there are fewer where a firing makes no dot, so that no leaving follows it.
    patience : float, optional
        How long after a firing its dot is waited for, s; by default as long as `printhammer.simulate` runs.
    until_touch : bool, optional
        Fire no more once the armature has touched the backstop before a dot.

    Raises
    ------
    InputError
        The hammer has no waveform or no rest state.
    """
    times = [0.0]
    while len(times) < pulses:
        motion = _run(hammer, times, patience)
        contact = _dot_contact(motion, len(times) - 1)
        if contact is None or contact.t_out is None or contact.t_out + delay <= times[-1]:
            break
        if until_touch and any(c.t_in < contact.t_in for c in touches(motion)):
            break
        times.append(contact.t_out + delay)
    return tuple(times)


def _run(hammer: Hammer, times: Sequence[float], patience: float | None) -> Motion:
    drive = PulseTrain(pulse_of(hammer), at=list(times))
    duration = None if patience is None else times[-1] + patience
    return simulate(hammer, drive, duration=duration, points=2)


def _dot_contact(motion: Motion, firing: int) -> Contact | None:
    made = (c for c in motion.contacts if c.surface == "pack" and not c.initial and not c.extra)
    return next((c for c in made if c.firing == firing), None)


class _Search:
    """The search for one hammer."""

    def __init__(
        self, hammer: Hammer, pulses: int, fewest: int, forces: tuple[float, float], max_current: float
    ) -> None:
        for name in ("pack", "backstop", "waveform"):
            if getattr(hammer, name) is None:
                raise InputError(f"the hammer {hammer.name!r} has no {name}, expected one for buzz printing")
        if not 1 <= fewest <= pulses:
            raise InputError(f"pulses = {pulses}, expected at least the {fewest} dots that must count")
        self.hammer, self.pulses, self.fewest, self.forces = hammer, pulses, fewest, forces
        self.limit = max_current if pulse_of(hammer).quantity == "current" else math.inf
        self.tried = 0
        self.best: BuzzTrain | None = None
        single = _run(hammer, [0.0], None)
        contact = _dot_contact(single, 0)
        returned = (c.t_in for c in touches(single))
        self.reference = 0.0
        if contact is not None and contact.t_out is not None and contact.peak_force:
            self.reference = contact.peak_force
            self.flight, self.leaving = contact.t_in, contact.t_out
            self.back = next((t for t in returned if t > self.leaving), 2.0 * self.leaving)
            self.patience = 1.5 * self.leaving

    def result(self) -> BuzzSearch:
        if not self.reference:
            return BuzzSearch(None, "a single pulse makes no dot", None, 0.0, 0)
        # Sooner than half a flight time after the last firing, the armature has hardly answered it.
        self._scan(np.linspace(0.5 * self.flight, self.back, _PERIODS, endpoint=False), self._even, 3)
        if not (self._enough() and self.best is not None and self.best.clear):
            self._scan(np.linspace(0.0, self.back - self.leaving, _DELAYS, endpoint=False), self._delayed, 1)
        if self._enough():
            return BuzzSearch(self.best, "", self.best, self.reference, self.tried)
        if self.best is not None and len(self.best.times) < self.pulses and self.best.kind == "uniform":
            period = self.best.interval
            self.best = self._judged("uniform", period, [k * period for k in range(self.pulses)]) or self.best
        count = self.best.count if self.best is not None else 0
        reason = (
            f"of {self.tried} trains tried, even or fired a constant delay after each leaving of the pack,"
            f" none makes more than {count} {'dot' if count == 1 else 'dots'} of {self.forces[0]:g} to"
            f" {self.forces[1]:g} of the single-pulse force without a touch of the backstop, where"
            f" {self.fewest} are expected"
        )
        return BuzzSearch(None, reason, self.best, self.reference, self.tried)

    def _enough(self) -> bool:
        return self.best is not None and self.best.count >= self.fewest

    def _scan(self, grid: np.ndarray, trial: Callable[[float], BuzzTrain | None], branches: int) -> None:
        """Try a grid and, unless that is enough already, finer ones around the best places."""
        found = {float(value): trial(float(value)) for value in grid}
        step = float(grid[1] - grid[0])
        for _ in range(_ZOOMS):
            if self._enough() and self.best is not None and self.best.clear:
                return
            ranked = sorted(
                (train for train in found.values() if train is not None),
                key=self._merit,
                reverse=True,
            )
            step /= _PER_ZOOM
            for train in ranked[:branches]:
                for k in range(1 - _PER_ZOOM, _PER_ZOOM):
                    value = train.interval + k * step
                    if float(grid[0]) <= value <= float(grid[-1]) and value not in found:
                        found[value] = trial(value)

    def _even(self, period: float) -> BuzzTrain | None:
        """Try an even train; a short one first, since most fail early."""
        short = min(4, self.pulses)
        train = self._judged("uniform", period, [k * period for k in range(short)])
        if train is None or train.count < 2 or short == self.pulses:
            return train
        return self._judged("uniform", period, [k * period for k in range(self.pulses)])

    def _delayed(self, delay: float) -> BuzzTrain | None:
        times = delayed_train(self.hammer, delay, self.pulses, patience=self.patience, until_touch=True)
        return self._judged("delayed", delay, times)

    def _judged(
        self, kind: Literal["uniform", "delayed"], interval: float, times: Sequence[float]
    ) -> BuzzTrain | None:
        """Try a train; None if no dot counts or the current is too large."""
        self.tried += 1
        motion = _run(self.hammer, times, self.patience)
        first, forces, clear = longest_run(motion, self.reference, self.forces)
        if not forces:
            return None
        peak = motion.drive.peak
        if peak > self.limit:
            return None
        train = BuzzTrain(kind, interval, tuple(times), first, len(forces), forces, clear, peak)
        if self.best is None or self._merit(train) > self._merit(self.best):
            self.best = train
        return train

    def _merit(self, train: BuzzTrain) -> tuple[bool, bool, int, float]:
        """Return what makes one train better than another."""
        return train.count >= self.fewest, train.clear, train.count, train.weakest
