"""The C header of a dead time: rails, temperatures, tables of times, and a function between their entries."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.support import c_code

if TYPE_CHECKING:
    from collections.abc import Mapping

    from printhammer.support.arrays import FloatArray

_NANOSECOND: Final = 1e-9


def header_text(
    hammer: str,
    fingerprint: str,
    voltage: FloatArray,
    temperature: FloatArray,
    tables: Mapping[str, FloatArray],
) -> str:
    """Return a C header (C99) with rails in millivolts, tenths of a degree and nanoseconds.

    `tables` are times by name, s, over rails, V, and temperatures, degC; what is NaN becomes 0.
    """
    prefix = c_code.identifier(hammer)
    upper, guard = prefix.upper(), f"{prefix}_dead_time_h".upper()
    arrays = "\n".join(
        c_code.table("int32_t", f"{prefix}_{name}", np.rint(np.nan_to_num(times) / _NANOSECOND))
        for name, times in tables.items()
    )
    return f"""\
#ifndef {guard}
#define {guard}

/* Dead time of the hammer {c_code.comment(hammer)},
   fingerprint {fingerprint}.
   [rail][temperature of the coil]; times are in nanoseconds, 0 where no pulse gives the blow.
   A dot is fired `dead_time` before its impact with a pulse of `width`. */

#include <stdint.h>

#define {upper}_RAILS {voltage.size}
#define {upper}_TEMPERATURES {temperature.size}

/* Rails, in millivolts. */
static const int32_t {prefix}_rail[{voltage.size}] = {{
{c_code.numbers(np.rint(1e3 * voltage))}
}};

/* Temperatures of the coil, in tenths of a degree Celsius. */
static const int32_t {prefix}_temperature[{temperature.size}] = {{
{c_code.numbers(np.rint(10.0 * temperature))}
}};

{arrays}
/* Between the entries of a table, and at its edges beyond them; 0 where one of the four is 0. */
static inline int32_t {prefix}_between(
  const int32_t table[{upper}_RAILS][{upper}_TEMPERATURES], int32_t millivolts, int32_t tenths)
{{
  const int32_t *rail = {prefix}_rail, *warm = {prefix}_temperature;
  unsigned i = 0, j = 0;
  while (i + 2u < {upper}_RAILS && millivolts > rail[i + 1u]) i++;
  while (j + 2u < {upper}_TEMPERATURES && tenths > warm[j + 1u]) j++;
  unsigned k = {upper}_RAILS > 1 ? i + 1u : i, l = {upper}_TEMPERATURES > 1 ? j + 1u : j;
  int64_t a = table[i][j], b = table[k][j], c = table[i][l], d = table[k][l];
  if (a == 0 || b == 0 || c == 0 || d == 0) return 0;
  int64_t p = millivolts < rail[i] ? rail[i] : millivolts > rail[k] ? rail[k] : millivolts;
  int64_t q = tenths < warm[j] ? warm[j] : tenths > warm[l] ? warm[l] : tenths;
  if (k > i) {{
    a += (b - a) * (p - rail[i]) / (rail[k] - rail[i]);
    c += (d - c) * (p - rail[i]) / (rail[k] - rail[i]);
  }}
  return (int32_t)(l > j ? a + (c - a) * (q - warm[j]) / (warm[l] - warm[j]) : a);
}}

#endif
"""
