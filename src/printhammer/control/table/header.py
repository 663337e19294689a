"""Compensation tables as C headers (C99, integers, no library), in ticks of the firmware's timer.

Every name in a header has a prefix of hammer, unit, driver and rates, so that one program can include several
headers. The C interpolation between rates, or between values of an axis, agrees with Python to the tick.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from printhammer.control.table.drive import (
    COLUMNS,
    JUMP,
    REST,
    entries_of,
    histories,
    number_of,
    numbers_before,
    shared_numbers,
)
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.c_code import comment, guarded, identifier, nested, numbers

NANOSECOND: Final = 1e-9
"""Default unit of the times in a C header, s."""

_PLACE_BYTES: Final = 4
"""Size of a rate, or of an axis value, in a C header, bytes: integers of 32 bits."""

_ROUNDING: Final = 1e-9  # Rounding tolerance of a whole number; arbitrary
_MULTIPLIER_BYTES: Final = 2
"""Size of a multiplier in a C header, in bytes, by definition: thousandths as integers of 16 bits."""

_ADVANCE, _, _DELAY, _BRAKE = range(len(COLUMNS))


def bits_of(times: Mapping[str, FloatArray], tick: float) -> int:
    """Return the width, in bits, of the times in a C header: 32 for nanoseconds, else 16 if all times fit."""
    largest = max(float(np.abs(np.rint(values / tick)).max()) for values in times.values())
    return 32 if tick == NANOSECOND or largest > np.iinfo(np.int16).max else 16


def size_of(rates: int, entries: int, bits: int, values: int = 0) -> int:
    """Return the size, in bytes, of the arrays in a C header with given numbers of rates and entries.

    `values` is the number of values of the second axis; 0 without a second axis.
    """
    each = len(COLUMNS) * bits // 8 + 1 + _MULTIPLIER_BYTES
    return max(values, 1) * rates * entries * each + _PLACE_BYTES * (rates + values)


def whole_ticks(
    times: Mapping[str, FloatArray], rates: FloatArray, gaps: int, reach: int, tick: float
) -> dict[str, FloatArray]:
    """Round the times of a table to whole ticks [s], without overlap of pulses.

    Where rounding to the nearest tick makes two pulses overlap, the brake pulse begins later or is shorter,
    or the dot is fired later, by a tick or two. The arguments are as for `look_ahead`, with arrays of shape
    (rates, entries).
    """
    rounded = {name: np.rint(values / tick) for name, values in times.items()}
    advance, width, delay, brake = (rounded[name] for name in COLUMNS)
    near = NANOSECOND / tick
    # No pulse may be wider than the widest one of the table, since the current is limited.
    widest = math.floor(max(float(times[name].max()) for name in ("width", "brake_width")) / tick + near)
    for pulses in (width, brake):
        np.minimum(pulses, max(widest, 1), out=pulses)
    # A dot that is fired later may delay the next dot.
    for _ in range(gaps + 1):
        for row, rate in enumerate(rates.tolist()):
            for history in histories(gaps, reach):
                number, slot = number_of(history, reach), history[0] / rate / tick
                cell, before = (row, number), numbers_before(history, reach)
                over = float((width[row, before] - advance[row, before]).max())
                if brake[cell] > 0.0:
                    delay[cell] = max(delay[cell], math.ceil(over - near))
                    if history[0]:
                        room = math.floor(slot - advance[cell] - delay[cell] + near)
                        brake[cell] = max(min(brake[cell], room), 0)
                elif history[0]:
                    advance[cell] = min(advance[cell], math.floor(slot - over + near))
    shared = shared_numbers(gaps, reach)
    return {name: values[:, shared] * tick for name, values in rounded.items()}


def look_ahead(times: Mapping[str, FloatArray], rates: FloatArray, gaps: int, reach: int) -> IntArray:
    """Compute the look-ahead of each history: how many slots in advance a dot must be known.

    A dot must be known at its firing, `advance` before its slot, and at its brake pulse, `brake_delay` after
    the slot of the preceding dot. The brake pulse of a dot from rest follows the last dot of a pattern; it is
    fired once the slots within reach are known to be empty.

    Parameters
    ----------
    times : mapping
        Arrays (..., rates, entries) by name, s.
    rates : array, shape (R,)
        Slot rates, Hz.
    gaps, reach : int
        Number of gaps in a history, and the longest gap that counts.

    Returns
    -------
    array, shape (..., rates, entries)
        Whole slots; 0 for a dot that is fired after its slot and has no brake pulse.
    """
    advance, _, delay, brake = (times[name] * rates[:, np.newaxis] for name in COLUMNS)
    gap = np.arange(entries_of(gaps, reach)) // (reach + 1) ** (gaps - 1)
    gap[gap == REST] = reach
    ahead = np.where(brake > 0.0, np.maximum(advance, gap - delay), advance)
    return np.ceil(np.maximum(ahead, 0.0) - _ROUNDING).astype(np.int64)


def prefix_of(head: Mapping[str, Any], rates: FloatArray, axis: str = "") -> str:
    """Return the prefix of all C names in a header: hammer, unit, driver, rates and axis.

    The driver "own" is omitted, as is the unit if the table is valid for every unit.
    """
    driver = "" if head["driver"] == "own" else head["driver"]
    span = "_".join(f"{rate:g}" for rate in sorted({float(rates[0]), float(rates[-1])}))
    said = (head["hammer"], head["serial"], driver, f"{span}hz", axis)
    return identifier("_".join(str(part) for part in said if part)).rstrip("_")


def header_text(
    head: Mapping[str, Any],
    rates: FloatArray,
    times: Mapping[str, FloatArray],
    multipliers: FloatArray,
    tick: float = NANOSECOND,
    axis: tuple[str, FloatArray] | None = None,
) -> str:
    """Render a C header with the table in whole ticks, and the functions that firmware calls.

    Parameters
    ----------
    head : mapping
        Metadata of the table; see `printhammer.control.table.formats.HEAD` and `OPTIONAL`.
    rates : array, shape (R,)
        Slot rates, Hz.
    times : mapping
        Arrays (rates, entries) by name, s; with an axis (values, rates, entries). All history numbers,
        aliases included, have entries, so that the firmware can index directly.
    multipliers : array
        Dot-to-dot multipliers, of the same shape as an array of `times`; NaN for unknown multipliers.
    tick : float
        Tick of the timer, s.
    axis : tuple, optional
        Name of the axis, and its values as integers.
    """
    from printhammer import __version__

    gaps, reach = head["gaps"], head["reach"]
    prefix = prefix_of(head, rates, "" if axis is None else axis[0])
    upper = prefix.upper()
    entries, fingerprint = entries_of(gaps, reach), re.sub(r"[^0-9a-zA-Z]", "", head["fingerprint"])
    nanoseconds, bits = round(tick / NANOSECOND), bits_of(times, tick)
    unit = "nanoseconds" if nanoseconds == 1 else f"ticks of {nanoseconds} ns"
    shape, values, between = f"[{rates.size}][{entries}]", 0, _over_rates(prefix, rates.size)
    arrays = f"static const uint32_t {prefix}_rate[{rates.size}] = {{\n{numbers(np.rint(1e3 * rates))}\n}};\n"
    if axis is not None:
        values = axis[1].size
        shape, between = f"[{values}]{shape}", _over_axis(prefix, axis[0], values)
        arrays += f"\nstatic const int32_t {prefix}_{axis[0]}[{values}] = {{\n{numbers(axis[1])}\n}};\n"
    for column, table in times.items():
        arrays += f"\nstatic const int{bits}_t {prefix}_{column}{shape} = {nested(np.rint(table / tick))};\n"
    unit_of = f"unit {comment(head['serial'])}" if head["serial"] else "every unit"
    ahead = nested(look_ahead(times, rates, gaps, reach))
    arrays += "\n/* Look-ahead: number of slots in advance at which a dot must be known. */\n"
    arrays += f"static const uint8_t {prefix}_look_ahead{shape} = {ahead};\n"
    arrays += f"""
