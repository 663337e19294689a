"""Drives from compensation tables: a print pulse per dot, and an optional brake pulse after it.

The history of a dot lists the last n gaps between dots, in slots, latest first: from the preceding dot to
this dot, from the dot before to the preceding dot, and so on. After a gap longer than the reach G the hammer
is at rest, whatever was printed before; such a gap is written as 0, "rest", and so are all earlier gaps.

Histories are numbered as n digits to the base G + 1 with the latest gap as the most significant digit, which
is the index that the firmware computes. Numbers with a nonzero digit after a rest are aliases of the number
with rest in all later digits.

Drivers of the coil: the driver of the hammer file, a fast switch on a higher rail, or an H-bridge.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, Final, Literal, NamedTuple, get_args

import numpy as np

from printhammer.control.pulses import MARGIN, WIDEST, fading_current, of_width, peak_current, widest
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.drivers import PeakAndHold, Rail
from printhammer.drive.waveforms.shapes import Chain, Rectangle, Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.nominal import nominal, pulse_of, single_pulses
from printhammer.printing.dots.settling import settled_from
from printhammer.printing.dots.strategy import slot_times
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.support.arrays import FloatArray, IntArray

REST: Final = 0  # Code of the gap of a dot printed from rest
MOST_GAPS: Final = 4  # Largest number of gaps in a history; arbitrary
MOST_REACH: Final = 8  # Largest reach, slots; arbitrary
History = tuple[int, ...]


def checked_size(gaps: int, reach: int) -> tuple[int, int]:
    """Validate the number of gaps and the reach of a compensation table; return both as integers."""
    for name, value, most in (("history", gaps, MOST_GAPS), ("reach", reach, MOST_REACH)):
        if isinstance(value, bool) or not 1 <= value <= most:
            raise InputError.of(name, value, f"a whole number from 1 to {most}")
    return int(gaps), int(reach)


def entries_of(gaps: int, reach: int) -> int:
    """Return the number of possible history numbers, aliases included."""
    return int((reach + 1) ** gaps)


def plain(history: Sequence[int]) -> History:
    """Normalise a history: every gap earlier than a rest becomes a rest."""
    known = list(itertools.takewhile(lambda gap: gap != REST, history))
    return (*known, *[REST] * (len(history) - len(known)))


def number_of(history: Sequence[int], reach: int) -> int:
    """Return the number of a history, the index of its entry in a table."""
    number = 0
    for gap in plain(history):
        number = number * (reach + 1) + gap
    return number


def histories(gaps: int, reach: int) -> list[History]:
    """List all distinct histories, sorted by the number of gaps before a rest."""
    every = itertools.product(range(reach + 1), repeat=gaps)
    return sorted((row for row in every if row == plain(row)), key=lambda row: (gaps - row.count(REST), row))


def numbers_before(history: Sequence[int], reach: int) -> list[int]:
    """List the possible history numbers of the preceding dot; for a dot from rest, its own number."""
    if not history[0]:
        return [number_of(history, reach)]
    return [number_of((*history[1:], gap), reach) for gap in range(reach + 1)]


def shared_numbers(gaps: int, reach: int) -> IntArray:
    """Map every history number, aliases included, to the number of its `plain` history, shape (entries,)."""
    every = itertools.product(range(reach + 1), repeat=gaps)
    return np.array([number_of(row, reach) for row in every], np.int64)


def histories_of(slots: Sequence[int], gaps: int, reach: int) -> IntArray:
    """Return the history numbers of the dots of a pattern, and of a later dot from rest.

    `slots` are the ascending slot indices of the dots. The array has one more element than dots: the last is
    the number of a dot printed from rest, long after the pattern.
    """
    steps = np.diff(np.asarray(slots, np.int64))
    if (steps < 1).any():
        raise InputError.of("slots", tuple(slots), "ascending numbers", written=str(tuple(slots)))
    recent = [REST] * gaps
    numbers = [number_of(recent, reach)]
    for step in steps.tolist():
        recent = [step if step <= reach else REST, *recent[:-1]]
        numbers.append(number_of(recent, reach))
    return np.array([*numbers, number_of([REST] * gaps, reach)], np.int64)


def gap_text(gap: int) -> str:
    """Return a gap as text: "rest" or the number of slots."""
    return "rest" if gap == REST else str(gap)


def history_text(history: Sequence[int]) -> str:
    """Return a history as text, such as "1-2-rest"."""
    return "-".join(map(gap_text, history))


def growing_text(multipliers: FloatArray, rates: FloatArray, gaps: int, reach: int) -> str:
    """Describe the histories whose repetition amplifies errors or has no periodic orbit, in one sentence.

    The text is empty if there are no such histories. `multipliers` has the shape (rates, entries); if all are
    NaN, the table has no multipliers.
    """
    if np.isnan(multipliers).all():
        return ""
    said = []
    for history in histories(gaps, reach):
        over = np.flatnonzero(~(np.abs(multipliers[:, number_of(history, reach)]) <= 1.0))
        if over.size:
            others = over.size - 1
            more = f" and {others} other rate{'s' * (others > 1)}" if others else ""
            said.append(f"{history_text(history)} at {rates[over[0]]:g} Hz{more}")
    return (
        f"In long rows that repeat the gaps {', '.join(said)}, an error grows from dot to dot, or the dots do"
        " not become equal (multiplier beyond 1 or unknown)."
        if said
        else ""
    )


def pattern_of(history: Sequence[int], before: Sequence[int] = ()) -> tuple[int, ...]:
    """Return the slots of a pattern whose last dot has a given history.

    `before` are gaps before the history, latest first; only for a history without rest.
    """
    gaps = [gap for gap in (*plain(history), *before) if gap != REST]
    return tuple(itertools.accumulate(reversed(gaps), initial=0))


ROUNDING: Final = 1e-9  # Relative rounding tolerance of a bound; arbitrary
# Largest width of a pulse whose current saturates at the limit, as a multiple of the hammer's own; tuned:
# rows of the shipped hammer need 1.36, and a wider range makes the grid of starts coarser
_SATURATED: Final = 1.5
_HALVINGS: Final = 50  # Bisections of a width: about the bits of a double's mantissa
_FEWER: Final = 12  # Bisections of a width for a driver, each of which needs a simulation; arbitrary
_SAMPLES: Final = 4001  # Samples of a decaying pulse; arbitrary
_WAIT: Final = 1e-6  # Step of the search for the wait after a brake pulse, s; arbitrary

JUMP: Final = 8e-6  # Arbitrary
"""Difference between neighbouring advances, s, above which the entries are on different solution branches."""


class Settings(NamedTuple):
    """Entries of a compensation table at one rate: arrays of shape (entries,), by history number.

    Meanings and units are as in the columns of `CompensationTable`.
    """

    advance: FloatArray
    width: FloatArray
    brake_delay: FloatArray
    brake_width: FloatArray


COLUMNS: Final = Settings._fields  # Names of the times of an entry


def print_pulse(hammer: Hammer, largest: float) -> tuple[Waveform, float]:
    """Return the pulse of a hammer, and its largest width [s] within a current limit [A].

    The width is at most `WIDEST` times the width of the hammer's pulse, or `_SATURATED` times if the current
    reaches the limit at the width of the hammer's pulse.

    Raises
    ------
    InputError
        The hammer has no waveform, or a waveform that has no width, is a force, or exceeds the limit.
    """
    pulse = pulse_of(hammer)
    width = getattr(pulse, "width", None)
    if not isinstance(width, float):
        raise InputError(
            f"{hammer.path}: a {pulse.shape} has no width",
            file=hammer.path,
            key="waveform",
            expected="a pulse that has one",
        )
    if pulse.quantity == "force" or (pulse.quantity == "voltage" and not pulse.replaces):
        raise InputError(
            f"{hammer.path}: the waveform is a {pulse.quantity}",
            file=hammer.path,
            key="waveform",
            expected="a current, or a driver of the coil",
        )

    def peak_of(other: Waveform) -> float:
        return peak_current(hammer, other)

    peak = peak_of(pulse)
    if peak > largest * (1.0 + ROUNDING):
        raise InputError(
            f"{hammer.path}: the waveform peaks at {peak:.4g} A",
            file=hammer.path,
            key="waveform",
            expected=f"at most {largest:g} A, or a larger largest_current (--largest-current)",
        )
    bound = max(peak, largest * (1.0 - MARGIN))
    halvings = _HALVINGS if pulse.quantity == "current" else _FEWER
    found = widest(pulse, bound, width, WIDEST * width, halvings, peak_of)
    if pulse.quantity == "current" and peak == bound:
        # A current that saturates at the limit has no margin at any width. The pulse may be wider as long as
        # its tail does not delay the next pulse.
        longer = _SATURATED * width
        waits = (clearance(hammer, pulse, each, largest) for each in (found, longer))
        if peak_of(of_width(pulse, longer)) <= largest * (1.0 + ROUNDING) and len(set(waits)) == 1:
            found = longer
    return pulse, found


def fading(hammer: Hammer, pulse: Waveform, share: float) -> float:
    """Return the time [s] from the end of a pulse until its current has decayed below `share` times its peak.

    For a driver this is the first time at which the current has decayed; later induced currents are ignored.
    """
    own: Any = pulse
    if pulse.quantity == "voltage":
        return fading_current(hammer, pulse, share)
    times = np.linspace(own.width, max(pulse.support, own.width), _SAMPLES)
    place = settled_from(np.abs(pulse.value(times)) > share * pulse.peak)
    return float(times[min(place, _SAMPLES - 1)] - own.width)


def clearance(hammer: Hammer, pulse: Waveform, width: float, largest: float) -> float:
    """Return the time [s] from the end of a brake pulse to the earliest start of the next pulse.

    The brake pulse has the width `width` [s]. If the pulse is a current, the next pulse may have the same
    width, and the sum of both pulses stays within the current limit `largest` [A]. If the pulse is that of
    a driver, the wait lasts until the current has decayed to `MARGIN` times its peak.
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
    """Return the brake pulse of a given width [s].

    A pulse of a peak-and-hold driver that is no wider than its peak time has no hold phase.
    """
    if isinstance(pulse, PeakAndHold) and width <= pulse.peak_time:
        shared = {name: value for name, value in dict(pulse).items() if name in Rail.model_fields}
        return Rail(**{**shared, "width": width})
    return of_width(pulse, width)


