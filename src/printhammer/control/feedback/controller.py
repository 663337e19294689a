"""Feedback controller: model of the nominal hammer, observer of the driven hammer, coil control.

Before the armature touches the pack, the controller chooses the pulses that follow, from the estimated time
and speed of the touch. The controller releases the armature before a first impact and adds the missing energy
with a push into the pack; catches the returning armature and throws it again if the next dot is due soon; and
brakes the armature before the backstop if there is time to come to rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any, Final, NamedTuple

import numpy as np

from printhammer.control.feedback.flight import Contacts, Expected, FreeForce, flight_from_samples
from printhammer.control.feedback.impact_map import ALWAYS, FREE, PUSHED, blend_known, force_map
from printhammer.control.feedback.plant import APART, REMEMBERED, Driver, Loop, Plant, Printed, Pulse, Touched
from printhammer.control.feedback.policy import (
    KNOWN,
    Choice,
    Committed,
    Policy,
    between,
    between_fronts,
    fronts,
)
from printhammer.control.feedback.sensor import Samples
from printhammer.control.feedback.soft_landing import launch
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.threads import Progress

LEADS: Final = {PUSHED: 30e-6, FREE: 10e-6}
"""Lead time of a decision before the pack contact, s, by kind of contact: a push in progress may have to end
at the touch, whereas a new push never begins before the touch. Arbitrary."""

WINDOW: Final = 120e-6  # Time before a decision from which flight samples are used, s; arbitrary
# Expected standard deviations at a touch: displacement, as a fraction of the stroke, and speed, m/s;
# arbitrary
_PLACE_ERROR: Final = 0.03
_SPEED_ERROR: Final = 0.03  # Initial standard deviation of the speed, m/s; arbitrary
# Initial standard deviation of the speed after the first launch, m/s, in addition to the effect of the
# current scale; arbitrary
_LAUNCH_ERRORS: Final = (0.005, 0.003)
# Distance before the touch at which the simulation of a contact begins, as a fraction of the stroke;
# arbitrary
_BEFORE: Final = 0.15
# Time after a touch during which samples are used, in single-pulse flight times; arbitrary
CONTACT: Final = 1.1
# Change of a touch time beyond which an estimate is rejected, in single-pulse flight times; arbitrary
_ASTRAY: Final = 0.4
# Current, as a fraction of the limit, that presses the armature against the backstop after a landing; tuned:
# with 0.8, dots of the shipped hammer 0.84 to 1.6 ms apart are within 9 % and 23 us; with 1 and without
# `_RELAXED` the soft backstop throws the armature when the current ends, and dots are up to 23 % too strong.
# With 0.7 a harder hammer of the tests touches 30 us earlier than expected.
_CLAMP: Final = 0.8
_CLAMPED, _LONGEST = 0.6, 1.2
"""Usual and largest duration of the pressing current, in flight times; arbitrary."""
_FADED: Final = 3.0  # Time for a current to decay, in time constants of the driver; arbitrary
# Time for the armature to come to rest after the pressing current, in flight times; tuned: with 0.4 a landing
# is too short for the residual motion to decay
_RELAXED: Final = 0.2
_CLEAR: Final = 0.22
"""Fraction of a launch's flight time after which the armature has left the backstop; arbitrary."""
_PATIENCE: Final = 40e-6
"""Shortest time from the end of a contact to a throw whose decision may be revised, s; arbitrary."""
_POLICIES: Final = 8  # Size of the policy cache; arbitrary


class Ahead(NamedTuple):
    """Prediction for a control action: the throw, the departure from the pack, and the next pack contact.

    `fire`, `leaves` and `touch` are the times [s] of the throw, of the departure and of the next touch, all
    measured from the present touch. `width` is the width of the throw's pulse, s; `kind` and `speed` [m/s]
    describe the next touch.
    """

    fire: float
    width: float
    leaves: float
    kind: int
    touch: float
    speed: float


