"""The plant, as control engineering calls it: the nominal hammer, its driver, and what drives do to it.

The driver of the coil that feedback needs: one that switches it between currents of either sign.
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
    """A hammer, the driver of its coil, its single-pulse dot, and the number of threads for its runs."""

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
        """Way from backstop to pack, m."""
        return self.front - self.hammer.origin

    def moved(self, offset: float) -> Plant:
        """Return the same with its pack farther away, by a part of the stroke."""
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
        """Run drives from rest, or from states (drives, 2), m and m/s, up to an end, s.

        Returns whether each run came to its end, what its firings did, and states at the instants asked for.
        """
        begun = None if states is None else np.array(states)
        result = Ensemble(self.hammer, list(drives), end, states=begun, tolerance=DISPLAY_TOLERANCE).run(
            dots=True, strobes=strobes, threads=self.threads, progress=progress
        )
        return result.ok, cast("DotTable", result.dots), cast("Strobes", result.strobes)


LARGEST_CURRENT: Final = 2.0  # Largest current by default, A
FASTEST: Final = 1e-6  # Least time constant of a driver, s; a shorter one of a hammer counts as this
STANDARD: Final = 20e-6  # Time constant where the waveform of a hammer has no decay, s


class Driver(Declared):
    """A driver that switches the coil between currents."""

    current: float = scalar("A", "largest current to either side")
    edge: float = scalar("s", "time constant with which the current goes to its new value")

    def __post_init__(self) -> None:
        read_positive(self.current, "A", "current of the driver")
        read_positive(self.edge, "s", "edge of the driver")

    def switched(self, at: Sequence[float], levels: Sequence[float], initial: float = 0.0) -> Switched:
        """Return the current that goes to some levels, A, at some times, s."""
        return Switched(at=tuple(at), levels=tuple(levels), edge=self.edge, initial=initial)

    def push(self, width: float) -> Switched:
        """Return a push of some width, s, with the largest current."""
        return self.switched((0.0, width), (self.current, 0.0))

    def drive(self, pulses: Sequence[Switched], at: Sequence[float] = (0.0,)) -> BoundedSequence:
        """Return pulses of this driver, fired at some times, s."""
        return BoundedSequence(pulses, at, self.current)


class BoundedSequence(PulseSequence):
    """Pulses of a driver; its bound, A, is taken for the largest of them, so that this need not be sought."""

    bounded = True

    def __init__(self, waveforms: Sequence[Switched], at: Sequence[float], bound: float) -> None:
        super().__init__(waveforms, at=at)
        self._bound = bound

    @property
    def largest_pulse(self) -> float:
        """The bound, A."""
        return self._bound


def driver_of(hammer: Hammer, current: float = LARGEST_CURRENT, edge: float | None = None) -> Driver:
    """Return a driver for a hammer that is driven by a current, with a largest current, A.

    Its time constant `edge`, s, is by default that with which the current of the hammer's own waveform
    decays. Its own rise is slower: that takes a supply of a higher voltage.
    """
    pulse = pulse_of(hammer)
    if pulse.quantity != "current":
        raise InputError(
            f"{hammer.path}: the waveform is a {pulse.quantity}",
            file=hammer.path,
            key="waveform",
            expected="a current, which the loop switches",
        )
    own = max(float(getattr(pulse, "decay", STANDARD)), FASTEST)
    return Driver(current, own if edge is None else edge)
