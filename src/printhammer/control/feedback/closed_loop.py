"""The closed loop: hammers, a sensor, and a controller that decides before each touch how to go on.

All runs are carried from decision to decision together. At each, the controller sees what its sensor has
shown so far, and nothing else of the hammer that is driven. What comes out is an ordinary drive.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np

from printhammer.control.feedback.controller import CONTACT, LEADS, WINDOW, Controller
from printhammer.control.feedback.estimator.sensor import PositionSensor, Samples, run_key
from printhammer.control.feedback.loop import Loop
from printhammer.hammer.equilibrium import rest_state
from printhammer.printing.dots.slots import slot_times
from printhammer.results import Declared, part
from printhammer.run.ensemble import DISPLAY_TOLERANCE, MODE_NAMES, Ensemble

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.drive.sequence import PulseSequence
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

_SOON: Final = 1e-6  # Least time by which a run is carried, s
_BRANCHES: Final = tuple(MODE_NAMES.index(name) for name in ("loading", "unloading", "reloading"))


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

    def _driven(self, hammer: Hammer, loop: Loop, dot: int) -> Hammer:
        """Return the hammer as it is from the touch of the dot before on."""
        return hammer if self.places is None else self.places[loop.slots[max(dot - 1, 0)]]

    def _see_contacts(self, hammer: Hammer, now: Sequence[tuple[Loop, int]]) -> None:
        """Carry some runs until their latest contacts are over, and learn from these."""
        loops = [loop for loop, _dot in now]
        starts = np.array([loop.time for loop in loops])
        over = [loop.touched.end if loop.touched is not None else loop.time for loop in loops]
        ends = np.maximum(np.array(over) + self.sensor.delay, starts + _SOON)
        hammers = [self._driven(hammer, loop, dot) for loop, dot in now]
        contacts, _flights = self._carry(hammers, loops, ends, ends)
        self.controller.learn(loops, contacts)

    def _see_flights(self, hammer: Hammer, now: Sequence[tuple[Loop, int]]) -> None:
        """Carry some runs to their next decisions, and estimate the coming touches."""
        loops = [loop for loop, _dot in now]
        starts = np.array([loop.time for loop in loops])
        touches = np.array([loop.touch - LEADS[loop.kind] for loop in loops])
        ends = np.maximum(touches, starts + _SOON)
        since = np.maximum([loop.since for loop in loops], starts)
        hammers = [self._driven(hammer, loop, dot) for loop, dot in now]
        contacts, flights = self._carry(hammers, loops, since, ends)
        self.controller.learn(loops, contacts)
        self.controller.estimate(loops, flights)

    def _carry(
        self, hammers: list[Hammer], loops: list[Loop], since: FloatArray, ends: FloatArray
    ) -> tuple[Samples, Samples]:
        """Carry runs to an end; return what is shown of contacts and, since a time, of flights."""
        controller, sensor = self.controller, self.sensor
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
        inside = np.array([loop.state[2] in _BRANCHES for loop in loops])
        for group in (np.flatnonzero(inside), np.flatnonzero(~inside)):
            if not group.size:
                continue
            own = [loops[k] for k in group]
            # A sample may be one of the contact and one of the flight.
            strobes = [np.append(np.unique(times[k][used[k]]), ends[k]) for k in group]
            width = 4 if inside[group[0]] else 2
            result = Ensemble(
                [hammers[k] for k in group],
                [loop.recent(controller.plant.driver) for loop in own],
                ends[group],
                states=np.array([loop.state[:width] for loop in own]),
                starts=starts[group],
                tolerance=self.tolerance,
            ).run(strobes=strobes, threads=self.threads)
            sampled = result.strobes
            assert sampled is not None
            states = np.stack([sampled.x, sampled.v, sampled.branch, sampled.memory], axis=2)
            for row, (k, loop) in enumerate(zip(group.tolist(), own, strict=True)):
                moments = strobes[row]
                x[k, used[k]] = sampled.x[row, np.searchsorted(moments[:-1], times[k][used[k]])]
                loop.alive, loop.time = bool(result.ok[row]), float(ends[k])
                loop.state = states[row, len(moments) - 1]
        used &= np.isfinite(x)
        runs = np.array([loop.key for loop in loops], dtype=np.uint64)
        stroke = controller.plant.stroke
        shown = np.where(used, sensor.read(np.nan_to_num(x), numbers, runs, stroke), 0.0)
        samples = Samples(times, shown, used, sensor.error * stroke)
        count = contacts.shape[1]
        return samples.take((slice(None), slice(count))), samples.take((slice(None), slice(count, None)))
