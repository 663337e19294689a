"""Effect of the integrators of 1983 on verdicts: for the shipped hammer, its family and random hammers.

The paper judged its figures from computations with steps of 10, 1 and 20 us that do not locate contacts. The
study counts how often such a computation and the exact motion have different verdicts on a panel of Fig. 11.
The random hammers are those of the base rates for which both schemes complete the single-pulse cycle with the
steps of the paper, as they did in the paper. The panels of one hammer are not independent, so the interval of
a fraction is that of the mean over hammers (cluster sampling), plus and minus two standard errors.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.chaos import strobes
from printhammer.chaos.strobe.points import SCHEMES, scheme_strobes
from printhammer.claims import Context, claims, judge
from printhammer.claims.verdicts import changed, printed_verdicts
from printhammer.run.scheme_runs import READINGS, Reading
from studies.reconstruction.family.family import family_hammers
from studies.reconstruction.judging.base_rates import draw
from studies.reconstruction.judging.claims_1983 import judge_as_in_1983
from studies.reconstruction.search.space import hammer_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from concurrent.futures import Executor

    from printhammer.hammer.hammer import Hammer
    from printhammer.run.scheme_runs import Scheme

CHANGE: Final = 1e-5
"""Relative increase of all constants at once, which tests the sensitivity of a verdict; arbitrary."""

Way = tuple["Scheme | None", Reading, bool]
"""Computation of a verdict: scheme (None: exact), reading of the schedule, constants changed or not."""

READING: Final[Reading] = "firings"
"""Reading of the schedule used for both schemes; the other readings use the first scheme only."""

EXACT: Final[Way] = (None, READING, False)
PLAIN: Final[tuple[Way, ...]] = (
    *((SCHEMES[0], reading, False) for reading in READINGS),
    (SCHEMES[1], READING, False),
)
"""Computations whose verdicts are compared with the exact verdicts."""

PAIRS: Final[tuple[tuple[Way, Way], ...]] = (
    (EXACT, (None, READING, True)),
    *((EXACT, way) for way in PLAIN),
    *(((scheme, READING, False), (scheme, READING, True)) for scheme in SCHEMES),
)
"""Pairs of computations whose verdicts are compared."""


def panel_verdicts(hammer: Hammer, way: Way) -> list[str]:
    """Compute the verdicts on the panels of Fig. 11 with the computation `way`."""
    scheme, reading, moved = way
    periods = list(printed_verdicts())
    which = changed(hammer, lambda _: 1, CHANGE) if moved else hammer
    if scheme is None:
        strobed = strobes(which, periods, points=1, threads=1)
    else:
        strobed = scheme_strobes(which, periods, scheme, reading=reading, points=1)
    return ["" if strobe.verdict is None else strobe.verdict.name for strobe in strobed]


def drawn_workable(count: int, seed: int) -> list[dict[str, float]]:
    """Return the constants, SI, of `count` random hammers on which both schemes complete the cycle."""
    claim = claims()["integrator_comparison"]
    chosen: list[dict[str, float]] = []
    tried = 0
    while len(chosen) < count:
        for constants in draw(tried + 2 * count, seed)[tried:]:
            value = judge(Context(hammer_of(constants)), claim).value or {}
            if value.get("trapezoid_completes") and value.get("runge_kutta_completes"):
                chosen.append(constants)
        tried += 2 * count
    return chosen[:count]


def _random(constants: dict[str, float]) -> dict[Way, list[str]]:
    hammer = hammer_of(constants)
    return {way: panel_verdicts(hammer, way) for way in dict.fromkeys(way for pair in PAIRS for way in pair)}


def _comparison(
    first: Way, second: Way, before: Sequence[list[str]], after: Sequence[list[str]]
) -> dict[str, Any]:
    """Count verdicts that change in either direction (periodic, strange); return fraction and error, too."""
    pairs = [list(zip(one, other, strict=True)) for one, other in zip(before, after, strict=True)]
    every = [pair for row in pairs for pair in row]
    each = np.array([np.mean([one != other for one, other in row]) for row in pairs])
    error = 2.0 * float(each.std(ddof=1)) / math.sqrt(len(each)) if len(each) > 1 else math.nan
    to_strange = sum(one.startswith("period") and other == "strange" for one, other in every)
    to_period = sum(one == "strange" and other.startswith("period") for one, other in every)
    return {
        "first": named(first),
        "second": named(second),
        "panels": len(every),
        "differ": sum(one != other for one, other in every),
        "share": float(each.mean()),
        "share_error": None if math.isnan(error) else error,
        "periodic_to_strange": to_strange,
        "strange_to_periodic": to_period,
    }


def named(way: Way) -> str:
    """Describe a computation of verdicts in a short text: scheme, reading, changed constants."""
    scheme, reading, moved = way
    words = "exact" if scheme is None else f"{scheme}, {reading}"
    return f"{words}, constants changed by {CHANGE:g}" if moved else words


def changes(
    count: int,
    seed: int,
    *,
    pool: Executor | None = None,
    tell: Callable[[int, int], None] | None = None,
) -> list[dict[str, Any]]:
    """Compare verdicts on the panels of random hammers; return one row for each of `PAIRS`.

    `tell` is called with the number of hammers done and the total.
    """
    drawn = drawn_workable(count, seed)
    table = []
    for done, row in enumerate(map(_random, drawn) if pool is None else pool.map(_random, drawn), 1):
        table.append(row)
        if tell is not None:
            tell(done, count)
    return [_comparison(a, b, [row[a] for row in table], [row[b] for row in table]) for a, b in PAIRS]


def schemes_json(
    hammer: Hammer,
    count: int,
    seed: int,
    *,
    pool: Executor | None = None,
    tell: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Build the contents of `schemes.json`; see `printhammer.report.reconstruction.results.Schemes`."""
    printed = list(printed_verdicts().values())
    family = {}
    for member in family_hammers():
        exact, computed = (panel_verdicts(member, way) for way in (EXACT, PLAIN[0]))
        family[member.name] = {
            "exact": sum(map(str.__eq__, exact, printed)),
            "computed": sum(map(str.__eq__, computed, printed)),
            "same": sum(map(str.__eq__, exact, computed)),
        }
    return {
        "format": 1,
        "shipped": hammer.fingerprint,
        "panels": {named(way): panel_verdicts(hammer, way) for way in (EXACT, *PLAIN)},
        "claims": {result.claim.name: result.verdict for result in judge_as_in_1983(hammer)},
        "family": family,
        "hammers": count,
        "seed": seed,
        "changes": changes(count, seed, pool=pool, tell=tell),
    }
