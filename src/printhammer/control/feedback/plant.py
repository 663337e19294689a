"""The plant: the nominal hammer with the driver of its coil, and simulations of drives.

The driver switches the coil between currents of either sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
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
from printhammer.support.arrays import BoolArray
from printhammer.support.threads import Progress


@dataclass(frozen=True)
class Plant:
    """Plant: a hammer, the driver of its coil, its single-pulse dot, and the threads for simulations."""

    hammer: Hammer
    driver: Driver
    single: Nominal
    threads: int | None = None

    @cached_property
    def front(self) -> float:
        """Front of the pack, m."""
        assert self.hammer.front is not None
        return self.hammer.front

    @cached_property
    def stroke(self) -> float:
        """Stroke: distance from backstop to pack, m."""
        return self.front - self.hammer.origin

    def moved(self, offset: float) -> Plant:
        """Return a copy with the pack farther away, by `offset` as a fraction of the stroke."""
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
        """Simulate drives from rest, or from states (drives, 2), m and m/s, up to an end time, s.

        Returns whether each simulation reached its end, the dots of the firings, and the states at `strobes`.
        """
        begun = None if states is None else np.array(states)
        result = Ensemble(self.hammer, list(drives), end, states=begun, tolerance=DISPLAY_TOLERANCE).run(
            dots=True, strobes=strobes, threads=self.threads, progress=progress
        )
        return result.ok, cast("DotTable", result.dots), cast("Strobes", result.strobes)


LARGEST_CURRENT: Final = 2.0  # Default current limit, A
FASTEST: Final = 1e-6  # Smallest time constant of a driver, s; arbitrary
STANDARD: Final = 20e-6  # Time constant if the waveform of a hammer has no decay, s; arbitrary


class Driver(Declared):
    """A driver that switches the coil between currents."""

    current: float = scalar("A", "current limit, of either sign")
    edge: float = scalar("s", "time constant of the current")

    def __post_init__(self) -> None:
        read_positive(self.current, "A", "current of the driver")
        read_positive(self.edge, "s", "edge of the driver")

    def switched(self, at: Sequence[float], levels: Sequence[float], initial: float = 0.0) -> Switched:
        """Return the current waveform that changes to `levels`, A, at the times `at`, s."""
        return Switched(at=tuple(at), levels=tuple(levels), edge=self.edge, initial=initial)

    def push(self, width: float) -> Switched:
        """Return a rectangular current pulse of a width, s, at the driver's current limit."""
        return self.switched((0.0, width), (self.current, 0.0))

    def drive(self, pulses: Sequence[Switched], at: Sequence[float] = (0.0,)) -> BoundedSequence:
        """Return the drive that fires pulses at the times `at`, s."""
        return BoundedSequence(pulses, at, self.current)


class BoundedSequence(PulseSequence):
    """Sequence of driver pulses whose largest value is declared, as the current limit, not computed."""

    bounded = True

    def __init__(self, waveforms: Sequence[Switched], at: Sequence[float], bound: float) -> None:
        super().__init__(waveforms, at=at)
        self._bound = bound

    @property
    def largest_pulse(self) -> float:
        """Current limit of the driver, A."""
        return self._bound


def driver_of(hammer: Hammer, current: float = LARGEST_CURRENT, edge: float | None = None) -> Driver:
    """Return a driver for a current-driven hammer, with a current limit, A.

    The time constant `edge`, s, is by default the decay time constant of the hammer's own waveform. Its rise
    is slower; a rise as fast as the decay needs a higher supply voltage.
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
