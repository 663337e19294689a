import math

import numpy as np
from tests.errors import refused

from printhammer.printing.dots.judging import FAULTS, Limits, judge
from printhammer.printing.dots.nominal import SinglePulse
from printhammer.run.ensemble import DotTable

SINGLE = SinglePulse(force=20.0, flight_time=300e-6)
US = 1e-6


def dots(*rows: tuple[float, float | None, float | None, int]) -> DotTable:
    """One member: (firing time, flight time or None for a lost dot, force, extra contacts) of each firing."""
    fired_at, flight, force, extra = (np.array([column], dtype=float) for column in zip(*rows, strict=True))
    struck = ~np.isnan(flight)
    blank = np.full(fired_at.shape, np.nan)
    return DotTable(
        np.ones(fired_at.shape, bool), fired_at, struck, flight, blank, force, blank, blank, extra.astype(int)
    )


def faults(table: DotTable, due: list[float], limits: Limits | None = None, **options: object) -> list[str]:
    found = judge(
        table,
        np.ones(table.fired.shape, bool),
        np.array([due]),
        SINGLE,
        Limits() if limits is None else limits,
        **options,
    )
    return ["" if code < 0 else FAULTS[code] for code in found.faults[0]]


def test_each_limit_by_itself() -> None:
    table = dots(
        (0.0, 300e-6, 20.0, 0),
        (1e-3, 300e-6, 22.1, 0),
        (2e-3, 300e-6, 21.9, 0),
        (3e-3, 300e-6, 17.9, 0),
        (4e-3, 351e-6, 20.0, 0),
        (5e-3, 349e-6, 20.0, 0),
        (6e-3, 249e-6, 20.0, 0),
        (7e-3, 300e-6, 20.0, 1),
        (8e-3, math.nan, math.nan, 0),
    )
    due = [k * 1e-3 for k in range(9)]
    expected = ["", "force", "", "force", "arrival", "", "arrival", "extra contacts", "lost"]
    assert faults(table, due) == expected
    wide = Limits(force=0.2, arrival=60e-6, extra_contacts=1)
    assert faults(table, due, wide) == [""] * 8 + ["lost"]


def test_arrival_counts_from_the_slot_not_from_the_firing() -> None:
    # Fired 100 us ahead of its slot and flying 100 us longer, a dot is where it should be.
    assert faults(dots((0.9e-3, 400e-6, 20.0, 0)), [1e-3]) == [""]
    assert faults(dots((0.9e-3, 300e-6, 20.0, 0)), [1e-3]) == ["arrival"]


def test_the_worst_comes_first() -> None:
    assert faults(dots((0.0, 500e-6, 40.0, 3)), [0.0]) == ["extra contacts"]
    assert faults(dots((0.0, 500e-6, 40.0, 0)), [0.0]) == ["force"]


def test_dots_of_a_lead_in_are_not_judged() -> None:
    table = dots((0.0, math.nan, math.nan, 0), (1e-3, 300e-6, 20.0, 0))
    found = judge(table, np.array([[False, True]]), np.array([[0.0, 1e-3]]), SINGLE, Limits())
    assert found.passed.tolist() == [True]
    assert not found.lost.any()
    assert found.good.tolist() == [[False, True]]


def test_a_run_that_stops_does_not_pass() -> None:
    table = dots((0.0, 300e-6, 20.0, 0), (1e-3, 300e-6, 20.0, 0), (2e-3, math.nan, math.nan, 0))
    table.fired[0, 2] = False
    assert faults(table, [0.0, 1e-3, 2e-3], ok=np.array([False])) == ["", "not run", "not run"]


def test_members_may_have_single_pulses_of_their_own() -> None:
    one = dots((0.0, 300e-6, 20.0, 0))
    both = DotTable(*(np.concatenate([part, part]) for part in vars(one).values()))
    found = judge(
        both,
        np.ones((2, 1), bool),
        np.zeros((2, 1)),
        [SINGLE, SinglePulse(force=40.0, flight_time=300e-6)],
        Limits(),
    )
    assert found.passed.tolist() == [True, False]
    np.testing.assert_allclose(found.force_deviation.ravel(), [0.0, -0.5])


def test_arrays_that_do_not_fit_are_refused() -> None:
    table = dots((0.0, 300e-6, 20.0, 0))
    with refused("slot_times"):
        judge(table, np.ones((1, 1), bool), np.zeros((1, 2)), SINGLE, Limits())
