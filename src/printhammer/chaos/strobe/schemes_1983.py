"""Strobe points and verdicts as the two integrators of the paper compute them, on its schedule of steps.

The panels of Fig. 11 were judged by eye from such points. Fixed steps that locate no contact are not the
motion: they add errors of their own to it, at every touch, and these make a map of their own, which jumps
where a step just reaches a contact or just does not. It has no tangent, so that no exponent backs a verdict:
here a train is strange if no period up to 64 is found, which is what a reader of such a plot has to say.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.chaos.strobe.points import POINTS, Strobe, strobe_of
from printhammer.chaos.strobe.train import States, Train
from printhammer.chaos.strobe.verdict import FIRST, LAST, Verdict, verdict
from printhammer.errors import InputError
from printhammer.run.problem import TOLERANCE
from printhammer.run.regime import regimes_of
from printhammer.run.scheme_runs import READINGS, Reading, Scheme, SchemeProblem
from printhammer.run.start import initial_state

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.hammer.hammer import Hammer
    from printhammer.support.threads import Progress

SCHEMES: Final[tuple[Scheme, ...]] = ("runge-kutta-4", "trapezoid")


def scheme_strobes(
    hammers: Hammer | Sequence[Hammer],
    periods: Sequence[float | str],
    scheme: Scheme,
    *,
    reading: Reading = "firings",
    points: int = POINTS,
    firings: tuple[int, int] = (FIRST, LAST),
    progress: Progress | None = None,
) -> list[Strobe]:
    """Return the strobe points of trains from rest, as a scheme of 1983 computes them.

    Parameters
    ----------
    hammers, periods
        Hammers and the times between their firings, see `printhammer.run.regime.regimes_of`.
    scheme : str
        "runge-kutta-4" or "trapezoid".
    reading : str, optional
        When the short step is taken, see `printhammer.run.scheme_runs.READINGS`.
    points, firings, progress
        As for `printhammer.chaos.strobes`; the points are those from the first firing on.

    Returns
    -------
    list of Strobe
        One for each train, with its verdict: a period, "strange" where no period up to 64 is found, or
        "undecided" where the scheme failed on the way.

    Raises
    ------
    InputError
        The scheme or the reading is not known, or a hammer has no rest state or waveform.
    """
    if scheme not in SCHEMES or reading not in READINGS:
        known = f"{' or '.join(SCHEMES)}, and {', '.join(READINGS)}"
        raise InputError(f"scheme = {scheme!r} with reading = {reading!r}, expected {known}")
    regimes = regimes_of(hammers, periods)
    strobed = []
    for done, regime in enumerate(regimes, 1):
        train = Train.of(regime, max(points, firings[1]))
        count = max(points, firings[1])
        moments = train.times(np.arange(1, count + 1))
        problem = SchemeProblem(
            train.hammer, train.drive, initial_state(train.hammer, None), TOLERANCE, scheme, reading=reading
        )
        states = States(*problem.strobed(moments))
        chosen = np.arange(1, points + 1)
        shown = _part(states, slice(0, points))
        strobed.append(strobe_of(train, chosen, shown, TOLERANCE, _judged(states, train, firings)))
        if progress is not None:
            progress(done, len(regimes))
    return strobed


def _part(states: States, some: slice) -> States:
    names = ("t", "x", "v", "branch", "memory")
    return replace(states, **{name: getattr(states, name)[some] for name in names})


def _judged(states: States, train: Train, firings: tuple[int, int]) -> Verdict:
    first, last = firings
    judged = _part(states, slice(first - 1, last))
    stopped = states.status if np.isnan(states.x[last - 1]) else ""
    result = verdict(judged.distances(train), firings, TOLERANCE, None, stopped)
    if result.period is None and not stopped:
        return replace(result, name="strange", reason="")
    return result
