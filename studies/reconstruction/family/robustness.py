"""Robustness: which conclusions hold for all hammers of a family, and which depend on unknown constants.

A conclusion is robust if the spread of its values is less than a tenth of their median, or if no member has a
value; a statement is robust if it is true for every member or for none. For a conclusion that is not robust,
rank correlations show the constants on which it depends. The members were selected to differ and are not a
random sample: ranges and correlations describe these members, not a population.
"""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING, Any, Final

from printhammer.claims.judging import claims, rank_correlation
from printhammer.results import Declared, part
from studies.reconstruction.family.conclusions import QUANTITIES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

Values = dict[str, Any]

ROBUST: Final = 0.1  # Spread relative to the median below which a conclusion is robust; arbitrary

SIGNIFICANT: Final = 0.05  # Family-wise significance level of the rank correlations

_FEWEST: Final = 4
_SCALING: Final = ("J", "N")


class Statement(Declared):
    """General statement of the paper, expressed as a margin that is positive if the statement is true."""

    text: str = part("the statement")
    source: str = part("section of the paper that makes the statement")
    unit: str = part("SI unit of the margin")
    margin: Callable[[Values], float] = part(
        "function that computes the margin from the conclusions about a hammer"
    )


def _tolerated(name: str) -> float:
    """Return the spread of flight times [s] that a kind of printing tolerates according to the paper."""
    return float(claims()["flight_time_spread"].settings[name])


STATEMENTS: Final[dict[str, Statement]] = {
    "prints_badly_before_chaos": Statement(
        "the safe rate lies below the rate at which trains turn strange",
        "abstract: interaction first shows as flight-time and print-force variations",
        "Hz",
        lambda known: 1.0 / known["chaos_onset_s"] - known["safe_rate_Hz"],
    ),
    "not_settled_at_1_kHz": Statement(
        "at 1 kHz the armature is fired before it has settled",
        "introduction: 1 kHz and faster only without waiting for complete settle-out",
        "s",
        lambda known: known["settle_out_s"] - 1e-3,
    ),
    "looks_settled_but_is_not": Statement(
        "patterns print badly already at rates at which each firing finds the armature settled to the eye",
        "single-shot response: the impression that the hammer is ready for another firing",
        "Hz",
        lambda known: 1.0 / known["settle_out_s"] - known["safe_rate_Hz"],
    ),
    "too_much_for_engraved_type": Statement(
        "flight times of bursts spread by more than 30 us, what engraved characters tolerate",
        "introduction: a few tens of microseconds",
        "s",
        lambda known: known["flight_time_spread_s"] - _tolerated("engraved_s"),
    ),
    "too_much_for_dot_matrix": Statement(
        "flight times of bursts spread by more than 200 us, what dot-matrix printing tolerates",
        "introduction: of the order of 200 us",
        "s",
        lambda known: known["flight_time_spread_s"] - _tolerated("dot_matrix_s"),
    ),
    "backstop_takes_more_than_pack": Statement(
        "the backstop takes more energy of a dot than the pack",
        "discussion: in the limit, only what the pack absorbs need be expended",
        "J",
        lambda known: known["backstop_loss_J"] - known["pack_loss_J"],
    ),
}
"""Statements of the paper that are evaluated for every member, by name."""


