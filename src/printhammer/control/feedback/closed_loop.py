"""Closed-loop simulation of hammers with a position sensor and a controller that acts before each contact.

All runs are advanced from decision to decision together. At each decision the controller knows the sensor
readings so far, and nothing else about the driven hammer. The result is an ordinary drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, Final, NamedTuple

import numpy as np

from printhammer.control.feedback.controller import CONTACT, LEADS, WINDOW, Controller
from printhammer.control.feedback.plant import Loop
from printhammer.control.feedback.sensor import PositionSensor, Samples, run_key
from printhammer.drive.sequence import PulseSequence
from printhammer.hammer.equilibrium import rest_state
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.strategy import slot_times
from printhammer.results import Declared, part
from printhammer.run.ensemble import DISPLAY_TOLERANCE, MODE_NAMES, Ensemble
from printhammer.support.arrays import BoolArray, FloatArray

_SOON: Final = 1e-6  # Shortest advance of a run, s; arbitrary
_LATER: Final = 5e-6  # Step by which a pack change is delayed during a contact with either pack, s; arbitrary
_BRANCHES: Final = tuple(MODE_NAMES.index(name) for name in ("loading", "unloading", "reloading"))


class Leg(NamedTuple):
    """Stage of a closed-loop simulation: the hammer and the end time [s] of each run."""

    hammers: list[Hammer]
    ends: FloatArray


class FeedbackStrategy(Declared):
    """Position feedback as a drive strategy; see `printhammer.printing.dots.strategy.Strategy`."""

    name: ClassVar[str] = "feedback"
    controller: Controller = part("controller designed for the nominal hammer")
    sensor: PositionSensor = part("sensor on the driven hammer", default=PositionSensor())
    tolerance: float = part("error tolerance per integration step of the loop", default=DISPLAY_TOLERANCE)
    threads: int | None = part("number of threads; None for one per core; no effect on results", default=None)
    places: tuple[Hammer, ...] | None = part(
        "the driven hammer at each slot; None if it is the same at every slot", default=None
    )

    def along(self, places: tuple[Hammer, ...]) -> FeedbackStrategy:
        """Return a copy that drives a different hammer in each slot; `places` lists the hammers."""
        return replace(self, places=places)

    def __call__(
        self, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float
    ) -> list[PulseSequence]:
        """Simulate the closed loop on a hammer; return the drive of each pattern."""
        loops = self.loops(hammer, patterns, rate) if patterns else []
        return [loop.drive(self.controller.driver.edge) for loop in loops]

    def loops(self, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float) -> list[Loop]:
        """Simulate the closed loop from rest, one run per pattern; return the final loop states.

        The controller does not know the driven hammer and observes the hammer only through the sensor.
        A pattern consists of the indices of the slots with a dot; `rate` is the slot rate, Hz.
        """
        controller = self.controller
        rest = np.array([rest_state(hammer), 0.0, -1.0, 0.0])
        loops = []
        for slots in patterns:
            due = slot_times(slots, rate) + controller.plant.single.flight_time
            loop = Loop(slots, due, run_key(slots, rate), rest.copy())
            controller.launch(loop, 0)
            loops.append(loop)
        policy = controller.policy(1.0 / rate)
        # In the order of the slots, so that the runs of one ensemble are equally long.
        for slot in range(max(slots[-1] for slots in patterns) + 1):
            now = [(loop, loop.slots.index(slot)) for loop in loops if slot in set(loop.slots)]
            moving = [(loop, dot) for loop, dot in now if loop.alive]
            if moving:
                rested = [(loop, dot) for loop, dot in moving if loop.rests]
                thrown = [(loop, dot) for loop, dot in moving if loop.printed is not None]
                if rested or thrown:
                    self._see_contacts(hammer, (*rested, *thrown))
                for loop, dot in rested:
                    controller.launch(loop, dot)
                if thrown:
                    controller.decide_again(thrown, policy)
                self._see_flights(hammer, moving)
            if now:
                controller.decide(now, policy)
        return loops

    def _legs(self, hammer: Hammer, now: Sequence[tuple[Loop, int]], ends: FloatArray) -> list[Leg]:
        """Split the runs up to `ends` [s] into stages, with one hammer per run and stage.

        The hammer of a run changes when its next pulse is fired. `now` pairs each run with the index of its
        next dot.
        """
        if self.places is None:
            return [Leg([hammer] * len(now), ends)]
        before = [self.places[loop.slots[max(dot - 1, 0)]] for loop, dot in now]
        after = [self.places[loop.slots[dot]] for loop, dot in now]
        # The dot after a rest has not been fired yet.
        fired = [loop.pulses[dot].fired if dot < len(loop.pulses) else np.inf for loop, dot in now]
        turns = np.minimum(fired, ends)
        return [Leg(before, turns), Leg(after, ends)]

    def _see_contacts(self, hammer: Hammer, now: Sequence[tuple[Loop, int]]) -> None:
        """Advance runs to the ends of their latest pack contacts; update the estimates from the contacts.

        `now` pairs each run with the index of its next dot.
        """
        loops = [loop for loop, _dot in now]
        starts = np.array([loop.time for loop in loops])
        over = [loop.touched.end if loop.touched is not None else loop.time for loop in loops]
        ends = np.maximum(np.array(over) + self.sensor.delay, starts + _SOON)
        contacts, _flights = self._carry(self._legs(hammer, now, ends), loops, ends)
        self.controller.learn(loops, contacts)

    def _see_flights(self, hammer: Hammer, now: Sequence[tuple[Loop, int]]) -> None:
        """Advance runs to their next decisions; predict the next pack contacts from sensor samples.

        `now` pairs each run with the index of its next dot.
        """
        loops = [loop for loop, _dot in now]
        starts = np.array([loop.time for loop in loops])
        touches = np.array([loop.touch - LEADS[loop.kind] for loop in loops])
        ends = np.maximum(touches, starts + _SOON)
        since = np.maximum([loop.since for loop in loops], starts)
        contacts, flights = self._carry(self._legs(hammer, now, ends), loops, since)
        self.controller.learn(loops, contacts)
        self.controller.estimate(loops, flights)

    def _carry(self, legs: list[Leg], loops: list[Loop], since: FloatArray) -> tuple[Samples, Samples]:
        """Advance runs through the stages `legs`, and read the sensor.

        Returns the samples of the latest pack contact, and the samples of the flight after `since` [s], of
        each run.
        """
        controller, sensor, ends = self.controller, self.sensor, legs[-1].ends
        starts = np.array([loop.time for loop in loops])
        # An empty time span for a run without a contact.
        spans = np.array(
            [(loop.touched.start, loop.touched.end) if loop.touched else (1.0, 0.0) for loop in loops]
        )
        until = np.minimum(spans[:, 1] + sensor.delay, ends)
        contacts = sensor.numbers(spans[:, 0], until, sensor.count(CONTACT * controller.single.flight_time))
        flights = sensor.numbers(since, ends, sensor.count(WINDOW))
        numbers = np.concatenate([contacts, flights], axis=1)
        used = numbers >= 0
        times: FloatArray = (numbers * sensor.interval).astype(np.float64)
        used &= times > starts[:, np.newaxis]
        x = np.full(numbers.shape, np.nan)
        for leg, following in zip(legs, [*legs[1:], None], strict=True):
            # Samples at the end of the last stage may lie beyond it by rounding.
            until = np.full(len(loops), np.inf) if following is None else leg.ends
            self._advance(leg, loops, until, times, used, x)
            while following is not None:
                # The pack must not change during a contact: the change waits until the armature is outside
                # both packs.
                waits = [
                    loop.alive
                    and loop.time < end
                    and (loop.state[2] in _BRANCHES or loop.state[0] > other.front)
                    for loop, other, end in zip(loops, following.hammers, ends, strict=True)
                ]
                if not any(waits):
                    break
                later = np.array([loop.time for loop in loops]) + np.where(waits, _LATER, 0.0)
                until = np.minimum(later, ends)
                self._advance(Leg(leg.hammers, until), loops, until, times, used, x)
        used &= np.isfinite(x)
        runs = np.array([loop.key for loop in loops], dtype=np.uint64)
        stroke = controller.plant.stroke
        shown = np.where(used, sensor.read(np.nan_to_num(x), numbers, runs, stroke), 0.0)
        samples = Samples(times, shown, used, sensor.error * stroke)
        count = contacts.shape[1]
        return samples.take((slice(None), slice(count))), samples.take((slice(None), slice(count, None)))

    def _advance(
        self,
        leg: Leg,
        loops: list[Loop],
        until: FloatArray,
        times: FloatArray,
        used: BoolArray,
        x: FloatArray,
    ) -> None:
        """Advance runs to the end of a stage; write their displacements [m] at sample times to `x`.

        `times` are the sample times [s], and `used` is the mask of samples to take; samples later than
        `until` [s] are left to the next stage.
        """
        hammers, ends = leg
        inside = np.array([loop.state[2] in _BRANCHES for loop in loops])
        moves = np.array([loop.time < end for loop, end in zip(loops, ends, strict=True)])
        for group in (np.flatnonzero(moves & inside), np.flatnonzero(moves & ~inside)):
            if not group.size:
                continue
            own = [loops[k] for k in group]
            here = [used[k] & (times[k] > loops[k].time) & (times[k] <= until[k]) for k in group]
            # A sample may belong to both the contact and the flight.
            strobes = [
                np.append(np.unique(times[k][mine]), ends[k]) for k, mine in zip(group, here, strict=True)
            ]
            width = 4 if inside[group[0]] else 2
            result = Ensemble(
                [hammers[k] for k in group],
                [loop.recent(self.controller.plant.driver) for loop in own],
                ends[group],
                states=np.array([loop.state[:width] for loop in own]),
                starts=np.array([loop.time for loop in own]),
                tolerance=self.tolerance,
            ).run(strobes=strobes, threads=self.threads)
            sampled = result.strobes
            assert sampled is not None
            states = np.stack([sampled.x, sampled.v, sampled.branch, sampled.memory], axis=2)
            for row, (k, loop) in enumerate(zip(group.tolist(), own, strict=True)):
                moments = strobes[row]
                x[k, here[row]] = sampled.x[row, np.searchsorted(moments[:-1], times[k][here[row]])]
                loop.alive, loop.time = bool(result.ok[row]), float(ends[k])
                loop.state = states[row, len(moments) - 1]
