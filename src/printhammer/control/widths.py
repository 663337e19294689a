"""Pulses of a hammer with other widths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.drive.waveforms.shapes import Waveform


def of_width(pulse: Waveform, width: float) -> Waveform:
    """Return a pulse like another one, but of another width, s."""
    kind: Any = type(pulse)
    return kind(**{**dict(pulse), "width": width})  # type: ignore[no-any-return]


def widest(
    pulse: Waveform,
    bound: float,
    low: float,
    high: float,
    halvings: int,
    peak: Callable[[Waveform], float] = lambda pulse: pulse.peak,
) -> float:
    """Return the largest width, s, between two at which the current of a pulse keeps to a bound, A.

    The bound is taken to hold at `low`, and it is `low` where it holds nowhere above. `peak` tells the
    largest current of a pulse, A.
    """
    if peak(of_width(pulse, high)) <= bound:
        return high
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if peak(of_width(pulse, middle)) <= bound else (low, middle)
    return low
