"""The driver of the coil that feedback needs: one that switches it between currents of either sign."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from printhammer.drive.input import read_positive
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.shapes import Switched
from printhammer.errors import InputError
from printhammer.printing.dots.nominal import pulse_of
from printhammer.results import Declared, scalar

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.hammer.hammer import Hammer

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

    Raises
    ------
    InputError
        A number is not positive, or the waveform of the hammer is a force.
    """
    pulse = pulse_of(hammer)
    if pulse.quantity != "current":
        raise InputError(
            f"{hammer.path}: the waveform is a {pulse.quantity}, expected a current, which the loop switches"
        )
    own = max(float(getattr(pulse, "decay", STANDARD)), FASTEST)
    return Driver(current, own if edge is None else edge)
