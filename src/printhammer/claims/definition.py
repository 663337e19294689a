"""Claims of the paper, stated as numbers in `claims.toml` beside this file."""

from __future__ import annotations

import math
import operator
import tomllib
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from typing import Any, Final, Literal, get_args

from printhammer.results import Declared, part

Kind = Literal["stated", "typical", "shape"]
KINDS: Final = get_args(Kind)

TEXTS: Final = ("kind", "source", "says", "reading", "note")
SIDES: Final = {"above": operator.gt, "at_least": operator.ge, "below": operator.lt, "at_most": operator.le}

_PRINTED_DIGITS: Final = 1e-9  # Relative difference up to which numbers are equal; rounding


class Claim(Declared):
    """Claim of the paper that can be checked: what to measure, and the band of allowed values."""

    name: str = part("name")
    kind: Kind = part('"stated", "typical" or "shape"')
    source: str = part("section, page or figure of the paper that makes the statement")
    says: str = part("statement of the paper, in our words")
    reading: str = part("measured values, and the condition for the claim to hold")
    note: str = part("additional note for the reader; may be empty")
    settings: Mapping[str, Any] = part("numbers that set up the experiment, SI")
    band: Mapping[str, Any] = part(
        "allowed values of each measured value: a number or text, true or false; a list (least, largest) of"
        " two numbers, or of texts; a table of `SIDES`"
    )

    def holds(self, value: Mapping[str, Any]) -> bool:
        """Whether every measured value lies within its band."""
        return all(within(value.get(key), band) for key, band in self.band.items())

    def missed(self, value: Mapping[str, Any]) -> list[str]:
        """List the names of the measured values that lie outside their bands."""
        return [key for key, band in self.band.items() if not within(value.get(key), band)]


def within(value: Any, band: Any) -> bool:
    """Whether a measured value lies within a band; False for None and NaN."""
    if isinstance(band, dict):
        return _is_number(value) and all(SIDES[side](value, limit) for side, limit in band.items())
    if isinstance(band, list) and len(band) == 2 and all(_is_number(end) for end in band):
        return _is_number(value) and band[0] <= value <= band[1]
    if isinstance(band, list):
        return isinstance(value, (list, tuple)) and list(value) == band
    if isinstance(band, bool) or isinstance(value, bool) or not _is_number(band):
        return type(value) is type(band) and value == band
    return _is_number(value) and math.isclose(value, band, rel_tol=_PRINTED_DIGITS)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and not math.isnan(value)


@lru_cache(maxsize=1)
def claims() -> Mapping[str, Claim]:
    """Return all claims by name, in the order of the paper."""
    text = files("printhammer").joinpath("claims", "claims.toml").read_text(encoding="utf-8")
    made = {}
    for name, table in tomllib.loads(text).items():
        settings = {key: table[key] for key in table.pop("settings", [])}
        texts = {key: table.pop(key, "") for key in TEXTS}
        band = {key: limits for key, limits in table.items() if key not in settings}
        made[name] = Claim(name=name, **texts, settings=settings, band=band)
    return made
