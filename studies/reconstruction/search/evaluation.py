"""Evaluation of points: the stages of the losses in sequence, in parallel processes."""

from __future__ import annotations

import ast
import hashlib
from functools import cache
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

from printhammer.kernel.compile.bindings import syntax_text
from studies.reconstruction.search.buzz_losses import buzz
from studies.reconstruction.search.candidates import candidates
from studies.reconstruction.search.cloud_losses import clouds
from studies.reconstruction.search.losses import Score, hung, pairs, single_pulse, statics
from studies.reconstruction.search.map_losses import region, sensitivity
from studies.reconstruction.search.panel_losses import panels

if TYPE_CHECKING:
    from collections.abc import Sequence
    from concurrent.futures import Executor

    from printhammer.support.arrays import FloatArray
    from studies.reconstruction.search.candidates import Candidate
    from studies.reconstruction.search.space import Shape

Aim = Literal["stated", "all", "panels", "buzz", "claims"]
"""Name of the set of claims that guide a search.

"stated": claims of kind "stated". "all": also claims of kind "shape". "panels": also each panel of Fig. 11,
with the weight of a claim. "buzz": also buzz printing, with a large weight. "claims": also the appearance of
Figs. 8, 9 and 11.
"""

AIMS: Final[tuple[Aim, ...]] = get_args(Aim)

STATED: Final = {
    "return_from_everywhere": 4.0,
    "single_pulse_stroke": 2.0,
    "two_pulses_660us": 6.0,
    "two_pulses_700us": 15.0,
    "second_dot_lost": 6.0,
    "integrator_comparison": 4.0,
    "poincare": 4.0,
}
SHAPE: Final = {
    "release_margin": 1.0,
    "settle_out": 1.0,
    "low_restitution": 1.0,
    "backstop_force_dominates": 1.0,
    "poincare_window": 1.0,
    "hang_up_at_high_rate": 0.5,
    "weak_prints_when_hung_up": 1.0,
}
_FIRMER: Final = {name: 1.5 * weight for name, weight in SHAPE.items()}
WEIGHTS: Final[dict[str, dict[str, float]]] = {
    "stated": STATED,
    "all": {**STATED, **SHAPE},
    "panels": {**STATED, **_FIRMER, "poincare": 9.0},
    "buzz": {**STATED, **_FIRMER, "poincare": 6.0, "buzz_printing": 8.0},
    "claims": {
        **STATED,
        **_FIRMER,
        "poincare": 18.0,
        "buzz_printing": 3.0,
        "successive_points_apart": 1.5,
        "map_sensitivity": 1.5,
        "chaotic_region": 4.0,
        "behind_the_backstop": 2.0,
        "clouds": 4.0,
    },
}
"""Weights of the losses, by aim and claim; arbitrary.

The stated claims outside Fig. 11 have the largest weights, since all other claims depend on them. A claim of
kind "shape" has the weight of three panels of Fig. 11, or of two for the aim "panels". Buzz printing has the
weight of the two claims about it.
"""

STEPS: Final[dict[Aim, float]] = {"stated": 0.0, "all": 0.0, "panels": 0.0, "buzz": 0.0, "claims": 0.3}
"""Loss of a claim that barely fails, as a fraction of its weight, by aim.

With a positive value, one claim that holds is worth more than two claims that nearly hold.
"""

PIECE: Final = 64
"""Number of points that one process evaluates together; arbitrary."""

_WORST_SINGLE: Final = 1.6
_WORST_PAIRS: Final = 3.0
_WORST_BUZZ: Final = 4.0
_FEWEST_PANELS: Final = 5
"""Number of correct panels of Fig. 11 from which the losses of the map are computed."""


@cache
def losses_digest() -> str:
    """Return a digest of the code that computes the losses; logs of searches with other losses do not mix.

    Docstrings, comments and layout do not affect the digest.
    """
    names = (
        "space",
        "candidates",
        "losses",
        "buzz_losses",
        "panel_losses",
        "map_losses",
        "cloud_losses",
        "evaluation",
    )
    modules = (Path(__file__).with_name(f"{name}.py").read_text("utf-8") for name in names)
    code = "\n".join(syntax_text(ast.parse(module)) for module in modules)
    return hashlib.sha256(code.encode()).hexdigest()[:16]


def evaluate(
    points: Sequence[FloatArray], aim: Aim, shape: Shape = "rectangle"
) -> list[tuple[Candidate | None, Score]]:
    """Score points, as fractions of the ranges of the variables, by the claims of an aim, in this thread."""
    weights = WEIGHTS[aim]
    found = candidates(points, shape)
    scores = [Score() for _ in points]
    chosen = [i for i, candidate in enumerate(found) if candidate is not None]

    def look(stage: Any) -> None:
        stage([found[i] for i in chosen], [scores[i] for i in chosen])

    def keep(limit: float, names: Sequence[str]) -> list[int]:
        return [
            i
            for i in chosen
            if sum(weights.get(name, 0.0) * scores[i].losses.get(name, 1.0) for name in names) < limit
        ]

    for i in chosen:
        candidate = found[i]
        assert candidate is not None
        statics(candidate, scores[i])
    look(single_pulse)
    chosen = keep(
        _WORST_SINGLE,
        [
            "return_from_everywhere",
            "single_pulse_stroke",
            "integrator_comparison",
            "release_margin",
        ],
    )
    look(pairs)
    chosen = keep(_WORST_PAIRS, ["two_pulses_660us", "two_pulses_700us", "second_dot_lost"])
    if "buzz_printing" in weights:
        look(buzz)
        chosen = keep(_WORST_BUZZ, ["buzz_printing"])
    look(panels)
    if aim != "stated":
        look(hung)
    if "map_sensitivity" in weights:
        chosen = [i for i in chosen if scores[i].measured["panels"] >= _FEWEST_PANELS]
        for stage in (sensitivity, region, clouds):
            look(stage)
    return list(zip(found, scores, strict=True))


def rows(points: Sequence[FloatArray], aim: Aim, shape: Shape = "rectangle") -> list[dict[str, Any]]:
    """Score points; return one row of the log per point."""
    found = []
    for point, (candidate, score) in zip(points, evaluate(points, aim, shape), strict=True):
        found.append(
            {
                "point": [float(share) for share in point],
                "total": score.total(WEIGHTS[aim], STEPS[aim]),
                "losses": {name: round(loss, 6) for name, loss in score.losses.items()},
                "measured": score.measured,
                "constants": None if candidate is None else candidate.constants,
            }
        )
    return found


def scored(
    points: Sequence[FloatArray], aim: Aim, pool: Executor | None, shape: Shape = "rectangle"
) -> list[dict[str, Any]]:
    """Score points; return rows of the log in the order of the points, for any number of processes."""
    pieces = [points[start : start + PIECE] for start in range(0, len(points), PIECE)]
    pieced = map if pool is None else pool.map
    return [row for piece in pieced(rows, pieces, repeat(aim), repeat(shape)) for row in piece]
