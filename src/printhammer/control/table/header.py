"""Compensation tables as C headers, in whole ticks of the timer of the firmware."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table.drive import COLUMNS
from printhammer.control.table.histories import entries_of
from printhammer.support.c_code import comment, identifier, nested, numbers

if TYPE_CHECKING:
    from collections.abc import Mapping

    from printhammer.support.arrays import FloatArray

NANOSECOND: Final = 1e-9  # Unit of the times in a C header where no tick is given, s
_PLACE_BYTES: Final = 4  # Size of a rate, or a value of an axis


def bits_of(times: Mapping[str, FloatArray], tick: float) -> int:
    """Return the size in bits of a time in ticks: 32 of nanoseconds, else 16 where all of them fit."""
    largest = max(float(np.abs(np.rint(values / tick)).max()) for values in times.values())
    return 32 if tick == NANOSECOND or largest > np.iinfo(np.int16).max else 16


def size_of(rates: int, entries: int, bits: int, values: int = 0) -> int:
    """Return the bytes that the arrays of a header take, by numbers of rates, entries and values."""
    times = max(values, 1) * rates * len(COLUMNS) * entries * bits // 8
    return times + _PLACE_BYTES * (rates + values)


def header_text(
    head: Mapping[str, Any],
    rates: FloatArray,
    times: Mapping[str, FloatArray],
    tick: float = NANOSECOND,
    axis: tuple[str, FloatArray] | None = None,
) -> str:
    """Return a C header (C99) with the table in whole ticks and a function for the number of a history.

    `head` is what is said of the whole table, see `HEAD`; `times` are arrays (rates, entries) by name, s, and
    `tick` is that of the timer, s. Every number of a history is there, so that the firmware needs no search.
    With an `axis`, its name and its values, times are arrays (values, rates, entries).
    """
    gaps, reach = head["gaps"], head["reach"]
    prefix = identifier(head["hammer"])
    guard, upper = f"{prefix}_table_h".upper(), prefix.upper()
    entries, fingerprint = entries_of(gaps, reach), re.sub(r"[^0-9a-zA-Z]", "", head["fingerprint"])
    nanoseconds = round(tick / NANOSECOND)
    unit = "nanoseconds" if nanoseconds == 1 else f"ticks of {nanoseconds} ns"
    name = comment(head["hammer"])
    arrays, bits = "", bits_of(times, tick)
    places, said = "", ""
    if axis is not None:
        word, places = axis[0], f"[{axis[1].size}]"
        arrays = f"\nstatic const int32_t {prefix}_{word}{places} = {{\n{numbers(axis[1])}\n}};\n"
        said = f"\n   Before them stands the place in {prefix}_{word}; between two, interpolate."
    for column, values in times.items():
        shape = f"{places}[{rates.size}][{entries}]"
        arrays += f"\nstatic const int{bits}_t {prefix}_{column}{shape} = {nested(np.rint(values / tick))};\n"
    return f"""\
#ifndef {guard}
#define {guard}

/* Compensation table for the hammer {name},
   fingerprint {fingerprint}.
   Times are in {unit}. [rate][history]; a history is the gaps in slots to the dots before,
   the latest first, 0 (rest) where a gap is longer than REACH. A dot is fired `advance` before its
   slot with a pulse of `width`; a brake pulse of `brake_width`, where not 0, comes `brake_delay`
   after the slot of the dot before.{said} */

#include <stdint.h>

#define {upper}_RATES {rates.size}
#define {upper}_GAPS {gaps}
#define {upper}_REACH {reach}
#define {upper}_HISTORIES {entries}
#define {upper}_FINGERPRINT "{fingerprint}"
#define {upper}_TICK_NS {nanoseconds}
#define {upper}_BYTES {size_of(rates.size, entries, bits, 0 if axis is None else axis[1].size)}

/* Slots per second, in millihertz. */
static const uint32_t {prefix}_rate[{rates.size}] = {{
{numbers(np.rint(1e3 * rates))}
}};
{arrays}
/* Number of a history; what lies before a rest does not count. */
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

#endif
"""
