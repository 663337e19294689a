"""Measured values and bands as text: in SI units with prefixes, and in inch-pound units."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from typing import Any, Final

from printhammer.units import from_si

_SUFFIXES: Final = {
    "_m_per_s": "m/s",
    "_Hz": "Hz",
    "_m": "m",
    "_s": "s",
    "_N": "N",
    "_J": "J",
    "_A": "A",
}

# Unit shown, with its symbol, for each SI unit, and the inch-pound unit that the paper would use.
_SHOWN: Final = {
    "m": ("um", "µm", "in", "in"),
    "s": ("us", "µs", "", ""),
    "N": ("N", "N", "lbf", "lbf"),
    "J": ("mJ", "mJ", "in lbf", "in·lbf"),
    "m/s": ("m/s", "m/s", "in/s", "in/s"),
    "Hz": ("Hz", "Hz", "", ""),
    "A": ("A", "A", "", ""),
}

_TINY: Final = 1e-6
"""Displayed number below which the inch-pound value is omitted; arbitrary."""

_WORDS: Final = {
    "above": "> {}",
    "at_least": "≥ {}",
    "below": "< {}",
    "at_most": "≤ {}",
}


def split_name(name: str) -> tuple[str, str]:
    """Split a name such as "peak_force_N" into words and SI unit, ("peak force", "N")."""
    for suffix, unit in _SUFFIXES.items():
        if name.endswith(suffix):
            return words_of(name.removesuffix(suffix).replace("_over_", " / ")), unit
    return words_of(name.replace("_over_", " / ")), ""


def words_of(name: str) -> str:
    """Convert a name with underscores to words."""
    return name.replace("_", " ")


def value_text(value: Any, unit: str, *, other: bool = True) -> str:
    """Format a measured value, with the inch-pound value in parentheses."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple)):
        return ", ".join(value_text(entry, unit, other=False) for entry in value)
    if not isinstance(value, (int, float)):
        return str(value)
    if not unit:
        return _number(value, ".4g") if isinstance(value, float) else str(value)
    return _both(value, unit, ".4g", other=other)


def band_text(band: Any, unit: str) -> str:
    """Format the band of a claim as text: a range, a bound, or the required value."""
    if isinstance(band, dict):
        return " and ".join(_WORDS[side].format(_limit(limit, unit)) for side, limit in band.items())
    if isinstance(band, list) and band and isinstance(band[0], str):
        return ", ".join(band)
    if isinstance(band, list):
        low, high = (_limit(end, unit) for end in band)
        sign = _SHOWN[unit][1] if unit else ""
        return f"{low.removesuffix(sign).strip()} to {high}"
    return f"must be {value_text(band, '')}" if isinstance(band, (bool, str)) else f"= {_limit(band, unit)}"


def _limit(value: float, unit: str) -> str:
    return _both(value, unit, ".6g", other=False) if unit else _number(value, "g")


def typeset(text: str) -> str:
    """Return a sentence with typographic characters."""
    text = re.sub(r"(?<=\d) u([ms])\b", "\N{NO-BREAK SPACE}µ\\1", text)
    return text.replace(">=", "≥").replace("<=", "≤").replace(" -> ", " → ")


def percent(part: float) -> str:
    """Format a fraction in percent, such as "3.1 %"; 100 % and 0 % are reserved for all and none."""
    if part in (0.0, 1.0):
        return f"{part:.0%}".replace("%", "\N{NO-BREAK SPACE}%")
    shown = 100.0 * part
    # Enough digits to distinguish the fraction from all or none.
    text = f"{shown:.2g}" if shown < 10.0 else f"{shown:.{max(0, math.ceil(-math.log10(100.0 - shown)))}f}"
    # Without an exponent.
    return f"{Decimal(text):f}\N{NO-BREAK SPACE}%"


def _both(value: float, unit: str, digits: str, *, other: bool = True) -> str:
    name, sign, inch, inch_sign = _SHOWN[unit]
    shown = from_si(value, unit, name)
    text = f"{_number(shown, digits)} {sign}"
    if inch and other and abs(shown) >= _TINY:
        text += f" ({_number(from_si(value, unit, inch), '.4g')} {inch_sign})"
    return text


def _number(value: float, digits: str) -> str:
    """Format a number with a short exponent and a true minus sign."""
    return re.sub(r"e(-?)\+?0*(\d)", r"e\1\2", f"{value:{digits}}").replace("-", "−")
