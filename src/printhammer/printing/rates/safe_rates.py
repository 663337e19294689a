"""The safe rates of many hammers at once, on one grid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.printing.dots.slots import LEAD_IN, cycle_with_lead_in, slots_of
from printhammer.printing.dots.strategy import open_loop
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.rates.safe_rate import from_rest

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.limits import Limits
    from printhammer.printing.dots.nominal import SinglePulse
    from printhammer.printing.dots.strategy import Strategy
    from printhammer.support.arrays import FloatArray
    from printhammer.support.threads import Progress

_AT_ONCE: Final = 32


def all_pass(
    cases: Sequence[Case],
    strategy: Strategy = open_loop,
    *,
    limits: Limits,
    tolerance: float,
    threads: int | None = None,
) -> npt.NDArray[np.bool_]:
    """Return whether all patterns from rest, and the cycle, are within limits, for each hammer at a rate.

    Arguments as for `printhammer.printing.dots.trial.attempt`.
    """
    options: dict[str, Any] = {"limits": limits, "tolerance": tolerance, "threads": threads}
    patterns = from_rest(every=strategy is not open_loop)
    cycle = [slots_of(cycle_with_lead_in())]
    found = np.zeros(len(cases), dtype=np.bool_)
    for begin in range(0, len(cases), _AT_ONCE):
        some = cases[begin : begin + _AT_ONCE]
        found[begin : begin + len(some)] = attempt(some, patterns, strategy, **options).passed
    left = np.flatnonzero(found)
    if left.size:
        some = [cases[k] for k in left.tolist()]
        found[left] = attempt(some, cycle, strategy, judged_from=LEAD_IN, **options).passed
    return found


def safe_rates(
    hammers: Sequence[Hammer],
    singles: Sequence[SinglePulse],
    grid: FloatArray,
    strategy: Strategy = open_loop,
    *,
    limits: Limits,
    tolerance: float,
    threads: int | None = None,
    progress: Progress | None = None,
) -> FloatArray:
    """Return the safe rates of some hammers on a grid of ascending rates, Hz; arguments as for `all_pass`.

    Each hammer is judged by its own one of `singles`; `progress` is told the number of hammers whose rate is
    found, and of all.

    Returns
    -------
    array, shape (hammers,)
        NaN where not even the first rate of the grid passes; its last one where all pass.
    """
    found = np.full(len(hammers), np.nan)
    alive = np.arange(len(hammers))
    for rate in grid.tolist():
        cases = [Case(hammers[k], singles[k], rate) for k in alive.tolist()]
        alive = alive[all_pass(cases, strategy, limits=limits, tolerance=tolerance, threads=threads)]
        found[alive] = rate
        if progress is not None:
            progress(len(hammers) - alive.size, len(hammers))
        if not alive.size:
            break
    return found
