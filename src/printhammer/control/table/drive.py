"""From the settings of a compensation table to a drive: a pulse for each dot, and a brake pulse after it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from printhammer.control.coil_current import fading_current, peak_current
from printhammer.control.table.histories import histories_of
from printhammer.control.widths import of_width, widest
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.drivers import PeakAndHold, Rail
from printhammer.drive.waveforms.shapes import Chain, Waveform
from printhammer.errors import InputError
from printhammer.printing.dots.nominal import pulse_of
from printhammer.printing.dots.settling import settled_from
from printhammer.printing.dots.slots import slot_times

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

WIDEST: Final = 2.0  # Largest width of a pulse, in parts of that of the hammer's own
LARGEST_CURRENT: Final = 2.0  # Largest current in any drive by default, A
# Part of the largest current that a single pulse stays below it, for what is left of a brake pulse
MARGIN: Final = 1e-3
ROUNDING: Final = 1e-9  # Part by which rounding may go beyond a bound
_HALVINGS: Final = 50  # Halvings of an interval of widths: more than a double has bits to tell them apart
_FEWER: Final = 12  # The same for a driver, of which each takes a run
_SAMPLES: Final = 4001  # Instants at which a decaying pulse is looked at
_WAIT: Final = 1e-6  # Step of the wait after a brake pulse, s


class Settings(NamedTuple):
    """What a `CompensationTable` says at one rate: arrays of shape (entries,), over the numbers of histories.

    Meanings and units are those of the columns of the table.
    """

    advance: FloatArray
    width: FloatArray
    brake_delay: FloatArray
    brake_width: FloatArray


COLUMNS: Final = Settings._fields  # What a table says of a dot


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
    if pulse.quantity == "force" or (pulse.quantity == "voltage" and not pulse.replaces):
        raise InputError(
            f"{hammer.path}: the waveform is a {pulse.quantity}, expected a current, or a driver of the coil"
        )

    def peak_of(other: Waveform) -> float:
        return peak_current(hammer, other)

    peak = peak_of(pulse)
    if peak > largest * (1.0 + ROUNDING):
        raise InputError(f"{hammer.path}: the waveform peaks at {peak:.4g} A, expected at most {largest:g} A")
    bound = max(peak, largest * (1.0 - MARGIN))
    halvings = _HALVINGS if pulse.quantity == "current" else _FEWER
    return pulse, widest(pulse, bound, width, WIDEST * width, halvings, peak_of)


def fading(hammer: Hammer, pulse: Waveform, share: float) -> float:
    """Return the time, s, after its width in which a pulse has faded to a share of its peak for good.

    That of a driver has faded once its current has: what the armature induces later is left out.
    """
    own: Any = pulse
    if pulse.quantity == "voltage":
        return fading_current(hammer, pulse, share)
    times = np.linspace(own.width, max(pulse.support, own.width), _SAMPLES)
    place = settled_from(np.abs(pulse.value(times)) > share * pulse.peak)
    return float(times[min(place, _SAMPLES - 1)] - own.width)


def clearance(hammer: Hammer, pulse: Waveform, width: float, largest: float) -> float:
    """Return how long after the width of a brake pulse the next pulse may begin, s.

    By then so much of it has decayed that pulses of the largest width one after another keep to the bound on
    the current, A.
    """
    wide = of_width(pulse, width)
    if pulse.quantity == "voltage":
        return fading_current(hammer, wide, MARGIN)
    wait, times = 0.0, np.linspace(0.0, wide.support, _SAMPLES)
    rising = np.abs(wide.value(times))
    while wait < wide.support - width:
        left = np.abs(wide.value(width + wait + times))
        if (rising + left).max() <= largest * (1.0 + ROUNDING):
            break
        wait += _WAIT
    return wait


def brake_of(pulse: Waveform, width: float) -> Waveform:
    """Return the brake pulse of a width, s: one shorter than the peak time of a driver is its full supply."""
    if isinstance(pulse, PeakAndHold) and width <= pulse.peak_time:
        shared = {name: value for name, value in dict(pulse).items() if name in Rail.model_fields}
        return Rail(**{**shared, "width": width})
    return of_width(pulse, width)


class Pulses(NamedTuple):
    """What the dots of one pattern are made with: arrays of shape (dots,), s.

    Slot times `due`, `advance` and firing times `fired`, the `width` of the pulses, and of the brake pulses
    that follow them the width `braked`, 0 for none, and the `offset` from the firing.
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
    due, advance = slot_times(slots, rate), settings.advance[here]
    offset = settings.brake_delay[after] + advance
    return Pulses(due, advance, due - advance, settings.width[here], settings.brake_width[after], offset)


def sequence(
    pulses: Pulses, pulse: Waveform, known: dict[tuple[float, float, float], Waveform]
) -> PulseSequence:
    """Return the drive of a pattern, by a pulse that gets other widths.

    `known` holds waveforms that were made before, by width, width of the brake pulse and its offset; added
    to.
    """
    waveforms = []
    for width, braked, offset in zip(*(values.tolist() for values in pulses[3:]), strict=True):
        key = width, braked, offset if braked else 0.0
        if key not in known:
            plain = of_width(pulse, width)
            known[key] = Chain(parts=((0.0, plain), (offset, brake_of(pulse, braked)))) if braked else plain
        waveforms.append(known[key])
    return PulseSequence(waveforms, at=pulses.fired.tolist())
