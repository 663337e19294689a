"""Tests of the base rates: how often claims hold for random hammers."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from studies.reconstruction.judging import base_rates as module
from studies.reconstruction.judging.base_rates import MASSES, STROKE, base_rates, draw
from studies.reconstruction.judging.judged import FIGURE_11, SLOW
from studies.reconstruction.search.space import VARIABLES, hammer_of, values_of

from printhammer.claims import Context, claims, judge
from printhammer.claims.verdicts import printed_verdicts
from printhammer.report.reconstruction.results import BaseRates

PANELS = [f"{period * 1e3:.2f} ms" for period in printed_verdicts()]


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, tuple[str, ...], bool]]:
    """Replace the claims by a verdict that depends on the mass; return the list of recorded calls."""
    asked: list[tuple[float, tuple[str, ...], bool]] = []

    def row_of(constants: dict[str, float], names: list[str], *, panels: bool = True) -> dict[str, Any]:
        asked.append((constants["mass"], tuple(names), panels))
        holds = round(constants["mass"] * 1e9) % 2 == 0
        row: dict[str, Any] = {"verdicts": dict.fromkeys(names, holds), "panels": None}
        if panels:
            row["verdicts"][FIGURE_11] = False
            row["panel_verdicts"] = dict.fromkeys(PANELS, "strange" if holds else "period-1")
        return row

    monkeypatch.setattr(module, "row_of", row_of)
    monkeypatch.setattr(module, "draw", drawn_at_no_cost)
    return asked


def drawn_at_no_cost(count: int, seed: int) -> list[dict[str, float]]:
    return [{"mass": float(mass)} for mass in np.random.default_rng(seed).uniform(1e-4, 1e-3, count)]


def test_random_hammers_print_the_stroke_and_are_those_of_the_seed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "_BATCH", 8)
    drawn = draw(3, 5)
    # A larger sample begins with the hammers of a smaller sample.
    assert draw(2, 5) == drawn[:2]
    assert draw(1, 6) != drawn[:1]
    for constants in drawn:
        for variable in VARIABLES:
            value = values_of(constants)[variable.name]
            assert variable.low * (1 - 1e-9) <= value <= variable.high * (1 + 1e-9)
        value = judge(Context(hammer_of(constants)), claims()[STROKE]).value
        assert value is not None
        low, high = claims()[STROKE].band["max_displacement_m"]
        assert low <= value["max_displacement_m"] <= high


def test_every_claim_is_counted_for_every_hammer(judged: list[tuple[float, tuple[str, ...], bool]]) -> None:
    told: list[tuple[int, int]] = []
    table = base_rates(6, 2, slow=4, tell=lambda done, of: told.append((done, of)))
    # The table has the format of the shipped file.
    BaseRates.model_validate(table)
    assert set(table["claims"]) == set(claims())
    for name, entry in table["claims"].items():
        assert entry["measured"] == (4 if name in SLOW else 6)
    drawn = drawn_at_no_cost(6, 2)
    holds = [round(constants["mass"] * 1e9) % 2 == 0 for constants in drawn]
    for name, entry in table["claims"].items():
        if name not in (STROKE, FIGURE_11):
            assert entry["holds"] == sum(holds[: entry["measured"]])
    assert table["claims"][FIGURE_11]["holds"] == 0
    for name, verdict in zip(PANELS, printed_verdicts().values(), strict=True):
        right = {"strange": sum(holds), "period-1": 6 - sum(holds)}.get(verdict, 0)
        assert table["poincare_panels"][name] == {"measured": 6, "as_printed": right}
    assert told == [(done, 6) for done in range(1, 7)]
    assert table["hammers"] == 6
    assert table["seed"] == 2
    assert judged


def test_the_stroke_is_judged_with_a_random_mass(
    judged: list[tuple[float, tuple[str, ...], bool]],
) -> None:
    base_rates(6, 2)
    strokes = [mass for mass, names, panels in judged if names == (STROKE,) and not panels]
    others = [(mass, names) for mass, names, panels in judged if panels]
    assert [mass for mass, _ in others] == [constants["mass"] for constants in drawn_at_no_cost(6, 2)]
    assert all(STROKE not in names and FIGURE_11 not in names for _, names in others)
    assert all(set(SLOW) <= set(names) for _, names in others)
    # The masses are log-uniform over the range, independent of the hammer's mass.
    assert all(MASSES[0] <= mass <= MASSES[1] for mass in strokes)
    assert len(set(strokes)) == 6
    many = np.random.default_rng([2, 1]).random(6)
    np.testing.assert_allclose(strokes, MASSES[0] * (MASSES[1] / MASSES[0]) ** many, rtol=1e-12)


def test_the_same_for_any_number_of_processes(judged: list[tuple[float, tuple[str, ...], bool]]) -> None:
    alone = base_rates(5, 7, slow=2)
    with ThreadPoolExecutor(3) as pool:
        assert base_rates(5, 7, slow=2, pool=pool) == alone
    assert judged


def test_the_space_is_told(judged: list[tuple[float, tuple[str, ...], bool]]) -> None:
    space = base_rates(1, 1, slow=0)["space"]
    for variable in VARIABLES:
        (found,) = [ends for name, ends in space.items() if name.startswith(f"{variable.name}: ")]
        assert found == [variable.low, variable.high, variable.unit]
    assert [ends for name, ends in space.items() if name.startswith("mass: ")] == [[*MASSES, "kg"]]
    assert judged


@pytest.mark.slow
def test_a_random_hammer_judged() -> None:
    table = base_rates(1, 1, slow=0)
    BaseRates.model_validate(table)
    for name, entry in table["claims"].items():
        assert 0 <= entry["holds"] <= entry["measured"]
        assert entry["measured"] == (0 if name in SLOW else 1)
    # Every hammer of the search space has the geometry and the print force of the paper.
    assert table["claims"]["geometry"]["holds"] == 1
    assert table["claims"]["print_force"]["holds"] == 1