/* Multiplier of a small error from dot to dot in a long row that repeats the gaps of the history, a rest
   as {reach + 1} slots: in thousandths, rounded away from 0. Beyond -1000 to 1000 the error grows along
   the row. Negative: the error alternates. INT16_MAX: larger, or unknown. */
static const int16_t {prefix}_multiplier{shape} = {nested(thousandths(multipliers))};
"""
    body = f"""\
/* Compensation table for the hammer {comment(head["hammer"])},
   fingerprint {fingerprint},
   {unit_of}, driver {comment(head["driver"])}, current limit {head["largest_current"]:g} A;
   generated by printhammer {__version__}.
   Times are in {unit}, indexed {"[value][rate][history]" if values else "[rate][history]"}. \
A history lists the gaps, in slots,
   from a dot to the dots before it, latest gap first; a gap longer than REACH is written as 0 (rest).
   A dot is fired `advance` before its slot, with a pulse of `width`. If `brake_width` is not 0, a brake
   pulse of that width begins `brake_delay` after the slot of the preceding dot. A pulse begins when the
   driver switches on and ends when it switches off; the current rises and decays after these edges. */

#include <stdint.h>

#define {upper}_RATES {rates.size}
#define {upper}_GAPS {gaps}
#define {upper}_REACH {reach}
#define {upper}_HISTORIES {entries}
#define {upper}_FINGERPRINT "{fingerprint}"
#define {upper}_DRIVER "{_quote(head["driver"])}"
#define {upper}_SERIAL "{_quote(head["serial"])}"
#define {upper}_LARGEST_CURRENT_MA {round(1e3 * head["largest_current"])}
#define {upper}_TICK_NS {nanoseconds}
#define {upper}_BYTES {size_of(rates.size, entries, bits, values)}

