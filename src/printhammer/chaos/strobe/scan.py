"""Classification of many trains, with an early test that recognises periodic trains.

Most trains settle within a few firings, so that their period is known long before firing 2000. A train is
periodic as soon as

- its states q firings apart agree a hundred times closer than the classification requires, over a window of
  at least 2 q firings, states fewer firings apart do not agree as closely as the classification requires, and
  the distance of states a divisor of q apart does not shrink; and
- a small perturbation decays: the derivative of the state after q firings with respect to the state before
  them has no eigenvalue beyond 0.99 in absolute value.

A remaining difference d then accumulates to at most d / (1 - 0.99), which is within the tolerance of the
classification. All other trains are followed to firing 2000. Aperiodic trains are strange if the exponent
over three hundred firings on the attractor, from the state at firing 1001 onward, is positive by five
standard errors, more than the classification requires; otherwise the exponent is computed over firings 1001
to 2000.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.chaos.orbits.settled import shown
from printhammer.chaos.strobe.train import States, Train, exponents_of, exponents_onward, run_trains
from printhammer.chaos.strobe.verdict import AGREEMENT, FIRST, LAST, Verdict, period_of, verdict
from printhammer.hammer.hammer import Hammer
from printhammer.run.effort import DEFAULT, Effort, Keywords, computation
from printhammer.run.regime import Regime

STAGES: Final = (32, 128)  # Arbitrary
"""Numbers of firings after which a still unclassified train is tested for a stable periodic motion."""

CLOSER: Final = 1e-2
"""Largest distance of repeated states in the early test, as a fraction of `AGREEMENT`.

