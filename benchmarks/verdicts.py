"""Reliability of periodic verdicts: random trains of random hammers, classified and then continued.

    python benchmarks/verdicts.py [--trains N] [--further N] [--seed N]

Every constant of `hendriks-1983` is log-uniform within 20 %, the period uniform from 0.7 to 1.6 ms. A train
is classified as by `printhammer.bifurcation`, from its first 300 firings, fewer than for any other verdict. A
period q is correct if Newton's method finds a stable orbit of q firings, and no fewer, near the last state,
and if the states still repeat after q firings, and no fewer, after `--further` more firings. If the armature
is in the pack at the section, the state has a memory, and Newton's method is not applied.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from dataclasses import replace

import numpy as np

import printhammer as ph
from printhammer.chaos import orbit
from printhammer.chaos.bifurcation.columns import (
    FROM_REST,
    OK,
    Columns,
    confirm,
    cycles_of,
    run_columns,
    scales_of_columns,
)
from printhammer.chaos.strobe.map import IN_PACK
from printhammer.run.effort import Effort
from printhammer.run.regime import Regime

FIRINGS, TRANSIENT, TOLERANCE, TIGHT = 300, 100, 1e-9, 1e-11
POINTS = 256
PIECE = 256
"""Number of trains that are simulated together; arbitrary."""


def main() -> None:
    """Classify random trains, check the periodic verdicts, and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--trains", type=int, default=200)
    parser.add_argument("--further", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1983)
    options = parser.parse_args()
    counts: Counter[str] = Counter()
    for begin in range(0, options.trains, PIECE):
        rng = np.random.default_rng([options.seed, begin])
        regimes = [drawn(rng) for _ in range(min(PIECE, options.trains - begin))]
        for line in judged(regimes, options.further, counts):
            print(line, flush=True)
        print(", ".join(f"{counts[name]} {name}" for name in sorted(counts)), flush=True)


def drawn(rng: np.random.Generator) -> Regime:
    """Draw a random train of a random hammer; draws without a rest state are repeated."""
    shipped = ph.load("hendriks-1983")
    while True:
        try:
            hammer = shipped.replace(
                {
                    key: replace(constant, value=constant.value * 1.2 ** rng.uniform(-1.0, 1.0))
                    for key, constant in shipped.constants.items()
                }
            )
            ph.rest_state(hammer)
            return Regime.of(hammer, period=float(rng.uniform(0.7e-3, 1.6e-3)))
        except ph.InputError:
            continue


def judged(regimes: list[Regime], further: int, counts: Counter[str]) -> list[str]:
    """Classify trains and check the verdicts; return a line of text for each wrong verdict."""
    begun = np.tile(np.array(FROM_REST), (len(regimes), 1))
    columns = run_columns(regimes, begun, FIRINGS, TRANSIENT, Effort(TOLERANCE))
    plain, cycles = cycles_of_all(columns, regimes)
    periodic = np.flatnonzero(cycles)
    ended = int((columns.status != OK).sum())
    counts["trains"] += len(regimes)
    counts["whose run ended early"] += ended
    counts["undecided or strange"] += len(regimes) - len(periodic) - ended
    counts["of these repeat, but not shown to have a period"] += int(((plain > 0) & (cycles == 0)).sum())
    counts["named otherwise than by agreement alone"] += int(((plain != cycles) & (cycles > 0)).sum())
    some = [regimes[row] for row in periodic]
    later = run_columns(some, columns.last[periodic], further + POINTS, further, Effort(TIGHT))
    after, _ = cycles_of_all(later, some)
    lines = []
    for place, row in enumerate(periodic):
        q = int(cycles[row])
        closed = orbit(regimes[row], (columns.x[row, -1], columns.v[row, -1]), firings=q)
        newton = closed.ok and closed.stable and closed.firings == q
        kept = bool(after[place] == q)
        if not closed.ok and closed.status == IN_PACK:
            counts["periodic, in the pack at the section"] += 1
            newton = True
        counts["periodic"] += 1
        counts["periodic and wrong"] += not (newton and kept)
        if not (newton and kept):
            said = f"{closed.name}, {abs(closed.multipliers[0]):.6f}" if closed.ok else closed.status
            lines.append(f"period {regimes[row].period!r} s: {q}; Newton {said}; later {after[place]}")
    return lines


def cycles_of_all(columns: Columns, regimes: list[Regime]) -> tuple[np.ndarray, np.ndarray]:
    """Return the periods found from agreement of states alone, and the confirmed periods; 0 for none."""
    fronts = np.array([math.inf if r.hammer.front is None else r.hammer.front for r in regimes])
    scales = scales_of_columns(regimes)
    plain, distances = cycles_of(columns, fronts, scales)
    cycles = plain.copy()
    confirm(columns, cycles, distances, regimes, scales, Effort())
    return plain, cycles


if __name__ == "__main__":
    main()