/* Slot rates, in millihertz. */
{arrays}
/* Index of a history; gaps before a rest are ignored. */
static inline unsigned {prefix}_history(const unsigned *gaps)
{{
  unsigned number = 0, rested = 0;
  for (unsigned i = 0; i < {gaps}u; i++) {{
    unsigned gap = gaps[i] > {reach}u ? 0u : gaps[i];
    rested |= gap == 0u;
    number = number * {reach + 1}u + (rested ? 0u : gap);
  }}
  return number;
}}

/* Index of the largest rate that does not exceed a rate in millihertz; 0 below the first rate. */
static inline unsigned {prefix}_rate_at(uint32_t millihertz)
{{
  unsigned place = 0;
  while (place + 1u < {rates.size}u && {prefix}_rate[place + 1u] <= millihertz) place++;
  return place;
}}

/* Number of slots in advance at which a pattern must be known at a rate: the largest `look_ahead`. */
static inline unsigned {prefix}_slots_ahead(unsigned rate)
{{
  unsigned most = 0;
{_most(prefix, values, entries, "look_ahead")}
  return most;
}}

/* Largest absolute value of `multiplier` at a rate, in thousandths: above 1000, errors grow in some rows. */
static inline int {prefix}_largest_multiplier(unsigned rate)
{{
  int most = 0;
{_most(prefix, values, entries, "multiplier", signed=True)}
  return most;
}}
{_between(prefix, tick, between)}"""
    return guarded(f"{upper}_TABLE_H", body)


def _quote(text: str) -> str:
    """Escape a text for a C string literal."""
    return comment(text).replace('"', "'")


def thousandths(multipliers: FloatArray) -> IntArray:
    """Convert multipliers to thousandths, rounded away from 0 and clipped; INT16_MAX if unknown."""
    most = np.iinfo(np.int16).max
    sizes = np.clip(np.ceil(1e3 * np.abs(multipliers) - _ROUNDING), 0, most)
    return np.where(np.isnan(sizes), most, np.copysign(sizes, multipliers)).astype(np.int64)


def _most(prefix: str, values: int, entries: int, array: str, *, signed: bool = False) -> str:
    """Return the C code of the loops that compute the largest value of an array at one rate.

    The loops run over all histories and axis values; if `signed`, the largest absolute value is computed.
    """
    place = f"{prefix}_{array}{'[value]' if values else ''}[rate][history]"
    loops = f"  for (unsigned history = 0; history < {entries}u; history++)\n"
    if values:
        loops = f"  for (unsigned value = 0; value < {values}u; value++)\n  {loops}"
    body = f"{loops}      if ({place} > most) most = {place};"
    return f"{body}\n{loops}      if (-{place} > most) most = -{place};" if signed else body


class _Between(NamedTuple):
    """C code fragments of an interpolating function, over the slot period or along an axis."""

    said: str
    call: str
    """Name and first arguments of the generated C function."""

    share: str
    """C statements that set `below`, `above`, and the weight `part` / `whole`."""

    place: str
    """Array index with `%` as a placeholder for `below` or `above`."""


def _over_rates(prefix: str, rates: int) -> _Between:
    """Return the C code that interpolates over the slot period like `CompensationTable.at`."""
    rate = f"{prefix}_rate"
    share = f"""\
  const unsigned at = {prefix}_rate_at(millihertz), last = {max(rates - 2, 0)}u;
  const unsigned below = at < last ? at : last, above = below + {min(rates - 1, 1)}u;
  const int64_t low_rate = {rate}[below], high_rate = {rate}[above];
  int64_t asked = millihertz;
  asked = asked < low_rate ? low_rate : asked > high_rate ? high_rate : asked;
  int64_t whole = asked * (high_rate - low_rate), part = high_rate * (asked - low_rate);
  if (whole == 0) whole = 1;
  while (whole > INT32_MAX) {{ whole /= 2; part /= 2; }}"""
    said = (
        "Interpolate the four times, in the order of the arrays, linearly in the period; rates in millihertz."
    )
    return _Between(said, f"{prefix}_times(uint32_t millihertz, ", share, "[%][history]")


def _over_axis(prefix: str, axis: str, values: int) -> _Between:
    """Return the C code of the interpolation along an axis, at one rate of the table."""
    name = f"{prefix}_{axis}"
    share = f"""\
  unsigned above = 1u;
  while (above < {values - 1}u && value > {name}[above]) above++;
  const unsigned below = above - 1u;
  const int64_t whole = (int64_t){name}[above] - {name}[below];
  int64_t part = (int64_t)value - {name}[below];
  part = part < 0 ? 0 : part > whole ? whole : part;"""
    said = "Interpolate the four times, in the order of the arrays, linearly between two values of the axis."
    return _Between(said, f"{prefix}_times(int32_t value, unsigned rate, ", share, "[%][rate][history]")


def _between(prefix: str, tick: float, over: _Between) -> str:
    """Return the C function that interpolates like `printhammer.control.table.compensation.mixed`."""
    ends = "\n".join(
        f"  low[{row}] = {prefix}_{column}{over.place.replace('%', 'below')};\n"
        f"  high[{row}] = {prefix}_{column}{over.place.replace('%', 'above')};"
        for row, column in enumerate(COLUMNS)
    )
    differ = " || ".join(f"low[{row}] != high[{row}]" for row in (_DELAY, _BRAKE))
    return f"""
/* {over.said}
   If two neighbouring entries belong to different solution branches, the nearer entry is used; beyond the
   ends of the table, the last entry. */
static inline void {over.call}unsigned history, int32_t times[{len(COLUMNS)}])
{{
  int32_t low[{len(COLUMNS)}], high[{len(COLUMNS)}];
{over.share}
{ends}
  int32_t apart = high[{_ADVANCE}] - low[{_ADVANCE}];
  apart = apart < 0 ? -apart : apart;
  if (apart > {int(JUMP / tick + 1e-6)} || {differ})
    part = 2 * part > whole ? whole : 0;
  for (unsigned i = 0; i < {len(COLUMNS)}u; i++) {{
    const int64_t sum = low[i] * (whole - part) + high[i] * part;
    times[i] = (int32_t)((sum < 0 ? sum - whole / 2 : sum + whole / 2) / whole);
  }}
}}
"""
