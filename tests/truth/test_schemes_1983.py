"""Strobe points of the schemes of 1983 against a second, independent program."""

import itertools

import numpy as np
import pytest
from tests.errors import refused
from tests.truth.plain_schemes import constants_of, strobed

import printhammer as ph
from printhammer.chaos.strobe.points import SCHEMES, scheme_strobes
from printhammer.chaos.strobe.verdict import repeats
from printhammer.hammer.equilibrium import rest_state
from printhammer.run.scheme_runs import READINGS, Reading, Scheme

CLOSE = 1e-9
"""Difference, in half-widths of the window, of what two programs of one scheme compute."""


def plain(
    hammer: ph.Hammer, period: float, firings: int, scheme: str, reading: str = "look-ahead"
) -> np.ndarray:
    return np.array(strobed(constants_of(hammer), rest_state(hammer), period, firings, scheme, reading))


# With a long first step into the backstop the implicit rule has several solutions, so that it is left out.
@pytest.mark.parametrize(
    ("scheme", "reading"),
    [each for each in itertools.product(SCHEMES, READINGS) if each != ("trapezoid", "inside")],
)
def test_the_first_firings(hammer: ph.Hammer, scheme: Scheme, reading: Reading) -> None:
    firings = 12
    for period in (1.3e-3, 0.8e-3):
        (mine,) = scheme_strobes(hammer, [period], scheme, reading=reading, points=firings, firings=(1, 12))
        scales = np.array(mine.window.half_widths)
        apart = (np.column_stack([mine.x, mine.v]) - plain(hammer, period, firings, scheme, reading)) / scales
        # Both schemes jump where a step just reaches a contact, so that rounding grows from there.
        assert np.abs(apart[:4]).max() < CLOSE
        assert np.median(np.abs(apart)) < 1e-6
        assert mine.status == "ok"


@pytest.mark.slow
@pytest.mark.parametrize(("period", "scheme"), [(0.8e-3, "runge-kutta-4"), (1.0e-3, "trapezoid")])
def test_the_verdict_on_a_panel_that_locks_at_once(period: float, scheme: Scheme) -> None:
    hammer, firings = ph.load("hendriks-1983-1"), (101, 200)
    (mine,) = scheme_strobes(hammer, [period], scheme, points=200, firings=firings)
    states = plain(hammer, period, firings[1], scheme, "firings")[firings[0] - 1 :]
    assert mine.verdict is not None
    assert mine.verdict.period is not None
    width, speed = mine.window.half_widths
    padded = np.column_stack([states, np.zeros(len(states))])
    apart = repeats(padded, np.zeros(len(states), np.int64), np.array([width, speed, width]))
    assert int(np.flatnonzero(apart < 1e-6)[0]) + 1 == mine.verdict.period
    late = np.column_stack([mine.x, mine.v])[firings[0] - 1 :]
    # A cycle of the same points, from whichever of them.
    nearest = np.abs((late[:, np.newaxis] - states) / [width, speed]).max(axis=2).min(axis=1)
    assert nearest.max() < 1e-5


def test_a_scheme_that_is_not_known_is_named(hammer: ph.Hammer) -> None:
    with refused("scheme"):
        scheme_strobes(hammer, [1e-3], "euler")  # type: ignore[arg-type]
