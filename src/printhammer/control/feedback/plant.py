"""The plant (nominal hammer and coil driver), its simulation, and the state of a closed-loop run.

The driver switches the coil between currents of either sign. A `Loop` is the state of one closed-loop run:
firings, motion, and the controller's estimates and plan.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, cast

import numpy as np

from printhammer.drive.input import read_positive
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Switched
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.nominal import Nominal, pulse_of
from printhammer.printing.rates.variability import Perturbation, perturbed
from printhammer.results import Declared, scalar
from printhammer.run.ensemble import DISPLAY_TOLERANCE, DotTable, Ensemble, Strobes
from printhammer.support.arrays import BoolArray, FloatArray
from printhammer.support.threads import Progress


@dataclass(frozen=True)
class Plant:
    """Controlled system: a hammer, its coil driver and its single-pulse dot."""

    hammer: Hammer
    driver: Driver
    single: Nominal
    threads: int | None = None

    @cached_property
    def front(self) -> float:
        """Position of the pack's front, m."""
        assert self.hammer.front is not None
        return self.hammer.front

    @cached_property
    def stroke(self) -> float:
        """Stroke: distance from backstop to pack, m."""
        return self.front - self.hammer.origin

    def moved(self, offset: float) -> Plant:
        """Return a copy with the pack moved away from the backstop by `offset`, a fraction of the stroke."""
        travel = Perturbation(travel=offset * self.stroke)
        return replace(self, hammer=perturbed(self.hammer, travel)) if offset else self

    def run(
        self,
        drives: Sequence[Drive],
        end: Any,
        states: Any = None,
        strobes: Any = None,
        progress: Progress | None = None,
    ) -> tuple[BoolArray, DotTable, Strobes]:
        """Simulate the hammer under each drive until the time `end` [s], from rest or from given states.

        `states` has a row of displacement [m] and velocity [m/s] per drive; `strobes` are times [s] at which
        the states are recorded. Returns, in this order: whether each simulation reached its end; the dots;
        and the recorded states.
        """
        begun = None if states is None else np.array(states)
        result = Ensemble(self.hammer, list(drives), end, states=begun, tolerance=DISPLAY_TOLERANCE).run(
            dots=True, strobes=strobes, threads=self.threads, progress=progress
        )
        return result.ok, cast("DotTable", result.dots), cast("Strobes", result.strobes)


LARGEST_CURRENT: Final = 2.0  # Default current limit, A: the range of the paper's Fig. 2
FASTEST: Final = 1e-6  # Smallest time constant of a driver, s; arbitrary
STANDARD: Final = 20e-6  # Time constant if the waveform of a hammer has no decay, s; arbitrary


class Driver(Declared):
    """Coil driver that switches the current between levels, with a first-order lag."""

    current: float = scalar("A", "largest absolute value of the current")
    edge: float = scalar("s", "time constant of the current")

    def __post_init__(self) -> None:
        read_positive(self.current, "A", "current of the driver")
        read_positive(self.edge, "s", "edge of the driver")

    def switched(self, at: Sequence[float], levels: Sequence[float], initial: float = 0.0) -> Switched:
        """Return the waveform of a current that changes from `initial` to `levels` [A] at times `at` [s]."""
        return Switched(at=tuple(at), levels=tuple(levels), edge=self.edge, initial=initial)

    def push(self, width: float) -> Switched:
        """Return a rectangular current pulse of the given width [s] at the driver's current limit."""
        return self.switched((0.0, width), (self.current, 0.0))

    def drive(self, pulses: Sequence[Switched], at: Sequence[float] = (0.0,)) -> BoundedSequence:
        """Return the drive that fires pulses at the times `at` [s]."""
        return BoundedSequence(pulses, at, self.current)


class BoundedSequence(PulseSequence):
    """Sequence of driver pulses whose declared peak current is the driver's current limit."""

    bounded = True

    def __init__(self, waveforms: Sequence[Switched], at: Sequence[float], bound: float) -> None:
        super().__init__(waveforms, at=at)
        self._bound = bound

    @property
    def largest_pulse(self) -> float:
        """Current limit of the driver, A."""
        return self._bound


def driver_of(hammer: Hammer, current: float = LARGEST_CURRENT, edge: float | None = None) -> Driver:
    """Return a driver with the current limit `current` [A] for a current-driven hammer.

    The time constant `edge` [s] applies to rise and decay; by default it is the decay time constant of the
    hammer's waveform. The current of the hammer's waveform rises more slowly; the faster rise of the driver
    needs a higher supply voltage.
    """
    pulse = pulse_of(hammer)
    if pulse.quantity != "current":
        raise InputError(
            f"{hammer.path}: the waveform is a {pulse.quantity}",
            file=hammer.path,
            key="waveform",
            expected="a current: the loop switches a current on and off, and a driver of the coil sets none",
        )
    own = max(float(getattr(pulse, "decay", STANDARD)), FASTEST)
    return Driver(current, own if edge is None else edge)


REMEMBERED: Final = 4  # Number of the latest pulses whose currents may not have decayed; arbitrary
APART: Final = 1e-9  # Shortest time between two switchings, s; arbitrary
# Prior standard deviation of the position of the pack's front, as a fraction of the stroke; arbitrary
FRONT_ERROR: Final = 0.04
SCALE_ERROR: Final = 0.03  # Prior standard deviation of the current scale; arbitrary
# Standard deviations of the random walk per decision (process noise); arbitrary
_FRONT_DRIFT: Final = 0.002
_SCALE_DRIFT: Final = 0.002
"""Standard deviation of the random walk of the current scale per decision; arbitrary."""
_FARTHEST: Final = 5.0
"""Distance from nominal, in prior standard deviations, beyond which an estimate is rejected; arbitrary."""