class Pulses(NamedTuple):
    """Times and widths of the pulses of one pattern, s: arrays of shape (dots,).

    The print pulses have slot times `due`, advances `advance`, firing times `fired` and widths `width`. The
    brake pulses that follow begin `offset` after the firing and have the width `braked`, 0 for none.
    """

    due: FloatArray
    advance: FloatArray
    fired: FloatArray
    width: FloatArray
    braked: FloatArray
    offset: FloatArray


def pulses_of(settings: Settings, gaps: int, reach: int, slots: Sequence[int], rate: float) -> Pulses:
    """Compute the pulses of a pattern from table settings at a slot rate, Hz; none fires before time 0."""
    numbers = histories_of(slots, gaps, reach)
    here, after = numbers[:-1], numbers[1:]
    due = slot_times(slots, rate)
    advance = np.minimum(settings.advance[here], due)
    offset = settings.brake_delay[after] + advance
    return Pulses(due, advance, due - advance, settings.width[here], settings.brake_width[after], offset)


def sequence(
    pulses: Pulses, pulse: Waveform, known: dict[tuple[float, float, float], Waveform]
) -> PulseSequence:
    """Assemble the drive of a pattern from a pulse shape of variable width.

    `known` is a cache of waveforms by width, brake width and brake offset; the cache is updated in place.
    """
    waveforms = []
    for width, braked, offset in zip(*(values.tolist() for values in pulses[3:]), strict=True):
        key = width, braked, offset if braked else 0.0
        if key not in known:
            plain = of_width(pulse, width)
            known[key] = Chain(parts=((0.0, plain), (offset, brake_of(pulse, braked)))) if braked else plain
        waveforms.append(known[key])
    return PulseSequence(waveforms, at=pulses.fired.tolist())


