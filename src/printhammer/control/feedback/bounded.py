"""Pulses of a driver, none of which goes beyond the largest current that it has."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.drive.sequence import PulseSequence

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.drive.waveforms.shapes import Switched


class BoundedSequence(PulseSequence):
    """Pulses of a driver; its bound is taken for the largest of them, so that this need not be sought.

    Parameters
    ----------
    waveforms : sequence of Switched
        What each firing does.
    at : sequence of float
        Firing times, s.
    bound : float
        Largest current of the driver, A.
    """

    bounded = True

    def __init__(self, waveforms: Sequence[Switched], at: Sequence[float], bound: float) -> None:
        super().__init__(waveforms, at=at)
        self._bound = bound

    @property
    def largest_pulse(self) -> float:
        """The bound, A."""
        return self._bound