@dataclass
class Pulse:
    """A firing of the closed loop, with the switchings of the coil current that are decided so far.

    The commanded coil current changes to `levels` [A] at the times `at` [s].
    """

    fired: float
    at: list[float] = field(default_factory=list)
    levels: list[float] = field(default_factory=list)

    def switch(self, time: float, level: float) -> None:
        """Append a switching of the coil current to `level` [A] at `time` [s].

        The switching is delayed, if necessary, to `APART` after the previous switching.
        """
        self.at.append(max(time, self.at[-1] + APART) if self.at else time)
        self.levels.append(level)

    def waveform(self, edge: float) -> Switched:
        """Return the pulse as a waveform with the time constant `edge` [s]."""
        return Switched(at=tuple(t - self.fired for t in self.at), levels=tuple(self.levels), edge=edge)


@dataclass
class Learned:
    """Estimated pack front and current scale of a driven hammer, with standard deviations.

    `front` is the distance by which the front of the pack is farther away than nominal, as a fraction of the
    stroke; `scale` is the relative deviation of all currents from nominal.
    """

    front: float = 0.0
    front_error: float = FRONT_ERROR
    scale: float = 0.0
    scale_error: float = SCALE_ERROR

    def drift(self) -> None:
        """Inflate the standard deviations of both estimates by one step of drift, at most to their priors."""
        self.front_error = float(min(np.hypot(self.front_error, _FRONT_DRIFT), FRONT_ERROR))
        self.scale_error = float(min(np.hypot(self.scale_error, _SCALE_DRIFT), SCALE_ERROR))

    def take_scale(self, scale: float, variance: float) -> None:
        """Store an estimate of the current scale unless it is too far from nominal; see `_FARTHEST`."""
        if abs(scale) <= _FARTHEST * SCALE_ERROR and variance > 0.0:
            self.scale, self.scale_error = scale, float(np.sqrt(variance))

    def take_front(self, front: float, variance: float) -> None:
        """Store an estimate of the pack front unless it is too far from nominal; see `_FARTHEST`."""
        if abs(front) <= _FARTHEST * FRONT_ERROR and variance > 0.0:
            self.front, self.front_error = front, float(np.sqrt(variance))


@dataclass
class Touched:
    """Pack contact whose sensor samples correct the estimated position of the pack's front.

    The times `start` [s] and `end` [s] enclose the contact. At the start, `state` contains displacement [m],
    speed [m/s] and current scale, and `covariance`, shape (3, 3), their covariances.
    """

    start: float
    end: float
    state: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class Printed:
    """Prediction of a pack contact at the time when its pulse was chosen.

    The prediction uses the position of the pack front as estimated at that time.
    """

    # Time, s, speed, m/s, and kind of the touch
    touch: float
    speed: float
    kind: int
    front: float  # Distance of the front beyond nominal, estimated at that time, as a fraction of the stroke
    # Force relative to the single pulse, and its derivative with respect to the distance of the pack's front
    force: float
    slope: float
    back: float  # Return current, A


@dataclass
class Loop:
    """State of one closed-loop run: pattern, firings, motion, estimates and plan."""

    slots: tuple[int, ...]  # Indices of the slots with a dot
    due: FloatArray  # Requested touch times, s, (dots,)
    key: int  # Key of the sensor noise of this run
    state: FloatArray  # Displacement, m, velocity, m/s, mode, memory, (4,)
    pulses: list[Pulse] = field(default_factory=list)  # All firings decided up to now
    # Expected coming touch: time, s, speed, m/s, and kind
    touch: float = 0.0
    speed: float = 0.0
    kind: int = 0
    since: float = 0.0  # Start of the present free flight, s
    time: float = 0.0  # Simulated time so far, s
    alive: bool = True  # Whether the simulation continues
    launched: bool = True  # Whether the coming touch follows a launch from rest
    rests: bool = False  # Whether the armature comes to rest and has not been launched yet
    learned: Learned = field(default_factory=Learned)  # Estimates of the driven hammer
    touched: Touched | None = None  # Latest touch, from which the front is estimated
    # Latest touch, if the throw after this touch is decided again at the end of the contact
    printed: Printed | None = None
    # Sensor readings used at each decision: times, s, and displacements, m
    seen: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)
    # Estimated time, s, and speed, m/s, of each touch
    touches: list[tuple[float, float]] = field(default_factory=list)

    def wait(self, dot: int) -> float:
        """Return the time from the dot `dot` to the next requested dot, s; infinite after the last dot."""
        return float(self.due[dot + 1] - self.due[dot]) if dot + 1 < len(self.due) else np.inf

    def drive(self, edge: float) -> PulseSequence:
        """Return the drive that consists of all firings decided up to now."""
        return PulseSequence([pulse.waveform(edge) for pulse in self.pulses], [p.fired for p in self.pulses])

    def recent(self, driver: Driver) -> BoundedSequence:
        """Return the drive of the latest `REMEMBERED` pulses, whose currents may still flow."""
        pulses = self.pulses[-REMEMBERED:]
        return driver.drive([pulse.waveform(driver.edge) for pulse in pulses], [p.fired for p in pulses])