Driver = Literal["own", "switch", "bridge"]
DRIVERS: Final = get_args(Driver)
"""Drivers: the driver of the hammer file, with the rise of its supply; a fast unipolar switch, whose current
rises as fast as the current of the hammer's own pulse falls; an H-bridge, which switches off against the
reversed rail."""

# Decay time constant against the reversed rail over that of the rise: the current falls as 2 exp(-t) - 1 and
# is zero at ln 2; an exponential decay with this constant carries the same charge.
_REVERSED: Final = 1.0 - float(np.log(2.0))

_EDGE: Final = 20e-6  # Time constant of a driver if the hammer's waveform has no decay, s; arbitrary
_LEAST_EDGE: Final = 1e-6  # Smallest time constant of a driver, s; arbitrary
_GRID: Final = 33  # Widths per round of the grid search; arbitrary
_ROUNDS: Final = 7  # Rounds; each subdivides the bracketing interval of the previous round; arbitrary


def checked_driver(driver: str) -> Driver:
    """Return the name of a driver, or raise InputError if there is no such driver."""
    if driver not in DRIVERS:
        raise InputError.of("driver", driver, f"{', '.join(DRIVERS[:-1])} or {DRIVERS[-1]}")
    return driver  # type: ignore[return-value]


def driven_by(hammer: Hammer, driver: str, largest: float) -> Hammer:
    """Return a copy of the hammer with the pulse of another driver, at the width that keeps the print force.

    `largest` is the current of a switch or an H-bridge, A.

    Raises
    ------
    InputError
        The driver is unknown, the hammer's waveform is not a current, or no width gives the force.
    """
    if checked_driver(driver) == "own":
        return hammer
    own: Any = pulse_of(hammer)
    if own.quantity != "current":
        raise InputError(
            f"{hammer.path}: the waveform is a {own.quantity}",
            file=hammer.path,
            key="waveform",
            expected="a current, or driver = 'own'",
        )
    edge = max(float(getattr(own, "decay", _EDGE)), _LEAST_EDGE)
    force = nominal(hammer, tolerance=DISPLAY_TOLERANCE).force
    decay = edge * (_REVERSED if driver == "bridge" else 1.0)
    shape = Rectangle(amplitude=largest, width=edge, rise=edge, decay=decay)
    return of_force(hammer, shape, force, 0.5 * edge, 2.0 * float(getattr(own, "width", own.support)))


def of_force(hammer: Hammer, pulse: Waveform, force: float, low: float, high: float) -> Hammer:
    """Return a copy of the hammer with the pulse width, from `low` to `high` [s], that gives `force` [N]."""
    for _ in range(_ROUNDS):
        widths = np.linspace(low, high, _GRID).tolist()
        pulses = [of_width(pulse, width) for width in widths]
        dots = single_pulses([hammer] * _GRID, pulses, tolerance=DISPLAY_TOLERANCE)
        hard = [dot is not None and dot.force >= force for dot in dots]
        if hard[0] or not any(hard):
            raise InputError(
                f"{hammer.path}: no width of the pulse makes a dot of {force:.4g} N",
                file=hammer.path,
                key="width",
                expected="another largest_current, or a hammer nearer to its design",
            )
        first = hard.index(True)
        low, high = widths[first - 1], widths[first]
    return with_pulse(hammer, of_width(pulse, high))


def with_pulse(hammer: Hammer, pulse: Waveform) -> Hammer:
    """Return a copy of the hammer whose waveform is `pulse`."""
    constants = {key: value for key, value in dict(pulse).items() if key != "quantity"}
    return hammer.replace("waveform", {"shape": pulse.shape, **constants}, source="of the driver")
