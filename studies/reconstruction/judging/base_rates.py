"""Base rates: how often each claim holds by chance for random hammers of the search space.

Counted are only hammers that rest at the backstop, print with one pulse and return to rest.

A randomly drawn hammer does not have the printed stroke. The claim about the stroke is therefore judged with
a random mass; then the mass is set such that the stroke is as printed, and the other claims are judged.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.claims import claims
from printhammer.claims.context import CYCLE
from printhammer.claims.verdicts import panel_name, printed_verdicts
from printhammer.drive.trains import PulseTrain
from studies.reconstruction.judging.judged import FIGURE_11, SLOW, row_of
from studies.reconstruction.search.candidates import candidates
from studies.reconstruction.search.losses import run_all
from studies.reconstruction.search.space import VARIABLES

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Executor


STROKE: Final = "single_pulse_stroke"
MASSES: Final = (0.05e-3, 2e-3)
"""Smallest and largest random mass, kg."""

_BATCH: Final = 64
_NEAR: Final = 1e-6


def draw(count: int, seed: int) -> list[dict[str, float]]:
    """Draw the constants, SI, of `count` random hammers with the printed stroke."""
    rng = np.random.default_rng([seed, 0])
    drawn: list[dict[str, float]] = []
    while len(drawn) < count:
        points = [rng.random(len(VARIABLES)) for _ in range(_BATCH)]
        printing = [candidate for candidate in candidates(points) if candidate is not None]
        drives = [PulseTrain(candidate.waveform) for candidate in printing]
        ends = [CYCLE] * len(printing)
        table = run_all(printing, drives, ends, 1, strobes=[np.array([end]) for end in ends]).strobes
        assert table is not None
        # Select hammers that return to the rest position within one cycle of a single pulse.
        for candidate, x in zip(printing, table.x[:, 0].tolist(), strict=True):
            if abs(x - candidate.rest) < _NEAR:
                drawn.append(candidate.constants)
    return drawn[:count]


def _judged(task: tuple[dict[str, float], float, bool]) -> dict[str, Any]:
    constants, mass, slow = task
    quick = [name for name in claims() if name not in (*SLOW, STROKE, FIGURE_11)]
    row = row_of(constants, [*quick, *(SLOW if slow else ())])
    heavy = {**constants, "mass": mass}
    row["verdicts"][STROKE] = row_of(heavy, [STROKE], panels=False)["verdicts"][STROKE]
    return row


def base_rates(
    count: int,
    seed: int,
    *,
    slow: int | None = None,
    pool: Executor | None = None,
    tell: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Count the random hammers for which each claim holds; return the contents of `base_rates.json`.

    Slow claims are judged for the first `slow` hammers only (None: all). `tell` is called with the number of
    hammers done and the total.
    """
    drawn = draw(count, seed)
    rng = np.random.default_rng([seed, 1])
    low, high = np.log(MASSES)
    masses = np.exp(low + (high - low) * rng.random(count))
    most = count if slow is None else slow
    tasks = [(constants, float(masses[i]), i < most) for i, constants in enumerate(drawn)]
    counts = {name: {"measured": 0, "holds": 0} for name in claims()}
    panels: dict[str, dict[str, int]] = {}
    source = map(_judged, tasks) if pool is None else pool.map(_judged, tasks)
    printed = {panel_name(period): verdict for period, verdict in printed_verdicts().items()}
    for done, row in enumerate(source, 1):
        for name, holds in row["verdicts"].items():
            counts[name]["measured"] += 1
            counts[name]["holds"] += bool(holds)
        for name, verdict in row["panel_verdicts"].items():
            panel = panels.setdefault(name, {"measured": 0, "as_printed": 0})
            panel["measured"] += 1
            panel["as_printed"] += verdict == printed[name]
        if tell is not None:
            tell(done, count)
    return {
        "format": 1,
        "hammers": count,
        "seed": seed,
        "space": {f"{v.name}: {v.meaning}": [v.low, v.high, v.unit] for v in VARIABLES}
        | {"mass: for the claim about the stroke alone": [*MASSES, "kg"]},
        "claims": counts,
        "poincare_panels": panels,
    }
