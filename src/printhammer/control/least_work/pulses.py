"""Bursts of least work that consist of the hammer's own pulses, with optimised times and widths.

In each slot two pulses are fired: the first brakes the returning armature, the second throws it. From rest
one pulse is enough. Such bursts suit a driver that can only be switched on and off. Pulses do not overlap: a
pulse is fired only after the current of the preceding pulse has decayed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from printhammer.control.least_work.search import (
    ARRIVAL,
    LOST,
    best_of,
    descend,
    deviations,
    is_acceptable,
    sobol,
)
from printhammer.control.least_work.slot import SlotState, Task, end_of
from printhammer.control.pulses import of_width, widest
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.run.ensemble import Ensemble
from printhammer.support.arrays import FloatArray

GONE: Final = 1e-2  # Fraction of its peak below which the current of a pulse counts as decayed; arbitrary
_PER_SLOT: Final = 2  # Number of pulses per slot; arbitrary
_TRIED: Final = 1024  # Number of Sobol points evaluated to select starts; arbitrary
_TRIES, _MOST_TRIES = 4, 10  # Number of starts, and maximum number while no start succeeds; arbitrary
_ROUNDS: Final = 40  # Iteration limit of SLSQP; arbitrary
_SHORTEST: Final = 0.02  # Smallest width, as a fraction of the largest; arbitrary
_SAMPLES: Final = 301  # Samples of the power per slot; arbitrary
_HALVINGS: Final = 60  # Bisections of a width: more than the bits of a double's mantissa
_NONE: Final = 1e-9  # Fraction of a slot below which a width counts as zero; arbitrary
_WRONG: Final = 10.0
"""Penalty for an extra contact or a failed simulation, in units of the loading work; arbitrary."""


class PulsePlan:
    """Partial plan of a burst of pulses: firings so far, and the hammer's state at the end of the last slot.

    The pulses have the shape of `waveform`, with optimised widths; the slope limit of the task is ignored.
    Arguments are times [s]: the slot `period`, the time `past` between a pack contact and the end of its
    slot, the length `lead` of the first slot, and the length `landing` of the landing. The plan begins at
    rest at the displacement `rest`, m.

    Raises
    ------
    InputError
        The waveform has no width, or no width keeps its current within the limit.
    """

    def __init__(
        self,
        task: Task,
        waveform: Waveform,
        period: float,
        past: float,
        lead: float,
        landing: float,
        rest: float,
    ) -> None:
        width = getattr(waveform, "width", None)
        if not isinstance(width, float):
            raise InputError(
                f"{task.hammer.path}: a {waveform.shape} waveform has no width to optimise",
                file=task.hammer.path,
                key="waveform",
            )
        self._task, self._waveform = task, waveform
        self._period, self._past, self._lead, self._landing = period, past, lead, landing
        self._widest = widest(waveform, task.largest / (1.0 + GONE), 0.0, period, _HALVINGS)
        if self._widest <= _NONE * period:
            raise InputError(
                f"{task.hammer.path}: no width keeps the waveform below {task.largest:g} A",
                file=task.hammer.path,
                key="width",
            )
        self._state = SlotState(rest, 0.0, -1, 0.0, 0.0)
        self._begin = 0.0
        self._fired: list[tuple[float, float]] = []
        self.touches: list[float] = []

    def add_dot(self) -> bool:
        """Plan the next dot of the burst; return False if no pulses that print the dot were found."""
        duration = self._period if self.touches else self._lead
        arrival = duration - self._past

        def measured(rows: FloatArray) -> FloatArray:
            return self._evaluate(rows, duration, arrival)

        # From rest there is nothing to brake, so one pulse is enough.
        tried = sobol(2 * (_PER_SLOT if self.touches else 1), _TRIED)

        def attempt(row: int) -> tuple[float, FloatArray] | None:
            place = _descend(measured, tried[row], conditions=True)
            cost, missed, above = measured(place[np.newaxis])[:, 0].tolist()
            return (cost, place) if is_acceptable(missed, above) else None

        cost, missed, above = measured(tried)
        best = best_of(cost + np.abs(missed) + np.abs(above), attempt, _TRIES, _MOST_TRIES)
        if best is None:
            return False
        self._keep(best, duration, arrival)
        self.touches.append(self._begin - self._past)
        return True

    def land(self) -> None:
        """Plan the landing of the armature on the backstop."""

        def measured(rows: FloatArray) -> FloatArray:
            return self._evaluate(rows, self._landing, self._landing)

        tried = sobol(2 * _PER_SLOT, _TRIED)
        order = np.argsort(measured(tried)[0], kind="stable")
        places = [_descend(measured, tried[row], conditions=False) for row in order[:_TRIES]]
        costs = measured(np.array(places))[0]
        self._keep(places[int(np.argmin(costs))], self._landing, self._landing)

    def drive(self) -> PulseSequence:
        """Return the drive of the whole burst."""
        return self._drive(self._fired)

    def _drive(self, fired: list[tuple[float, float]]) -> PulseSequence:
        waveforms = [of_width(self._waveform, width) for _time, width in fired]
        return PulseSequence(waveforms, [time for time, _width in fired])

    def _pulses(self, row: FloatArray, arrival: float) -> list[tuple[float, float]]:
        """Convert optimisation variables to the firing times [s] and widths [s] of the pulses of a slot.

        `row` contains two variables in [0, 1] for each pulse: its delay after the earliest possible firing,
        and its width. No pulse ends later than `arrival` [s] after the start of the slot, if possible.
        """
        shortest = _SHORTEST * self._widest
        free = self._begin
        if self._fired:
            time, width = self._fired[-1]
            free = max(free, time + width + self._gone(width))
        last = self._begin + arrival
        pulses = []
        for delay, share in row.reshape(-1, 2).tolist():
            width = shortest + share * (self._widest - shortest)
            time = free + delay * max(last - width - free, 0.0)
            pulses.append((time, width))
            free = time + width + self._gone(width)
        return pulses

    def _gone(self, width: float) -> float:
        """Return the time from the end of a pulse until its current has decayed, s."""
        decay = getattr(self._waveform, "decay", getattr(self._waveform, "fall", 0.0))
        return float(decay) * -float(np.log(GONE)) + 1e-9 * width

    def _evaluate(self, rows: FloatArray, duration: float, arrival: float) -> FloatArray:
        """Simulate a slot of `duration` [s] for each row of optimisation variables; see `_pulses`.

        The dot is due at `arrival` [s] after the start of the slot. The result has three rows: the cost, and
        the deviation of the arrival and the excess force, normalised as in `search.deviations`.
        """
        task, begin = self._task, self._begin
        end = begin + duration
        drives = [self._drive([*self._fired, *self._pulses(row, arrival)]) for row in rows]
        grid = np.linspace(begin, end, _SAMPLES)
        result = Ensemble(
            task.hammer, drives, end, states=self._state.row, starts=begin, tolerance=task.tolerance
        ).run(dots=True, strobes=[grid] * len(rows), engine="plain")
        assert result.strobes is not None
        assert result.dots is not None
        x, v = result.strobes.x, result.strobes.v
        current = np.array([drive.value(grid) for drive in drives])
        power = task.coil(x, current) * v
        dots = result.dots
        late = dots.struck & (dots.fired_at >= begin)
        touched = np.where(late, dots.fired_at + dots.flight_time, np.inf).min(axis=1)
        force = np.where(late, dots.peak_force, 0.0).max(axis=1, initial=0.0)
        contacts = (late * (1 + dots.extra_contacts)).sum(axis=1)
        missed, spare = deviations(touched - begin - arrival, force / task.force)
        spent = np.trapezoid(np.maximum(power, 0.0), grid, axis=1)
        if task.heat:
            spent = task.loading * np.trapezoid(current**2, grid, axis=1) / (task.largest**2 * duration)
        wanted = 1 if arrival < duration else 0
        # A pulse that outlasts the touch would belong to the next slot.
        over = np.array([sum(self._pulses(row, arrival)[-1]) for row in rows]) - begin - arrival
        odd = _WRONG * ((contacts > wanted).astype(float) + ~result.ok) + np.maximum(over, 0.0) / ARRIVAL
        cost = (spent + np.trapezoid(power, grid, axis=1)) / task.loading + odd
        return np.asarray(np.nan_to_num(np.stack([cost, missed, spare]), nan=LOST))

    def _keep(self, row: FloatArray, duration: float, arrival: float) -> None:
        self._fired += self._pulses(row, arrival)
        end = self._begin + duration
        ensemble = Ensemble(
            self._task.hammer,
            self._drive(self._fired),
            end,
            states=[self._state.row],
            starts=self._begin,
            tolerance=self._task.tolerance,
        )
        self._state = end_of(ensemble, end, 0.0)
        self._begin = end


def _descend(
    measured: Callable[[FloatArray], FloatArray], start: FloatArray, *, conditions: bool
) -> FloatArray:
    place, _cost = descend(measured, start, (0.0, 1.0), _ROUNDS, conditions=conditions, inward=True)
    return np.clip(place, 0.0, 1.0)
