"""One run of the closed loop: what was fired, where it is, and what the controller knows and plans."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from printhammer.control.feedback.plant import BoundedSequence, Driver
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.shapes import Switched
from printhammer.support.arrays import FloatArray

REMEMBERED: Final = 4  # Number of the latest pulses of which anything can be left
APART: Final = 1e-9  # Least time between two switchings, s
# Standard deviation of the front before the first contact, in parts of the way from backstop to pack
FRONT_ERROR: Final = 0.04
SCALE_ERROR: Final = 0.03  # Standard deviation of the scale of the currents before the first flight
# Standard deviations by which both may change from one decision to the next (process noise)
_FRONT_DRIFT: Final = 0.002
_SCALE_DRIFT: Final = 0.002
_FARTHEST: Final = 5.0  # Number of standard deviations from nominal beyond which nothing is believed


@dataclass
class Pulse:
    """One firing and the switchings of its current, as far as they are decided.

    The current goes to `levels`, A, at the times `at`, s.
    """

    fired: float
    at: list[float] = field(default_factory=list)
    levels: list[float] = field(default_factory=list)

    def switch(self, time: float, level: float) -> None:
        """Add a switching, after those before."""
        self.at.append(max(time, self.at[-1] + APART) if self.at else time)
        self.levels.append(level)

    def waveform(self, edge: float) -> Switched:
        """Return the waveform."""
        return Switched(at=tuple(t - self.fired for t in self.at), levels=tuple(self.levels), edge=edge)


@dataclass
class Learned:
    """What is known of a hammer: means and standard deviations.

    `front` is by how much the front of the pack lies farther from the armature than it should, in parts of
    the way from backstop to pack; `scale` is by which part all currents are larger than they should be.
    """

    front: float = 0.0
    front_error: float = FRONT_ERROR
    scale: float = 0.0
    scale_error: float = SCALE_ERROR

    def drift(self) -> None:
        """Forget a little."""
        self.front_error = float(min(np.hypot(self.front_error, _FRONT_DRIFT), FRONT_ERROR))
        self.scale_error = float(min(np.hypot(self.scale_error, _SCALE_DRIFT), SCALE_ERROR))

    def take_scale(self, scale: float, variance: float) -> None:
        """Take what was found of the scale, with its variance; far from all that was expected it is not."""
        if abs(scale) <= _FARTHEST * SCALE_ERROR and variance > 0.0:
            self.scale, self.scale_error = scale, float(np.sqrt(variance))

    def take_front(self, front: float, variance: float) -> None:
        """Likewise of the front."""
        if abs(front) <= _FARTHEST * FRONT_ERROR and variance > 0.0:
            self.front, self.front_error = front, float(np.sqrt(variance))


@dataclass
class Touched:
    """A touch of the pack, from which the front is learned.

    `start` is before the touch and `end` after the contact, s. At the start, `state` (3,) holds displacement,
    m, speed, m/s, and scale of the currents, with their `covariance` (3, 3).
    """

    start: float
    end: float
    state: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class Printed:
    """A touch as it was when its push was decided, before the contact showed where the front is."""

    # Time, s, speed, m/s, and kind of the touch
    touch: float
    speed: float
    kind: int
    front: float  # By how much the front was thought to be farther away, in parts of the way to the pack
    # Force in parts of the single-pulse force, and by how much it grows with the distance of the front
    force: float
    slope: float
    back: float  # Return current, A


@dataclass
class Loop:
    """One run of the closed loop."""

    slots: tuple[int, ...]  # Numbers of the slots at which dots are wanted
    due: FloatArray  # Times at which touches are wanted, s, (dots,)
    key: int  # By which the noise of this run differs from that of others
    state: FloatArray  # Displacement, m, velocity, m/s, mode, memory, (4,)
    pulses: list[Pulse] = field(default_factory=list)  # All firings so far
    # The coming touch as it is expected: time, s, speed, m/s, and kind
    touch: float = 0.0
    speed: float = 0.0
    kind: int = 0
    since: float = 0.0  # Time from which on the armature flies, s
    time: float = 0.0  # How far the run is carried, s
    alive: bool = True  # Whether the run goes on
    launched: bool = True  # Whether the coming touch is that of a launch from rest
    rests: bool = False  # Whether the armature comes to rest, and is still to be launched
    learned: Learned = field(default_factory=Learned)  # What the controller knows of the hammer by now
    touched: Touched | None = None  # The latest touch, from which it learns
    # Likewise, where the throw after it is decided once more when the contact is over
    printed: Printed | None = None
    # What the sensor showed at each decision: times, s, and displacements, m
    seen: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)
    # Time, s, and speed, m/s, of each touch as it was estimated
    touches: list[tuple[float, float]] = field(default_factory=list)

    def wait(self, dot: int) -> float:
        """Return the time from a dot to the next one, s; infinite after the last."""
        return float(self.due[dot + 1] - self.due[dot]) if dot + 1 < len(self.due) else np.inf

    def drive(self, edge: float) -> PulseSequence:
        """Return the drive so far."""
        return PulseSequence([pulse.waveform(edge) for pulse in self.pulses], [p.fired for p in self.pulses])

    def recent(self, driver: Driver) -> BoundedSequence:
        """Return the drive of the pulses of which anything can be left."""
        pulses = self.pulses[-REMEMBERED:]
        return driver.drive([pulse.waveform(driver.edge) for pulse in pulses], [p.fired for p in pulses])
