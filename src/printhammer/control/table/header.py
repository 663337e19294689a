"""A compensation table as a C header."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.table.compensation import COLUMNS

if TYPE_CHECKING:
    from printhammer.control.table.compensation import CompensationTable

NANOSECOND: Final = 1e-9
"""Unit of the times in a C header, s."""


def header_text(table: CompensationTable) -> str:
    """Return a C header (C99) with the table as whole nanoseconds and a function for the number of a history.

    Parameters
    ----------
    table : CompensationTable
        The table. Every number of a history is there, so that the firmware needs no search.
    """
    prefix = re.sub(r"\W+", "_", f"printhammer_{table.hammer}", flags=re.ASCII).lower()
    guard = f"{prefix}_table_h".upper()
    rows, entries = table.advance.shape
    name = table.hammer.encode("ascii", "replace").decode().replace("*/", "* /").replace("\\", "/")
    name = "".join(letter if letter.isprintable() else " " for letter in name)
    lines = [
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        f"/* Compensation table for the hammer {name},",
        f"   fingerprint {re.sub(r'[^0-9a-zA-Z]', '', table.fingerprint)}.",
        "   Times are in nanoseconds. [rate][history]; a history is the gaps in slots to the dots before,",
        "   the latest first, 0 (rest) where a gap is longer than REACH. A dot is fired `advance` before its",
        "   slot with a pulse of `width`; a brake pulse of `brake_width`, where not 0, comes `brake_delay`",
        "   after the slot of the dot before. */",
        "",
        "#include <stdint.h>",
        "",
        f"#define {prefix.upper()}_RATES {rows}",
        f"#define {prefix.upper()}_GAPS {table.gaps}",
        f"#define {prefix.upper()}_REACH {table.reach}",
        f"#define {prefix.upper()}_HISTORIES {entries}",
        f'#define {prefix.upper()}_FINGERPRINT "{re.sub(r"[^0-9a-zA-Z]", "", table.fingerprint)}"',
        "",
        "/* Slots per second, in millihertz. */",
        f"static const uint32_t {prefix}_rate[{rows}] = {{",
        _numbers(np.rint(1e3 * table.rates)),
        "};",
    ]
    for column in COLUMNS:
        lines += ["", f"static const int32_t {prefix}_{column}[{rows}][{entries}] = {{"]
        values = np.rint(getattr(table, column) / NANOSECOND)
        lines += [f"  {{\n{_numbers(row)}\n  }}," for row in values]
        lines += ["};"]
    lines += [
        "",
        "/* Number of a history; what lies before a rest does not count. */",
        f"static inline unsigned {prefix}_history(const unsigned *gaps)",
        "{",
        "  unsigned number = 0, rested = 0;",
        f"  for (unsigned i = 0; i < {table.gaps}u; i++) {{",
        f"    unsigned gap = gaps[i] > {table.reach}u ? 0u : gaps[i];",
        "    rested |= gap == 0u;",
        f"    number = number * {table.reach + 1}u + (rested ? 0u : gap);",
        "  }",
        "  return number;",
        "}",
        "",
        "#endif",
    ]
    return "\n".join(lines) + "\n"


def _numbers(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    """Write whole numbers, ten a line."""
    texts = [str(int(value)) for value in values]
    return ",\n".join("    " + ", ".join(texts[at : at + 10]) for at in range(0, len(texts), 10))