class Controller:
    """A controller designed for a nominal hammer and the driver of its coil.

    The hammer needs a pack and a backstop. `limits` normalise the deviations of the dots in force and arrival
    time; `threads` defaults to one per core; `progress` is called with the number of finished steps of the
    computation of `fronts` and the total number of steps.

    Raises
    ------
    InputError
        The hammer has no pack, backstop, waveform or rest state, or the driver is too weak for the hammer.
    """

    def __init__(
        self,
        hammer: Hammer,
        driver: Driver,
        limits: Limits | None = None,
        *,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        if hammer.front is None or hammer.backstop is None:
            missing = "pack" if hammer.front is None else "backstop"
            raise InputError(
                f"{hammer.path}: the hammer has no {missing}", file=hammer.path, key=missing, expected="one"
            )
        self.limits = Limits() if limits is None else limits
        self.plant = plant = Plant(hammer, driver, nominal(hammer), threads)
        self.hammer, self.driver = hammer, driver
        self.single, self.stroke = plant.single, plant.stroke
        forces = force_map(plant)
        self.start = launch(plant, forces)
        self.fronts = fronts(plant, forces, self.start, progress)
        self._contacts = Contacts(plant)
        # Keyed by the slot period, s
        self.policy = lru_cache(_POLICIES)(lambda period: Policy(self.fronts, period, self.limits))

    @cached_property
    def force(self) -> FreeForce:
        """Force of magnet and spring on the armature in flight, interpolated in a table."""
        return FreeForce(self.hammer, self.hammer.origin, self.plant.front, self.driver.current)

    def launch(self, loop: Loop, dot: int) -> None:
        """Add to a run the launch from rest that makes the armature touch the pack when `dot` is due."""
        start = self.start
        learned = loop.learned
        late = (learned.front * self.stroke - start.place_slope * learned.scale) / start.speed
        earliest = loop.pulses[-1].at[-1] if loop.pulses else 0.0
        fired = max(float(loop.due[dot]) - start.flight - late, earliest)
        self._fire(loop, fired, start.width)
        loop.touch, loop.speed, loop.kind = fired + start.flight + late, start.speed, FREE
        loop.speed += start.speed_slope * learned.scale
        loop.launched, loop.rests = True, False
        loop.since = fired + _CLEAR * start.flight

    def _fire(self, loop: Loop, time: float, width: float) -> None:
        """Add a pulse of full coil current to a run, fired at `time` [s], of width `width` [s]."""
        pulse = Pulse(time)
        pulse.switch(time, self.driver.current)
        pulse.switch(time + width, 0.0)
        loop.pulses.append(pulse)

    def learn(self, loops: Sequence[Loop], samples: Samples) -> None:
        """Update each run's estimated position of the pack front from sensor samples of pack contacts."""
        rows = [k for k, loop in enumerate(loops) if loop.alive and loop.touched is not None]
        for loop in loops:
            loop.learned.drift()
        if rows:
            self._contacts.learn([loops[k] for k in rows], samples.take(rows))

    def estimate(self, loops: Sequence[Loop], samples: Samples) -> None:
        """Estimate the time and speed of each run's next pack contact from sensor samples of the flight."""
        expected = Expected(
            np.array([loop.touch for loop in loops]),
            np.array([loop.speed for loop in loops]),
            np.array([loop.learned.scale for loop in loops]),
            np.array([self._prior_covariance(loop) for loop in loops]),
        )
        front = self.plant.front + self.stroke * np.array([loop.learned.front for loop in loops])
        steps = _steps(loops)

        def accelerations(x: FloatArray, t: FloatArray, scale: FloatArray) -> FloatArray:
            current = (1.0 + scale) * _current(*steps, self.driver.edge, t)
            return self.force(x, current) / self.hammer.mass

        flight = flight_from_samples(samples, expected, front, accelerations)
        before = flight.touch - _BEFORE * self.stroke / flight.speed
        begins = np.maximum(before, np.array([loop.since for loop in loops]))
        states, covariances = flight.at(begins, accelerations)
        long = self.single.flight_time
        for k, loop in enumerate(loops):
            if not loop.alive:
                continue
            # An estimate far from the predicted touch is rejected, and the plan is kept.
            if abs(flight.touch[k] - loop.touch) < _ASTRAY * long and flight.speed[k] > 0.0:
                loop.touch, loop.speed = float(flight.touch[k]), float(flight.speed[k])
                loop.learned.take_scale(float(flight.scale[k]), float(flight.covariance[k, 2, 2]))
                loop.touched = Touched(
                    float(begins[k]), loop.touch + CONTACT * long, states[k], covariances[k]
                )
            loop.touches.append((loop.touch, loop.speed))
            used = samples.used[k]
            loop.seen.append((samples.times[k][used], samples.shown[k][used]))

    def _prior_covariance(self, loop: Loop) -> FloatArray:
        """Return the prior covariance of displacement, speed and current scale at the next pack contact."""
        # Launches after the first begin with the residual motion of a landing.
        if loop.launched and len(loop.pulses) == 1:
            start = self.start
            slope = np.array([start.place_slope, start.speed_slope, 1.0])
            place, speed = _LAUNCH_ERRORS
            errors = np.array([place * self.stroke, speed, 0.0])
            # The uncertainty of the first launch is mainly the effect of the current scale.
            return np.outer(slope, slope) * loop.learned.scale_error**2 + np.diag(errors**2)
        return np.diag([_PLACE_ERROR * self.stroke, _SPEED_ERROR, loop.learned.scale_error]) ** 2

    def decide(self, now: Sequence[tuple[Loop, int]], policy: Policy) -> None:
        """Choose the pulses that follow the next pack contact of each run, and add them to the run.

        `now` pairs each run with the index of the dot that its next contact prints.
        """
        kind = np.array([loop.kind for loop, _dot in now])
        speed = np.array([loop.speed for loop, _dot in now])
        touch = np.array([loop.touch for loop, _dot in now])
        late = touch - np.array([loop.due[dot] for loop, dot in now])
        wait = np.array([loop.wait(dot) for loop, dot in now])
        rests = wait >= self._rest
        after = np.array([self._before_rest(loop, dot + 1) for loop, dot in now])
        front = np.array([loop.learned.front for loop, _dot in now])
        front_error = np.array([loop.learned.front_error for loop, _dot in now])
        way, cost, choice = policy.best(
            kind, late, speed, np.where(rests, policy.period, wait), after, front, front_error
        )
        release, force = (choice.of(name, way) for name in ("release", "force"))
        ahead = self._ahead(choice, way)
        slope = choice.by_speed(self.fronts.front_force, way)
        landed = self._landings(kind, speed, front)
        for k, (loop, dot) in enumerate(now):
            pulse = loop.pulses[-1]
            if loop.kind != FREE:
                # The present push has not ended yet.
                del pulse.at[1:], pulse.levels[1:]
            if rests[k] or not np.isfinite(cost[k]):
                self._land(loop, dot, *(float(values[k]) for values in landed))
                loop.rests = dot + 1 < len(loop.due)
                continue
            back = float(self.fronts.table.back[way[k]])
            learned = loop.learned
            printed = Printed(
                loop.touch, loop.speed, loop.kind, learned.front, float(force[k]), float(slope[k]), back
            )
            self._push(loop, pulse, float(release[k]), back)
            pulse.switch(loop.touch + ahead[k].fire, 0.0)
            self._throw(loop, loop.touch, ahead[k])
            # For a late throw, the contact reveals the position of the pack's front in time to decide again.
            over = printed.touch + CONTACT * self.single.flight_time + _PATIENCE
            unsure = learned.front_error > KNOWN and loop.pulses[-1].fired > over
            loop.printed = printed if unsure else None

    def decide_again(self, now: Sequence[tuple[Loop, int]], policy: Policy) -> None:
        """Repeat the choice of each run's next pulse after a contact, with the updated position of the front.

        `now` pairs each run with the index of its next dot.
        """
        before = [loop.printed for loop, _dot in now if loop.printed is not None]
        kind, touch, speed, thought, force, slope, back = (
            np.array([getattr(printed, name) for printed in before])
            for name in ("kind", "touch", "speed", "front", "force", "slope", "back")
        )
        front = np.array([loop.learned.front for loop, _dot in now])
        farther = front - thought
        touch = touch + farther * self.stroke / speed
        due = np.array([loop.due[dot - 1] for loop, dot in now])
        way, cost, choice = policy.best(
            kind,
            touch - due,
            speed,
            np.array([loop.due[dot] for loop, dot in now]) - due,
            np.array([self._before_rest(loop, dot) for loop, dot in now]),
            front,
            np.array([loop.learned.front_error for loop, _dot in now]),
            Committed(back, force + farther * slope, np.array([loop.time for loop, _dot in now]) - touch),
        )
        ahead = self._ahead(choice, way)
        for k, (loop, _dot) in enumerate(now):
            loop.printed = None
            if not np.isfinite(cost[k]):
                continue
            loop.pulses.pop()
            loop.pulses[-1].at[-1] = max(float(touch[k]) + ahead[k].fire, loop.pulses[-1].at[-2] + APART)
            self._throw(loop, float(touch[k]), ahead[k])

    def _ahead(self, choice: Choice, way: IntArray) -> list[Ahead]:
        """Predict the throw and the next pack contact of each run; `way` is the index of its action."""
        table, rows = self.fronts.table, np.arange(len(way))
        columns = (
            table.fire[way],
            table.width[way],
            choice.of("leaves", way),
            table.next_kind[way],
            choice.next_touch[rows, way],
            choice.next_speed[rows, way],
        )
        return [Ahead(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]

    def _throw(self, loop: Loop, touch: float, ahead: Ahead) -> None:
        """Add to a run the pulse that throws the armature at the pack for the next dot.

        `ahead` is the prediction for the throw; the present touch was at the time `touch` [s].
        """
        self._fire(loop, loop.pulses[-1].at[-1], ahead.width)
        clear = max(ahead.leaves, ahead.fire) if ahead.width != ALWAYS else ahead.leaves
        loop.since = touch + clear
        loop.kind, loop.launched = int(ahead.kind), False
        loop.touch, loop.speed = touch + ahead.touch, ahead.speed

    def _push(self, loop: Loop, pulse: Pulse, release: float, back: float) -> None:
        """Add to a pulse the push into the pack, if required, and then the return current `back` [A].

        The push is full coil current from the touch until `release` [s] after the touch.
        """
        if loop.kind == FREE and release > 0.0:
            pulse.switch(max(loop.touch, loop.time), self.driver.current)
        pulse.switch(max(loop.touch + release, loop.time), back)

    def _land(self, loop: Loop, dot: int, release: float, brake: float, width: float) -> None:
        """Add to a run the push that prints the dot `dot`, and the brake pulse on the return to the backstop.

        `release` is the end of the push and `brake` the start of the brake pulse, s after the touch; `width`
        is the width of the brake pulse, s. NaN means no push, or no brake pulse.
        """
        pulse = loop.pulses[-1]
        self._push(loop, pulse, 0.0 if np.isnan(release) else release, 0.0)
        if not np.isnan(brake):
            pulse.switch(loop.touch + brake, self.driver.current)
            # The residual motion is damped by pressing the armature against the backstop.
            pulse.switch(loop.touch + brake + width, -_CLAMP * self.driver.current)
            single = self.single.flight_time
            fading = max(_FADED * self.driver.edge, _RELAXED * single)
            end = min(brake + width + _CLAMPED * single, self.fronts.landing.settled - fading)
            if dot + 1 < len(loop.due):
                later = float(loop.due[dot + 1]) - self.start.flight - fading - loop.touch
                end = max(end, min(later, brake + width + _LONGEST * single))
            pulse.switch(loop.touch + end, 0.0)

    def _landings(self, kind: Any, speed: FloatArray, front: FloatArray) -> list[FloatArray]:
        """Interpolate the pulses for soft landings after pack contacts of given kind, speed [m/s] and front.

        Returns, in this order: the end of the push into the pack, and the start of the brake pulse, both s
        after the touch; and the width of the brake pulse, s.
        """
        below, share = between(self.fronts.table, kind, speed)
        nearer, farther = between_fronts(front)
        settings = []
        for name in ("release", "brake", "width"):
            tables = np.array([getattr(landing, name) for landing in self.fronts.landings])
            near, far = (
                blend_known(tables[number, below], tables[number, below + 1], share)
                for number in (nearer, nearer + 1)
            )
            settings.append(blend_known(near, far, farther))
        return settings

    @property
    def _rest(self) -> float:
        """Shortest time between two dots that lets the armature come to rest between them, s."""
        return self.fronts.landing.settled + self.start.flight

    def _before_rest(self, loop: Loop, dot: int) -> int:
        """Return the number of dots after the dot `dot` of a run before the armature comes to rest again."""
        rests = np.flatnonzero(np.diff(loop.due[dot:]) >= self._rest)
        return int(rests[0]) if rests.size else max(len(loop.due) - dot - 1, 0)


def _steps(loops: Sequence[Loop]) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and heights [A] of the steps of the commanded coil current.

    Both arrays have one row per run, padded with zeros; only the latest `REMEMBERED` pulses are included.
    """
    rows = []
    for loop in loops:
        steps = [
            (at, level - before)
            for pulse in loop.pulses[-REMEMBERED:]
            for at, level, before in zip(pulse.at, pulse.levels, [0.0, *pulse.levels], strict=False)
        ]
        rows.append(steps)
    most = max(len(row) for row in rows)
    whole = np.zeros((len(rows), most, 2))
    for k, row in enumerate(rows):
        whole[k, : len(row)] = row
    return whole[..., 0], whole[..., 1]


def _current(at: FloatArray, height: FloatArray, edge: float, t: FloatArray) -> FloatArray:
    """Return the coil current [A] of M runs at the times `t` [s], shape (M, K).

    The current follows steps of `height` [A] at the times `at` [s] with the first-order time constant
    `edge` [s].
    """
    total = np.zeros_like(t)
    for k in range(at.shape[1]):
        since = np.maximum(t - at[:, k, np.newaxis], 0.0)
        total -= height[:, k, np.newaxis] * np.expm1(-since / edge)
    return total
