"""Evaluation of claims: a function measures the values; the bands in `claims.toml` decide.

A `Claim` is a statement of the paper as numbers in `claims.toml` beside this file. The module also has the
statistics that claims share: `largest`, `falling`, `rank_correlation` and `spread`.
"""

from __future__ import annotations

import itertools
import math
import operator
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from time import perf_counter
from typing import Any, Final, Literal, get_args

import numpy as np

from printhammer.claims.context import Context, NotMeasurableError
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray

Kind = Literal["stated", "typical", "shape"]
KINDS: Final = get_args(Kind)

TEXTS: Final = ("kind", "source", "says", "reading", "note")
SIDES: Final = {"above": operator.gt, "at_least": operator.ge, "below": operator.lt, "at_most": operator.le}

_PRINTED_DIGITS: Final = 1e-9
"""Relative difference up to which two numbers are equal; covers rounding; arbitrary."""


class Claim(Declared):
    """Claim of the paper that can be checked, with the bands of allowed values of measured quantities."""

    name: str = part("name")
    kind: Kind = part('"stated", "typical" or "shape"')
    source: str = part("section, page or figure of the paper that makes the statement")
    says: str = part("statement of the paper, in our words")
    reading: str = part("measured values, and the condition for the claim to hold")
    note: str = part("additional note for the reader, or an empty string")
    settings: Mapping[str, Any] = part("numbers that set up the experiment, SI")
    band: Mapping[str, Any] = part(
        "allowed values of each measured value: a number or text, true or false; a list (smallest, largest)"
        " of two numbers, or of texts; a table of `SIDES`"
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


WHOLE: Final = ("backstop", "pack", "waveform")
"""Components of a complete hammer, which most claims require."""

Verdict = Literal["holds", "fails", "not yet"]


@dataclass(frozen=True)
class Measured:
    """Measured values of a claim, with a sentence that describes them."""

    value: Mapping[str, Any]
    """Measured values by name, SI; names end with the unit. None for a value that does not exist."""
    detail: str
    """Sentence that describes the measured values."""


class JudgedClaim(Declared):
    """Claim with its measured values and the verdict: "holds", "fails" or "not yet"."""

    claim: Claim = part("claim that was evaluated")
    value: Mapping[str, Any] | None = part("measured values by name, SI; None if no value could be measured")
    verdict: Verdict = part('"holds", "fails" or "not yet"')
    detail: str = part("sentence that describes the values, or the reason why none could be measured")
    seconds: float = part("computation time, s; not included in `as_dict`", default=0.0)

    @property
    def missed(self) -> list[str]:
        """Names of the measured values outside their bands."""
        return self.claim.missed(self.value) if self.value is not None else []

    @property
    def statements(self) -> tuple[int, int]:
        """Number of statements of the claim that hold, and number of all its statements.

        A claim is one statement, unless a band is a list of texts; then each text is a statement.
        """
        value = self.value or {}
        lists = {name: band for name, band in self.claim.band.items() if _is_texts(band)}
        if not lists:
            return int(self.verdict == "holds"), 1
        pairs = [
            (found, wanted)
            for name, band in lists.items()
            for found, wanted in itertools.zip_longest(value.get(name, ()), band)
        ]
        return sum(found == wanted for found, wanted in pairs), sum(map(len, lists.values()))

    def as_dict(self) -> dict[str, Any]:
        """Return the claim and its verdict as a dictionary, the form of an entry of `claims.json`."""
        claim = self.claim
        return {
            "name": claim.name,
            "kind": claim.kind,
            "value": None if self.value is None else dict(self.value),
            "band": dict(claim.band),
            "verdict": self.verdict,
            "reading": claim.reading,
            "detail": self.detail,
            "source": claim.source,
            "says": claim.says,
            "note": claim.note,
        }


def _is_texts(band: Any) -> bool:
    return isinstance(band, list) and all(isinstance(entry, str) for entry in band)


Judge = Callable[[Context, Claim], Measured]
"""Type of a function that measures the values of a claim."""

JUDGES: Final[dict[str, tuple[tuple[str, ...], Judge]]] = {}
"""Required components and measuring function of each claim, by the claim's name."""


def measures(name: str, *needs: str) -> Callable[[Judge], Judge]:
    """Decorate the measuring function of a claim; `needs` are the components that the claim requires."""

    def register(function: Judge) -> Judge:
        if name in JUDGES or name not in claims():
            raise ValueError(f"the claim {name!r} is measured twice, or is not known")
        JUDGES[name] = (needs, function)
        return function

    return register


PENDING: Final[dict[str, str]] = {}
"""Missing capability of each claim that cannot be evaluated yet, by the claim's name."""


def judge_all(
    hammer: Hammer,
    names: Iterable[str] | None = None,
    progress: Callable[[str], None] | None = None,
    context: Context | None = None,
) -> list[JudgedClaim]:
    """Evaluate the claims of the paper for one hammer.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    names : iterable of str, optional
        Names of the claims to evaluate; by default all.
    progress : callable, optional
        Called with the name of each claim before its evaluation.
    context : Context, optional
        Context with the shared runs; by default a new context.

    Returns
    -------
    list of JudgedClaim
        Evaluated claims, in the order of the paper.
    """
    context = Context(hammer) if context is None else context
    wanted = set(claims() if names is None else names)
    results = []
    for name, claim in claims().items():
        if name in wanted:
            if progress is not None:
                progress(name)
            results.append(judge(context, claim))
    return results


def judge(context: Context, claim: Claim) -> JudgedClaim:
    """Evaluate one claim: measure its values, and compare the values with their bands."""
    if claim.name in PENDING:
        return JudgedClaim(claim, None, "not yet", f"Not judged yet: requires {PENDING[claim.name]}.")
    start = perf_counter()
    needs, function = JUDGES[claim.name]
    try:
        for need in needs:
            context.need(need)
        measured = function(context, claim)
    except (NotMeasurableError, InputError) as error:
        reason = str(error)
        return JudgedClaim(claim, None, "fails", f"{reason[:1].upper()}{reason[1:]}.", perf_counter() - start)
    verdict: Verdict = "holds" if claim.holds(measured.value) else "fails"
    return JudgedClaim(claim, measured.value, verdict, measured.detail, perf_counter() - start)


_POINTS: Final = 4001  # Grid points of `largest` per refinement; arbitrary
_ZOOMS: Final = 6  # Number of successive grids of `largest`; arbitrary


def largest(function: Callable[[FloatArray], FloatArray], start: float, end: float) -> float:
    """Estimate the maximum of a function of time from `start` to `end` [s] by repeated grid refinement."""
    best = -np.inf
    for _ in range(_ZOOMS if end > start else 1):
        grid = np.linspace(start, end, _POINTS)
        values = function(grid)
        top = int(np.argmax(values))
        best = max(best, float(values[top]))
        start, end = grid[max(top - 1, 0)], grid[min(top + 1, _POINTS - 1)]
    return best


def falling(values: Sequence[float]) -> bool:
    """Whether the values are strictly decreasing."""
    return all(after < before for before, after in itertools.pairwise(values))


def rank_correlation(first: Sequence[float], second: Sequence[float]) -> float | None:
    """Return Spearman's rank correlation of two series, with mean ranks for ties; None if undefined."""
    if len(first) < 2 or len(set(first)) < 2 or len(set(second)) < 2:
        return None
    a, b = _ranks(first), _ranks(second)
    a, b = a - a.mean(), b - b.mean()
    return float(np.sum(a * b) / np.sqrt(np.sum(a * a) * np.sum(b * b)))


def _ranks(values: Sequence[float]) -> FloatArray:
    data = np.asarray(values, dtype=np.float64)
    below, equal = data[:, np.newaxis] > data, data[:, np.newaxis] == data
    return np.asarray(below.sum(axis=1) + 0.5 * equal.sum(axis=1), dtype=np.float64)


def spread(values: Sequence[float]) -> float:
    """Return the range of values: the largest minus the smallest."""
    return max(values) - min(values)
