"""Contents of a report: evaluated claims, drawn figures, results of the reconstruction.

`cited_figures` and `linked_source` find the figures that a claim cites.

`misses` states by how much a claim fails. Values and bands become text in SI units with prefixes and in
inch-pound units.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any, Final

from printhammer.claims import Claim, JudgedClaim
from printhammer.claims.judging import SIDES
from printhammer.hammer.hammer import Hammer
from printhammer.report.reconstruction.results import Family, Results, Search
from printhammer.results import Declared, part
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
    """Format a measured value, in SI, as text; if `other`, with the inch-pound value in parentheses."""
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
        return " and ".join(_WORDS[side].format(_limit_text(limit, unit)) for side, limit in band.items())
    if isinstance(band, list) and band and isinstance(band[0], str):
        return ", ".join(band)
    if isinstance(band, list):
        low, high = (_limit_text(end, unit) for end in band)
        sign = _SHOWN[unit][1] if unit else ""
        return f"{low.removesuffix(sign).strip()} to {high}"
    return (
        f"must be {value_text(band, '')}" if isinstance(band, (bool, str)) else f"= {_limit_text(band, unit)}"
    )


def _limit_text(value: float, unit: str) -> str:
    return _both(value, unit, ".6g", other=False) if unit else _number(value, "g")


def typeset(text: str) -> str:
    """Replace "us", ">=", "<=" and "->" in a sentence with µs, ≥, ≤ and →."""
    text = re.sub(r"(?<=\d) u([ms])\b", "\N{NO-BREAK SPACE}µ\\1", text)
    return text.replace(">=", "≥").replace("<=", "≤").replace(" -> ", " → ")


def percent(part: float) -> str:
    """Format a fraction in percent, such as "3.1 %"; 100 % and 0 % are printed only if exact."""
    if part in (0.0, 1.0):
        return f"{part:.0%}".replace("%", "\N{NO-BREAK SPACE}%")
    shown = 100.0 * part
    # Enough digits to distinguish the fraction from all or none.
    text = f"{shown:.2g}" if shown < 10.0 else f"{shown:.{max(0, math.ceil(-math.log10(100.0 - shown)))}f}"
    # Format without an exponent.
    return f"{Decimal(text):f}\N{NO-BREAK SPACE}%"


def _both(value: float, unit: str, digits: str, *, other: bool = True) -> str:
    name, sign, inch, inch_sign = _SHOWN[unit]
    shown = from_si(value, unit, name)
    text = f"{_number(shown, digits)} {sign}"
    if inch and other and abs(shown) >= _TINY:
        text += f" ({_number(from_si(value, unit, inch), '.4g')} {inch_sign})"
    return text


def _number(value: float, digits: str) -> str:
    """Format a number, with exponents such as "e-5" instead of "e-05", and a true minus sign."""
    return re.sub(r"e(-?)\+?0*(\d)", r"e\1\2", f"{value:{digits}}").replace("-", "−")


class Drawing(Declared):
    """Figure of the paper, drawn for a hammer."""

    number: int = part("number in the paper")
    title: str = part("title of the figure")
    caption: str = part("caption: what the figure shows for this hammer")
    says: str = part("statement of the paper about the figure, in our words")
    svg: bytes = part("SVG image; empty if the figure could not be drawn")
    pdf: Path | None = part("path of the vector file, relative to the folder of the report")
    reason: str = part("reason why the figure could not be drawn; empty if drawn")
    claims: tuple[JudgedClaim, ...] = part("claims that cite the figure")
    seconds: float = part("computation time of the figure")


class Report(Declared):
    """Result of `write_report`: claims, figures and files."""

    hammer: Hammer = part("the hammer")
    results: list[JudgedClaim] = part("the evaluated claims")
    drawings: list[Drawing] = part("the figures")
    provenance: Mapping[str, Any] = part("versions, fingerprint, tolerance")
    reconstruction: Results = part("results of the reconstruction of this or another hammer")
    seconds: float = part("total computation time")
    files: list[Path] = part("paths of the written files", default_factory=list)

    def count(self, verdict: str) -> int:
        """Return the number of claims with a given verdict, such as "holds"."""
        return sum(result.verdict == verdict for result in self.results)

    @property
    def statements(self) -> tuple[int, int]:
        """Number of statements of the paper that hold, and number of all statements of the paper.

        Each panel of Fig. 11 counts as one statement.
        """
        pairs = [result.statements for result in self.results]
        return sum(held for held, _ in pairs), sum(made for _, made in pairs)

    @property
    def reconstructed(self) -> bool:
        """Whether the hammer is the reconstruction of the hammer of the paper."""
        return self.search is not None

    @property
    def search(self) -> Search | None:
        """Record of the search that found the constants of the hammer; None if no search found them."""
        search = self.reconstruction.search
        return search if search is not None and search.shipped == self.hammer.fingerprint else None

    @property
    def family(self) -> Family | None:
        """Family of hammers that satisfy the claims about as well as the hammer of the report.

        None unless this hammer is the reconstruction of the hammer of the paper.
        """
        return self.reconstruction.family if self.reconstructed else None


CITATION: Final = re.compile(r"Figs?\. (?:[\d, and]*\d)")
"""Regular expression that matches a citation of figures, such as "Figs. 3 and 4"."""

SECTIONS: Final = {"Poincaré plots": 11}
"""Figure number by section of the paper, for sections about a single figure."""


def cited_figures(source: str) -> set[int]:
    """Return the numbers of the figures that the source of a claim cites or is about."""
    named = {int(number) for number in re.findall(r"\d+", " ".join(CITATION.findall(source)))}
    return named | ({SECTIONS[source]} if source in SECTIONS else set())


def linked_source(source: str, drawn: set[int]) -> Any:
    """Return the source of a claim as HTML, with links to the drawn figures; `drawn` are their numbers."""
    from markupsafe import Markup, escape

    def link(match: re.Match[str]) -> str:
        number = match[0]
        return f'<a href="#figure-{number}">{number}</a>' if int(number) in drawn else number

    text = str(escape(source))
    text = CITATION.sub(lambda citation: re.sub(r"\d+", link, citation[0]), text)
    number = SECTIONS.get(source)
    if number in drawn:
        text += f' (<a href="#figure-{number}">Fig. {number}</a>)'
    return Markup(text)


class Miss(Declared):
    """Measured value outside the band of its claim, as text."""

    words: str = part("name of the measured quantity")
    value: str = part("measured value, with unit")
    band: str = part("required value or range")
    distance: str = part("distance of the value from the band")


def misses(claim: Claim, value: Mapping[str, Any] | None) -> list[Miss]:
    """List the measured values of a claim that lie outside its band; empty if nothing was measured."""
    missed: list[Miss] = []
    if value is None:
        return missed
    for name in claim.missed(value):
        words, unit = split_name(name)
        measured, band = value.get(name), claim.band[name]
        if isinstance(band, list) and isinstance(band[0], str):
            # Lists of words are reported item by item elsewhere.
            missed.append(Miss(words, agreement(measured, band), "", ""))
        else:
            shown = value_text(measured, unit), band_text(band, unit)
            missed.append(Miss(words, *shown, distance(measured, band, unit)))
    return missed


def agreement(value: Any, band: list[str]) -> str:
    """Format the number of panels classified as in the paper, such as "9 of 12 as printed"."""
    words = value if isinstance(value, (list, tuple)) else []
    same = sum(one == other for one, other in zip(words, band, strict=False))
    return f"{same} of {len(band)} as printed"


def distance(value: Any, band: Any, unit: str) -> str:
    """Format the distance of a value from its band; empty if the band is not numeric.

    Parameters
    ----------
    value
        A measured value outside the band, SI.
    band
        Band, in the form of `printhammer.claims.Claim.band`.
    unit : str
        SI unit; empty for a pure number.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return ""
    limit = _limit(float(value), band)
    if limit is None:
        return ""
    if value == limit:
        return "exactly at the limit"
    way = "too small" if value < limit else "too large"
    if limit == 0.0 or isinstance(value, int):
        return f"{way} by {value_text(abs(value - limit), unit, other=False)}"
    part = abs((value - limit) / limit)
    return f"{way} by {100.0 * part:.3g} %" if part < 1.0 else f"{way} by {part:.2g} times the limit"


def _limit(value: float, band: Any) -> float | None:
    """Return the bound of a band that a value violates."""
    if isinstance(band, dict):
        for side, limit in band.items():
            if not (math.isnan(value) or SIDES[side](value, limit)):
                return float(limit)
        return None
    if isinstance(band, list):
        return float(band[0] if value < band[0] else band[1])
    return None if isinstance(band, (bool, str)) else float(band)