def robustness(
    conclusions: Sequence[Values], constants: Sequence[Mapping[str, float]]
) -> dict[str, dict[str, Any]]:
    """Return range, spread and robustness of all conclusions and statements.

    Parameters
    ----------
    conclusions : sequence of dict
        One mapping per member, as returned by `Conclusions.as_dict`.
    constants : sequence of mapping
        One mapping per member: constants, SI, by key, scaled to the common gauge.

    Returns
    -------
    dict
        By name of the conclusion or statement: `kind` ("quantity" or "statement"), `title`, `unit`, `known`
        (number of members with a value), `low`, `high`, `median` (None if no member has a value), `robust`,
        and `text`, one sentence; for a quantity also `spread` (as a fraction of the median) and
        `correlations` (rank correlation by constant), for a statement `held` (number of members for which it
        is true) and `source`. The values of a statement are its margins.
    """
    rows: dict[str, dict[str, Any]] = {}
    for name, quantity in QUANTITIES.items():
        values = [row[name] for row in conclusions]
        rows[name] = {
            "kind": "quantity",
            "title": quantity.name,
            "unit": quantity.unit,
            **_quantity(values, constants, quantity.unit in _SCALING),
        }
    for name, statement in STATEMENTS.items():
        rows[name] = {
            "kind": "statement",
            "title": statement.text,
            "unit": statement.unit,
            **_statement(statement, conclusions),
        }
    return rows


def _range(values: Sequence[float]) -> dict[str, Any]:
    return {
        "known": len(values),
        "low": min(values, default=None),
        "high": max(values, default=None),
        "median": median(values) if values else None,
    }


def _quantity(
    values: Sequence[float | None], constants: Sequence[Mapping[str, float]], scaling: bool
) -> dict[str, Any]:
    rows = [i for i, value in enumerate(values) if value is not None]
    known = [value for value in values if value is not None]
    ends = _range(known)
    spread = (ends["high"] - ends["low"]) / abs(ends["median"]) if ends["median"] else None
    close = len(known) == len(values) and spread is not None and spread < ROBUST
    robust = bool(values) and (close or not known)
    correlations = {
        key: correlation
        for key in constants[0]
        if (correlation := rank_correlation([constants[i][key] for i in rows], known)) is not None
    }
    decisive = list(decisive_constants(correlations, len(known)).items())[:3]
    named = ", ".join(f"{key} (rank correlation {value:+.2f})" for key, value in decisive)
    if not known:
        text = "Robust: no member of the family has it."
    elif robust:
        text = f"Robust: within {spread:.1%} over the family."
    else:
        share = f"varies by {spread:.0%} of its median" if spread is not None else "varies"
        deciding = f"most with {named}" if named else "no single constant decides"
        missing = (
            f" and {len(values) - len(known)} members do not have it" if len(known) < len(values) else ""
        )
        text = f"Depends on what the paper did not print: it {share}{missing}; {deciding}."
    if scaling:
        text += " It scales with the print force, which is the same for all members by choice."
    return {**ends, "spread": spread, "robust": robust, "text": text, "correlations": correlations}


def decisive_constants(correlations: Mapping[str, float], count: int) -> dict[str, float]:
    """Return the rank correlations that are significant with a Bonferroni correction, the strongest first.

    Two-sided test with Student's t for a rank correlation over `count` members, each at the level
    `SIGNIFICANT` divided by the number of constants.
    """
    from scipy.stats import t as student

    if count < _FEWEST or not correlations:
        return {}
    bound = float(student.isf(0.5 * SIGNIFICANT / len(correlations), count - 2))
    least = bound / math.sqrt(count - 2 + bound * bound)
    strong = {key: value for key, value in correlations.items() if abs(value) > least}
    return dict(sorted(strong.items(), key=lambda item: -abs(item[1])))


def _statement(statement: Statement, conclusions: Sequence[Values]) -> dict[str, Any]:
    values = []
    for row in conclusions:
        try:
            values.append(statement.margin(row))
        except TypeError:
            # A conclusion in the comparison is None: the statement is not true of this member.
            continue
    held = sum(value > 0.0 for value in values)
    count = len(conclusions)
    robust = count > 0 and (held == count or (held == 0 and len(values) == count))
    share = f"all {held} members" if held == count else f"{held} of {count} members" if held else "no member"
    said = statement.text[:1].upper() + statement.text[1:]
    return {
        **_range(values),
        "robust": robust,
        "text": f"{said}: true of {share}.",
        "held": held,
        "source": statement.source,
    }
