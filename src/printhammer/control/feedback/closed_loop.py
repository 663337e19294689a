"""The closed loop: hammers, a sensor, and a controller that decides before each touch how to go on.

All runs are carried from decision to decision together. At each, the controller sees what its sensor has
shown so far, and nothing else of the hammer that is driven. What comes out is an ordinary drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.feedback.estimator.sensor import Samples, run_key
from printhammer.control.feedback.loop import Loop
from printhammer.hammer.equilibrium import rest_state
from printhammer.printing.dots.slots import slot_times
from printhammer.run.ensemble import DISPLAY_TOLERANCE, MODE_NAMES, Ensemble

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.control.feedback.controller import Controller
    from printhammer.control.feedback.estimator.sensor import PositionSensor
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

_SOON: Final = 1e-6  # Least time by which a run is carried, s
_BRANCHES: Final = tuple(MODE_NAMES.index(name) for name in ("loading", "unloading", "reloading"))


def closed_loops(
    hammer: Hammer,
    controller: Controller,
    sensor: PositionSensor,
    patterns: Sequence[tuple[int, ...]],
    rate: float,
    *,
    tolerance: float = DISPLAY_TOLERANCE,
    threads: int | None = None,
) -> list[Loop]:
    """Run the closed loop for some patterns, from rest.

    Parameters
    ----------
    hammer : Hammer
        What is driven; the controller does not know it.
    controller : Controller
        Who drives it.
    sensor : PositionSensor
        What the controller sees of it.
    patterns : sequence of tuple of int
        Numbers of the slots at which dots are wanted.
    rate : float
        Slots per second, Hz.
    tolerance : float, optional
        As for `printhammer.simulate`.
    threads : int, optional
        By default as many as there are cores; the result does not depend on it.
    """
    rest = np.array([rest_state(hammer), 0.0, -1.0, 0.0])
    loops = []
    for slots in patterns:
        due = slot_times(slots, rate) + controller.plant.single.flight_time
        loop = Loop(slots, due, run_key(slots, rate), rest.copy())
        controller.launch(loop, 0)
        loops.append(loop)
    policy = controller.policy(1.0 / rate)
    run = _Run(hammer, controller, sensor, tolerance, threads)
    # In the order of the slots, so that runs beside each other are as long as each other.
    for slot in range(max(slots[-1] for slots in patterns) + 1):
        now = [(loop, loop.slots.index(slot)) for loop in loops if slot in set(loop.slots)]
        moving = [(loop, dot) for loop, dot in now if loop.alive]
        if moving:
            rested = [(loop, dot) for loop, dot in moving if loop.rests]
            thrown = [(loop, dot) for loop, dot in moving if loop.printed is not None]
            if rested or thrown:
                run.see_contacts([loop for loop, _dot in (*rested, *thrown)])
            for loop, dot in rested:
                controller.launch(loop, dot)
            if thrown:
                controller.decide_again(thrown, policy)
            run.see_flights([loop for loop, _dot in moving])
        if now:
            controller.decide(now, policy)
    return loops


@dataclass(frozen=True)
class _Run:
    """What carries runs on, and shows the controller what its sensor shows."""

    hammer: Hammer
    controller: Controller
    sensor: PositionSensor
    tolerance: float
    threads: int | None

    def see_contacts(self, loops: list[Loop]) -> None:
        """Carry some runs until their latest contacts are over, and learn from these."""
        starts = np.array([loop.time for loop in loops])
        over = [loop.touched.end if loop.touched is not None else loop.time for loop in loops]
        ends = np.maximum(np.array(over) + self.sensor.delay, starts + _SOON)
        contacts, _flights = self._carry(loops, ends, ends)
        self.controller.learn(loops, contacts)

    def see_flights(self, loops: list[Loop]) -> None:
        """Carry some runs to their next decisions, and estimate the coming touches."""
        starts = np.array([loop.time for loop in loops])
        touches = np.array([loop.touch - self.controller.leads[loop.kind] for loop in loops])
        ends = np.maximum(touches, starts + _SOON)
        since = np.maximum([loop.since for loop in loops], starts)
        contacts, flights = self._carry(loops, since, ends)
        self.controller.learn(loops, contacts)
        self.controller.estimate(loops, flights)

    def _carry(self, loops: list[Loop], since: FloatArray, ends: FloatArray) -> tuple[Samples, Samples]:
        """Carry runs to an end; return what is shown of contacts and, since a time, of flights."""
        controller, sensor = self.controller, self.sensor
        starts = np.array([loop.time for loop in loops])
        # What is seen of a contact that has not been: nothing.
        spans = np.array(
            [(loop.touched.start, loop.touched.end) if loop.touched else (1.0, 0.0) for loop in loops]
        )
        until = np.minimum(spans[:, 1] + sensor.delay, ends)
        contacts = sensor.numbers(spans[:, 0], until, controller.contact_samples(sensor))
        flights = sensor.numbers(since, ends, controller.samples(sensor))
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
                self.hammer,
                [loop.recent(controller.plant.driver) for loop in own],
                ends[group],
                states=np.array([loop.state[:width] for loop in own]),
                starts=starts[group],
                tolerance=self.tolerance,
            ).run(strobes=strobes, threads=self.threads)
            found = result.strobes
            assert found is not None
            states = np.stack([found.x, found.v, found.branch, found.memory], axis=2)
            for row, (k, loop) in enumerate(zip(group.tolist(), own, strict=True)):
                moments = strobes[row]
                x[k, used[k]] = found.x[row, np.searchsorted(moments[:-1], times[k][used[k]])]
                loop.alive, loop.time = bool(result.ok[row]), float(ends[k])
                loop.state = states[row, len(moments) - 1]
        used &= np.isfinite(x)
        runs = np.array([loop.key for loop in loops], dtype=np.uint64)
        stroke = controller.plant.stroke
        shown = np.where(used, sensor.read(np.nan_to_num(x), numbers, runs, stroke), 0.0)
        samples = Samples(times, shown, used, sensor.error * stroke)
        count = contacts.shape[1]
        return samples.some((slice(None), slice(count))), samples.some((slice(None), slice(count, None)))
