"""From a compensation table to a drive: a pulse of its own for each dot, and a brake pulse after it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table.histories import histories_of
from printhammer.drive.input import read_positive
from printhammer.errors import InputError
from printhammer.printing.dots.nominal import pulse_of
from printhammer.printing.dots.slots import slot_times

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.control.table.compensation import CompensationTable, Settings
    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

WIDEST: Final = 2.0
"""Largest width of a pulse, in parts of that of the hammer's own."""

LARGEST_CURRENT: Final = 2.0
"""Largest current in any drive unless told otherwise, A."""

MARGIN: Final = 1e-3
"""Part of the largest current that a single pulse stays below it, for what is left of a brake pulse."""

_ROUNDING: Final = 1e-9
_HALVINGS: Final = 50
_SAMPLES: Final = 4001
_WAIT: Final = 1e-6


def of_width(pulse: Waveform, width: float) -> Waveform:
    """Return a pulse like another one, but of another width, s."""
    return type(pulse)(**{**dict(pulse), "width": width})


def print_pulse(hammer: Hammer, largest: float) -> tuple[Waveform, float]:
    """Return the pulse of a hammer, and the largest width, s, at which its current keeps to a bound, A.

    Raises
    ------
    InputError
        The hammer has no waveform, one without a width, one that is a force, or one above the bound.
    """
    pulse = pulse_of(hammer)
    width = getattr(pulse, "width", None)
    if not isinstance(width, float):
        raise InputError(f"{hammer.path}: a {pulse.shape} has no width, expected a pulse that has one")
    if pulse.quantity != "current":
        raise InputError(f"{hammer.path}: the waveform is a {pulse.quantity}, expected a current")
    if pulse.peak > largest * (1.0 + _ROUNDING):
        raise InputError(
            f"{hammer.path}: the waveform peaks at {pulse.peak:.4g} A, expected at most {largest:g} A"
        )
    low, high = width, WIDEST * width
    bound = max(pulse.peak, largest * (1.0 - MARGIN))
    if of_width(pulse, high).peak <= bound:
        return pulse, high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if of_width(pulse, middle).peak <= bound else (low, middle)
    return pulse, low


def fading(pulse: Waveform, share: float) -> float:
    """Return the time, s, after its width in which a pulse has faded to a share of its peak for good."""
    own: Any = pulse
    times = np.linspace(own.width, max(pulse.support, own.width), _SAMPLES)
    loud = np.flatnonzero(np.abs(pulse.value(times)) > share * pulse.peak)
    return float(times[min(loud[-1] + 1, _SAMPLES - 1)] - own.width) if loud.size else 0.0


def clearance(pulse: Waveform, widest: float, largest: float) -> float:
    """Return how long after the width of a brake pulse the next pulse may begin, s.

    By then so much of it has decayed that the widest pulses one after another keep to the bound on the
    current, A.
    """
    wide = of_width(pulse, widest)
    wait, times = 0.0, np.linspace(0.0, wide.support, _SAMPLES)
    rising = np.abs(wide.value(times))
    while wait < wide.support - widest:
        left = np.abs(wide.value(widest + wait + times))
        if (rising + left).max() <= largest * (1.0 + _ROUNDING):
            break
        wait += _WAIT
    return wait


def with_brake(pulse: Waveform, brake: Waveform | None, offset: float) -> Waveform:
    """Return a pulse followed by a brake pulse, s after its firing; without one the pulse itself."""
    from printhammer.drive.waveforms.shapes import Chain

    return pulse if brake is None else Chain(parts=((0.0, pulse), (offset, brake)))


class TableStrategy:
    """A compensation table as a way to drive a hammer.

    Parameters
    ----------
    table : CompensationTable
        The table.
    hammer : Hammer
        The hammer it is made for, whose waveform gets other widths.

    Raises
    ------
    InputError
        A pulse of the table peaks above its largest current.
    """

    name = "table"

    def __init__(self, table: CompensationTable, hammer: Hammer) -> None:
        self.table = table
        self._pulse, widest = print_pulse(hammer, table.largest_current)
        for column in ("width", "brake_width"):
            found = float(getattr(table, column).max())
            if found > widest * (1.0 + _ROUNDING):
                raise InputError(
                    f"the table for {table.hammer!r} has a {column} of {found:.9g} s, expected at most"
                    f" {widest:.9g} s, so that the current is at most {table.largest_current:g} A"
                )

    def __call__(self, _hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float) -> list[Drive]:
        """Return a drive for each pattern; the hammer that is driven does not change them.

        Raises
        ------
        InputError
            The table does not reach to this rate, or a firing would come before the one before it has ended.
        """
        speed = read_positive(rate, "Hz", "rate")
        settings = self.table.at(speed)
        known: dict[tuple[float, float, float], Waveform] = {}
        every = (pulses_of(settings, self.table.gaps, self.table.reach, slots, speed) for slots in patterns)
        return [sequence(pulses, self._pulse, known) for pulses in every]


@dataclass(frozen=True)
class Pulses:
    """What the dots of one pattern are made with: arrays of shape (dots,), s.

    Attributes
    ----------
    due : array
        Slot times.
    advance, fired : array
        Advance, and firing time.
    width : array
        Widths of the pulses.
    braked : array
        Widths of the brake pulses that follow; 0 for none.
    offset : array
        From firing to brake pulse.
    """

    due: FloatArray
    advance: FloatArray
    fired: FloatArray
    width: FloatArray
    braked: FloatArray
    offset: FloatArray


def pulses_of(settings: Settings, gaps: int, reach: int, slots: Sequence[int], rate: float) -> Pulses:
    """Return what the dots of a pattern are made with."""
    numbers = histories_of(slots, gaps, reach)
    here, after = numbers[:-1], numbers[1:]
    due = slot_times(slots, rate)
    advance = settings.advance[here]
    return Pulses(
        due=due,
        advance=advance,
        fired=due - advance,
        width=settings.width[here],
        braked=settings.brake_width[after],
        offset=settings.brake_delay[after] + advance,
    )


def sequence(pulses: Pulses, pulse: Waveform, known: dict[tuple[float, float, float], Waveform]) -> Drive:
    """Return the drive of a pattern.

    Parameters
    ----------
    pulses : Pulses
        What its dots are made with.
    pulse : Waveform
        The pulse that gets these widths.
    known : dict
        Waveforms that were made before, by their three numbers; added to.
    """
    from printhammer.drive.sequence import PulseSequence

    waveforms = []
    for row in np.column_stack([pulses.width, pulses.braked, pulses.offset]).tolist():
        width, braked, offset = row
        key = (width, braked, offset if braked else 0.0)
        if key not in known:
            known[key] = with_brake(
                of_width(pulse, width), of_width(pulse, braked) if braked else None, offset
            )
        waveforms.append(known[key])
    return PulseSequence(waveforms, at=pulses.fired.tolist())