The value is 1 - `LARGEST_MULTIPLIER`, so that the remaining difference adds up to at most `AGREEMENT`.
"""

LARGEST_MULTIPLIER: Final = 0.99
"""Largest absolute Floquet multiplier with which the early test accepts a period; arbitrary."""

_SHORT: Final = 301
"""Number of firings over which the first estimate of the exponent is averaged; arbitrary."""
_SURE: Final = 5.0
"""Number of standard errors above which the first estimate of the exponent is decisive; arbitrary."""


@computation
def scan(
    hammer: Hammer,
    periods: npt.ArrayLike,
    *,
    exponents: bool = True,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[Keywords],
) -> list[Verdict]:
    """Classify the motions of trains from rest, one train for each time between firings.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    periods : array
        Times between firings, s.
    exponents : bool, optional
        Whether to compute Lyapunov exponents; without exponents, aperiodic trains are left undecided.

    Returns
    -------
    list of Verdict
        Classification of each train, with the firings on which it is based: 1001 to 2000, or earlier firings
        for trains that settle early.

    Raises
    ------
    InputError
        The hammer has no waveform or no rest state, or a period is not positive.
    """
    times = np.atleast_1d(np.asarray(periods, dtype=np.float64)).tolist()
    regimes = [Regime.of(hammer, period=time) for time in times]
    verdicts: dict[int, Verdict] = {}
    quiet = effort.quiet
    for last in STAGES:
        left = [i for i in range(len(times)) if i not in verdicts]
        trains = [Train.of(regimes[i], last) for i in left]
        window = (last // 2 + 1, last)
        states, _ = run_trains(trains, np.arange(window[0], last + 1), None, quiet)
        settled = _classify_early(trains, states, window, quiet)
        verdicts |= {i: judged for i, judged in zip(left, settled, strict=True) if judged is not None}
        effort.report(len(verdicts), len(times))
    left = [i for i in range(len(times)) if i not in verdicts]
    trains = [Train.of(regimes[i], LAST) for i in left]
    verdicts |= dict(zip(left, _classify_late(trains, exponents, quiet), strict=True))
    effort.report(len(verdicts), len(times))
    return [verdicts[i] for i in range(len(times))]


def _classify_early(
    trains: Sequence[Train], states: Sequence[States], firings: tuple[int, int], effort: Effort
) -> list[Verdict | None]:
    """Classify the trains that have settled early to a stable periodic motion; None for all other trains.

    `firings` are the first and the last firing at which the `states` were recorded.
    """
    distances = [own.distances(train) for own, train in zip(states, trains, strict=True)]
    periods: dict[int, int] = {}
    for i, row in enumerate(distances):
        period = period_of(row)
        close = period is not None and states[i].status == "ok" and row[period - 1] <= CLOSER * AGREEMENT
        if period is not None and close and shown(states[i].scaled(trains[i])[np.newaxis], period)[0]:
            periods[i] = period
    candidates = list(periods)
    largest = effort.mapped(
        lambda i: largest_multiplier(trains[i], states[i], periods[i], effort.tolerance), candidates
    )
    stable = {i for i, size in zip(candidates, largest, strict=True) if size <= LARGEST_MULTIPLIER}
    return [
        verdict(distances[i], firings, effort.tolerance, None) if i in stable else None
        for i in range(len(trains))
    ]


def largest_multiplier(train: Train, states: States, period: int, tolerance: float) -> float:
    """Compute the largest absolute Floquet multiplier of a motion that repeats after `period` firings.

    The multipliers are the eigenvalues of the derivative of the state after the period with respect to the
    state at its start, the last of `states`. The result is infinite if the period begins inside the pack,
    where the state has a memory, if the state includes the current of a shorted turn or the voltage of a
    capacitor, or if the derivative is unknown.
    """
    from printhammer.derivatives.states import tangent_map

    if _in_pack(train, states, -1) or not train.regime.is_planar:
        return np.inf
    # The tails of earlier pulses are omitted: they are the same for all neighbouring motions.
    tangent = tangent_map(
        train.hammer,
        train.regime.pulses(period),
        0.0,
        period * train.period,
        state=_state(states, -1),
        tolerance=tolerance,
    )
    size = 2 if states.current is None else 3
    if not tangent.ok or not tangent.smooth or tangent.matrix.shape != (size, size):
        return np.inf
    return float(np.abs(np.linalg.eigvals(tangent.matrix)).max())


def _classify_late(trains: Sequence[Train], exponents: bool, effort: Effort) -> list[Verdict]:
    """Classify the trains that the early test left undecided, from their states at firings 1001 to 2000."""
    judged, tolerance = (FIRST, LAST), effort.tolerance
    states, _ = run_trains(trains, np.arange(FIRST, LAST + 1), None, effort)
    distances = [own.distances(train) for own, train in zip(states, trains, strict=True)]
    stopped = ["" if own.status == "ok" else own.status for own in states]
    ends_at = effort.mapped(
        lambda i: None if stopped[i] else states[i].settled(trains[i], distances[i]), range(len(trains))
    )
    verdicts = {
        i: verdict(row, judged, tolerance, None, why, ends_at[i])
        for i, (row, why) in enumerate(zip(distances, stopped, strict=True))
        if why or not exponents or period_of(row) is not None
    }
    left = [i for i in range(len(trains)) if i not in verdicts]
    # The initial state carries no pack memory: a train inside the pack gets its exponent from rest.
    on_it = [i for i in left if not _in_pack(trains[i], states[i], 0)]
    begun = [(trains[i].regime, _state(states[i], 0)) for i in on_it]
    for i, exponent in zip(on_it, exponents_onward(begun, _SHORT, effort), strict=True):
        if exponent.smooth and exponent.value > _SURE * exponent.standard_error:
            verdicts[i] = verdict(distances[i], judged, tolerance, exponent)
    left = [i for i in left if i not in verdicts]
    for i, exponent in zip(left, exponents_of([trains[i] for i in left], judged, effort), strict=True):
        verdicts[i] = verdict(distances[i], judged, tolerance, exponent)
    return [verdicts[i] for i in range(len(trains))]


def _in_pack(train: Train, states: States, row: int) -> bool:
    return train.hammer.front is not None and bool(states.x[row] > train.hammer.front)


def _state(states: States, row: int) -> tuple[float, ...]:
    current = () if states.current is None else (float(states.current[row]),)
    return float(states.x[row]), float(states.v[row]), *current
