"""The closed loop: hammers, a sensor, and a controller that decides before each touch how to go on.

All runs are carried from decision to decision together. At each, the controller sees what its sensor has
shown so far, and nothing else of the hammer that is driven. What comes out is an ordinary drive.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.feedback.bounded import BoundedSequence
from printhammer.control.feedback.estimator.adaptation import Learned, Touched
from printhammer.control.feedback.estimator.sensor import run_key
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.shapes import Switched
from printhammer.hammer.equilibrium import rest_state
from printhammer.printing.dots.slots import slot_times
from printhammer.run.ensemble import DISPLAY_TOLERANCE, MODE_NAMES, Ensemble

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.control.feedback.controller import Controller, Printed
    from printhammer.control.feedback.driver import Driver
    from printhammer.control.feedback.estimator.sensor import PositionSensor
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

    _Shown = tuple[FloatArray, FloatArray, npt.NDArray[np.bool_]]

REMEMBERED: Final = 4
"""Number of the latest pulses of which anything can be left."""

APART: Final = 1e-9
"""Least time between two switchings, s."""

_SOON: Final = 1e-6
_BRANCHES: Final = tuple(MODE_NAMES.index(name) for name in ("loading", "unloading", "reloading"))


@dataclass
class Pulse:
    """One firing and the switchings of its current, as far as they are decided.

    Attributes
    ----------
    fired : float
        Time of the firing, s.
    at : list of float
        Times of the switchings, s.
    levels : list of float
        Current to which each leads, A.
    """

    fired: float
    at: list[float]
    levels: list[float]

    def switch(self, time: float, level: float) -> None:
        """Add a switching, after those before."""
        self.at.append(max(time, self.at[-1] + APART) if self.at else time)
        self.levels.append(level)

    def waveform(self, edge: float) -> Switched:
        """Return the waveform."""
        return Switched(at=tuple(t - self.fired for t in self.at), levels=tuple(self.levels), edge=edge)


@dataclass
class Loop:
    """One run of the closed loop.

    Attributes
    ----------
    slots : tuple of int
        Numbers of the slots at which dots are wanted.
    due : array, shape (dots,)
        Times at which touches are wanted, s.
    key : int
        What tells the noise of this run from that of others.
    pulses : list of Pulse
        All firings so far.
    touch, speed, kind
        The coming touch as it is expected: time, s, speed, m/s, and kind.
    since : float
        Time from which on the armature flies, s.
    time : float
        How far the run is carried, s.
    state : array, shape (4,)
        Displacement, m, velocity, m/s, mode, memory.
    alive : bool
        Whether the run goes on.
    launched : bool
        Whether the coming touch is that of a launch from rest.
    rests : bool
        Whether the armature comes to rest, and is still to be launched.
    learned : Learned
        What the controller knows of the hammer by now.
    touched : Touched or None
        The latest touch, from which it learns.
    printed : Printed or None
        Likewise, where the throw after it is decided once more when the contact is over.
    seen : list
        What the sensor showed at each decision: times, s, and displacements, m.
    touches : list of tuple
        Time, s, and speed, m/s, of each touch as it was estimated.
    """

    slots: tuple[int, ...]
    due: FloatArray
    key: int
    pulses: list[Pulse]
    touch: float
    speed: float
    kind: int
    since: float
    state: FloatArray
    time: float = 0.0
    alive: bool = True
    launched: bool = True
    rests: bool = False
    learned: Learned = field(default_factory=Learned)
    touched: Touched | None = None
    printed: Printed | None = None
    seen: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)
    touches: list[tuple[float, float]] = field(default_factory=list)

    def drive(self, edge: float) -> PulseSequence:
        """Return the drive so far."""
        return PulseSequence(
            [pulse.waveform(edge) for pulse in self.pulses], at=[p.fired for p in self.pulses]
        )

    def recent(self, driver: Driver) -> PulseSequence:
        """Return the drive of the pulses of which anything can be left."""
        pulses = self.pulses[-REMEMBERED:]
        return BoundedSequence(
            [pulse.waveform(driver.edge) for pulse in pulses], [p.fired for p in pulses], driver.current
        )


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
        due = slot_times(slots, rate) + controller.single.flight_time
        loop = Loop(slots, due, run_key(slots, rate), [], 0.0, 0.0, 0, 0.0, rest.copy())
        controller.launch(loop, 0)
        loops.append(loop)
    policy = controller.policy(1.0 / rate)
    # In the order of the slots, so that runs beside each other are as long as each other.
    for slot in range(max(slots[-1] for slots in patterns) + 1):
        now = [(loop, loop.slots.index(slot)) for loop in loops if slot in set(loop.slots)]
        if not now:
            continue
        moving = [loop for loop, _dot in now if loop.alive]
        if moving:
            run = _Run(hammer, controller, sensor, tolerance, threads)
            rested = [(loop, dot) for loop, dot in now if loop.alive and loop.rests]
            thrown = [(loop, dot) for loop, dot in now if loop.alive and loop.printed is not None]
            if rested or thrown:
                run.see_contacts([loop for loop, _dot in (*rested, *thrown)])
            for loop, dot in rested:
                controller.launch(loop, dot)
            if thrown:
                controller.decide_again(thrown, policy)
            run.see_flights(moving)
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
        self.controller.learn(loops, *contacts, self.sensor)

    def see_flights(self, loops: list[Loop]) -> None:
        """Carry some runs to their next decisions, and estimate the coming touches."""
        starts = np.array([loop.time for loop in loops])
        touches = np.array([loop.touch - self.controller.leads[loop.kind] for loop in loops])
        ends = np.maximum(touches, starts + _SOON)
        since = np.maximum([loop.since for loop in loops], starts)
        contacts, flights = self._carry(loops, since, ends)
        self.controller.learn(loops, *contacts, self.sensor)
        self.controller.estimate(loops, *flights, self.sensor)

    def _carry(self, loops: list[Loop], since: FloatArray, ends: FloatArray) -> tuple[_Shown, _Shown]:
        """Carry runs to an end; return what is shown of contacts and, since a time, of flights."""
        controller, sensor = self.controller, self.sensor
        starts = np.array([loop.time for loop in loops])
        # What is seen of a contact that has not been: nothing.
        spans = np.array(
            [(one.touched.start, one.touched.end) if one.touched else (1.0, 0.0) for one in loops]
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
                [loop.recent(self.controller.driver) for loop in own],
                ends[group],
                states=np.array([loop.state[:width] for loop in own]),
                starts=starts[group],
                tolerance=self.tolerance,
            ).run(strobes=strobes, threads=self.threads)
            found = result.strobes
            assert found is not None
            for row, (k, loop) in enumerate(zip(group.tolist(), own, strict=True)):
                count = len(strobes[row])
                loop.alive = bool(result.ok[row])
                x[k, used[k]] = found.x[row, np.searchsorted(strobes[row][:-1], times[k][used[k]])]
                last = count - 1
                loop.time = float(ends[k])
                loop.state = np.array(
                    [found.x[row, last], found.v[row, last], found.branch[row, last], found.memory[row, last]]
                )
        used &= np.isfinite(x)
        runs = np.array([loop.key for loop in loops], dtype=np.uint64)
        shown = np.where(used, sensor.read(np.nan_to_num(x), numbers, runs, controller.stroke), np.nan)
        first, second = slice(None, contacts.shape[1]), slice(contacts.shape[1], None)
        return (
            (times[:, first], shown[:, first], used[:, first]),
            (times[:, second], shown[:, second], used[:, second]),
        )
