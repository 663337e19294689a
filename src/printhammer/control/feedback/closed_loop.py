"""The closed loop: hammers, a sensor, and a controller that decides before each touch how to go on.

All runs are carried from decision to decision together. At each, the controller sees what its sensor has
shown so far, and nothing else of the hammer that is driven. What comes out is an ordinary drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, Final, NamedTuple

import numpy as np

from printhammer.control.feedback.controller import CONTACT, LEADS, WINDOW, Controller
from printhammer.control.feedback.estimator.sensor import PositionSensor, Samples, run_key
from printhammer.control.feedback.loop import Loop
from printhammer.drive.sequence import PulseSequence
from printhammer.hammer.equilibrium import rest_state
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.strategy import slot_times
from printhammer.results import Declared, part
from printhammer.run.ensemble import DISPLAY_TOLERANCE, MODE_NAMES, Ensemble
from printhammer.support.arrays import BoolArray, FloatArray

_SOON: Final = 1e-6  # Least time by which a run is carried, s
_LATER: Final = 5e-6  # By how much a new pack is put off while the armature is inside it or the old one, s
_BRANCHES: Final = tuple(MODE_NAMES.index(name) for name in ("loading", "unloading", "reloading"))


class Leg(NamedTuple):
    """What runs are driven with, and until when, s, (runs,)."""

    hammers: list[Hammer]
    ends: FloatArray


class FeedbackStrategy(Declared):
    """Feedback as a way to drive a hammer, see `printhammer.printing.dots.strategy.Strategy`."""

    name: ClassVar[str] = "feedback"
    controller: Controller = part("made for the nominal hammer")
    sensor: PositionSensor = part("what it sees of the hammer that is driven", default=PositionSensor())
    tolerance: float = part("error allowed in one step of the closed loop", default=DISPLAY_TOLERANCE)
    threads: int | None = part("None for as many as there are cores; nothing depends on it", default=None)
    places: tuple[Hammer, ...] | None = part(
        "the hammer that is driven as it is at each slot; None where it is the same at all", default=None
    )

    def along(self, places: tuple[Hammer, ...]) -> FeedbackStrategy:
        """Return the same for a hammer that is another one at each slot, see `places`."""
        return replace(self, places=places)

    def __call__(
        self, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float
    ) -> list[PulseSequence]:
        """Run the closed loop on a hammer, and return the drive that it gave each pattern."""
        loops = self.loops(hammer, patterns, rate) if patterns else []
        return [loop.drive(self.controller.driver.edge) for loop in loops]

    def loops(self, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float) -> list[Loop]:
        """Run the closed loop on a hammer for each pattern, from rest.

        The controller does not know the hammer that is driven, and sees it through the sensor. Patterns are
        numbers of the slots at which dots are wanted, `rate` slots per second, Hz.
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
        # In the order of the slots, so that runs beside each other are as long as each other.
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
        """Return hammers and until when they are driven; a dot's own comes with its firing."""
        if self.places is None:
            return [Leg([hammer] * len(now), ends)]
        before = [self.places[loop.slots[max(dot - 1, 0)]] for loop, dot in now]
        after = [self.places[loop.slots[dot]] for loop, dot in now]
        # At rest it is still to be fired.
        fired = [loop.pulses[dot].fired if dot < len(loop.pulses) else np.inf for loop, dot in now]
        turns = np.minimum(fired, ends)
        return [Leg(before, turns), Leg(after, ends)]

    def _see_contacts(self, hammer: Hammer, now: Sequence[tuple[Loop, int]]) -> None:
        """Carry some runs until their latest contacts are over, and learn from these."""
        loops = [loop for loop, _dot in now]
        starts = np.array([loop.time for loop in loops])
        over = [loop.touched.end if loop.touched is not None else loop.time for loop in loops]
        ends = np.maximum(np.array(over) + self.sensor.delay, starts + _SOON)
        contacts, _flights = self._carry(self._legs(hammer, now, ends), loops, ends)
        self.controller.learn(loops, contacts)

    def _see_flights(self, hammer: Hammer, now: Sequence[tuple[Loop, int]]) -> None:
        """Carry some runs to their next decisions, and estimate the coming touches."""
        loops = [loop for loop, _dot in now]
        starts = np.array([loop.time for loop in loops])
        touches = np.array([loop.touch - LEADS[loop.kind] for loop in loops])
        ends = np.maximum(touches, starts + _SOON)
        since = np.maximum([loop.since for loop in loops], starts)
        contacts, flights = self._carry(self._legs(hammer, now, ends), loops, since)
        self.controller.learn(loops, contacts)
        self.controller.estimate(loops, flights)

    def _carry(self, legs: list[Leg], loops: list[Loop], since: FloatArray) -> tuple[Samples, Samples]:
        """Carry runs to an end; return what is shown of contacts and, since a time, of flights."""
        controller, sensor, ends = self.controller, self.sensor, legs[-1].ends
        starts = np.array([loop.time for loop in loops])
        # What is seen of a contact that has not been: nothing.
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
            # What is shown at the end of the last leg may lie beyond it by rounding.
            until = np.full(len(loops), np.inf) if following is None else leg.ends
            self._advance(leg, loops, until, times, used, x)
            while following is not None:
                # A contact meets one pack: the next one waits until the armature is outside both.
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
        """Carry runs to the end of a leg, where they are not yet; put in x at samples up to `until`."""
        hammers, ends = leg
        inside = np.array([loop.state[2] in _BRANCHES for loop in loops])
        moves = np.array([loop.time < end for loop, end in zip(loops, ends, strict=True)])
        for group in (np.flatnonzero(moves & inside), np.flatnonzero(moves & ~inside)):
            if not group.size:
                continue
            own = [loops[k] for k in group]
            here = [used[k] & (times[k] > loops[k].time) & (times[k] <= until[k]) for k in group]
            # A sample may be one of the contact and one of the flight.
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
