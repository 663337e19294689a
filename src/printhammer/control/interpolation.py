"""Interpolation along an axis of tables as firmware does it: C99 in whole numbers, without a library."""

from __future__ import annotations

from typing import Final

from printhammer.control.table.compensation import JUMP
from printhammer.control.table.drive import COLUMNS

_ADVANCE, _, _DELAY, _BRAKE = COLUMNS
_END: Final = "\n#endif\n"


def with_interpolation(header: str, prefix: str, axis: str, values: int, tick: float) -> str:
    """Return a header of tables along an axis with a function that interpolates between its values.

    It does what `printhammer.control.table.compensation.mixed` does, on the times in ticks, s, that the
    header holds.
    """
    name, count = f"{prefix}_{axis}", len(COLUMNS)
    ends = "\n".join(
        f"  low[{row}] = {prefix}_{column}[above - 1u][rate][history];\n"
        f"  high[{row}] = {prefix}_{column}[above][rate][history];"
        for row, column in enumerate(COLUMNS)
    )
    place = {column: row for row, column in enumerate(COLUMNS)}
    differ = " || ".join(f"low[{place[key]}] != high[{place[key]}]" for key in (_DELAY, _BRAKE))
    code = f"""
/* The four times at a value of the axis, in the order of the arrays: interpolated between two values; where
   two ways to fire do not belong together, those of the nearer value; beyond the ends, those of the end. */
static inline void {name}_times(int32_t value, unsigned rate, unsigned history, int32_t times[{count}])
{{
  int32_t low[{count}], high[{count}];
  unsigned above = 1u;
  while (above < {values - 1}u && value > {name}[above]) above++;
  const int64_t whole = (int64_t){name}[above] - {name}[above - 1u];
  int64_t part = (int64_t)value - {name}[above - 1u];
  part = part < 0 ? 0 : part > whole ? whole : part;
{ends}
  int32_t apart = high[{place[_ADVANCE]}] - low[{place[_ADVANCE]}];
  apart = apart < 0 ? -apart : apart;
  if (apart > {int(JUMP / tick + 1e-6)} || {differ})
    part = 2 * part > whole ? whole : 0;
  for (unsigned i = 0; i < {count}u; i++) {{
    const int64_t sum = low[i] * (whole - part) + high[i] * part;
    times[i] = (int32_t)((sum < 0 ? sum - whole / 2 : sum + whole / 2) / whole);
  }}
}}
"""
    return f"{header.removesuffix(_END)}{code}{_END}"
