"""Lyapunov exponents of trains: agreement with other methods, standard errors, files."""

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import Lyapunov, LyapunovChart, lyapunovs, strobes
from printhammer.chaos.exponents.lyapunov import cycle_of, kaplan_yorke, whole_cycles
from printhammer.claims.verdicts import printed_verdicts
from printhammer.derivatives.states import standard_error, strobe_exponent

FEW = {"firings": 120, "transient": 100}
ROWS = ("exponents", "standard_errors", "total", "total_error", "dimension", "dimension_error", "k")


@pytest.fixture(scope="module")
def found(hammer: "ph.Hammer") -> Lyapunov:
    return ph.lyapunov(hammer, period="1.05 ms", **FEW)


def test_it_is_the_exponent_of_the_tangent_flow(hammer: "ph.Hammer", found: Lyapunov) -> None:
    exponent = strobe_exponent(hammer, hammer.waveform, found.period, first=101, last=221)
    np.testing.assert_array_equal(found.factors, np.column_stack([exponent.factors, exponent.second_factors]))
    assert found.factors.shape == (120, 2)
    if found.cycle == 1:
        assert found.exponents.tolist() == [exponent.value, exponent.second]
        assert found.standard_errors[0] == exponent.standard_error
        assert found.standard_errors[1] == standard_error(exponent.second_factors)
    assert found.total == pytest.approx(found.exponents.sum(), rel=1e-14)
    np.testing.assert_allclose(found.per_second, found.exponents / 1.05e-3, rtol=1e-14)


def test_its_points_are_states_of_the_train(hammer: "ph.Hammer", found: Lyapunov) -> None:
    assert found.points.firing.tolist() == list(range(101, 222))
    np.testing.assert_allclose(found.points.t, 1.05e-3 * np.arange(100, 221), rtol=1e-14)
    # Early ones, since neighbouring motions may part.
    early = ph.lyapunov(hammer, period="1.05 ms", firings=8, transient=0).points
    (same,) = strobes(hammer, ["1.05 ms"], points=9, verdict=False)
    for name, scale in (("x", 1e-4), ("v", 1.0), ("memory", 1e-4)):
        np.testing.assert_allclose(getattr(early, name), getattr(same, name), atol=1e-6 * scale)
    np.testing.assert_array_equal(early.branch, same.branch)


def test_running_estimates_end_at_the_whole(found: Lyapunov) -> None:
    counts, means, errors = found.running()
    assert counts[-1] == 120 - 120 % found.cycle
    assert (np.diff(counts) > 0).all()
    np.testing.assert_allclose(means[-1], found.exponents, rtol=1e-12)
    np.testing.assert_allclose(errors[-1], found.standard_errors, rtol=1e-12)
    counts, means, _errors = found.running([40, 80])
    # Whole cycles, the last of them at the end of the train.
    begin = 120 % found.cycle
    for count, mean in zip(counts, means, strict=True):
        np.testing.assert_allclose(mean, found.factors[begin : begin + count].mean(axis=0), rtol=1e-12)
    for wrong in ([0], [121], [math.nan]):
        with refused("counts"):
            found.running(wrong)


def test_a_cycle_does_not_count_as_scatter() -> None:
    factors = np.tile([[1.0, -9.0], [-2.0, -6.0], [0.5, -7.0]], (40, 1))
    assert cycle_of(3, 120) == 3
    assert cycle_of(3, 20) == cycle_of(None, 120) == 1
    whole = whole_cycles(np.concatenate([[[5.0, 5.0]], factors]), 3)
    np.testing.assert_allclose(whole, np.tile([-0.5 / 3.0, -22.0 / 3.0], (40, 1)))
    assert standard_error(whole[:, 0]) < 1e-15


@pytest.mark.parametrize(
    ("exponents", "scatter", "dimension"),
    [
        ((-1.0, -2.0), 0.0, 0.0),
        ((1.0, -4.0), 0.0, 1.25),
        ((1.0, -0.5), 0.0, 2.0),
        ((1.0, -math.inf), 0.0, 1.0),
        ((-math.inf, -math.inf), 0.0, 0.0),
        ((0.01, -1.0), 1.0, math.nan),
    ],
)
def test_the_dimension(exponents: tuple[float, float], scatter: float, dimension: float) -> None:
    noise = scatter * np.random.default_rng(1).standard_normal((100, 1)) * [1.0, -1.0]
    value, error = kaplan_yorke(np.full((100, 2), exponents) + noise)
    assert value == pytest.approx(dimension, nan_ok=True)
    assert math.isnan(error) if math.isnan(dimension) else error < 1e-12


def test_the_results_do_not_depend_on_company_or_threads(hammer: "ph.Hammer") -> None:
    periods = [1.3e-3, 1.05e-3, 0.8e-3]
    together = lyapunovs(hammer, periods, threads=2, **FEW)
    alone = lyapunovs(hammer, periods, threads=1, **FEW)
    singles = LyapunovChart.of([ph.lyapunov(hammer, period=period, **FEW) for period in periods])
    for other in (alone, singles):
        for field in dataclasses.fields(LyapunovChart):
            if field.name not in ("hammer", "drive"):
                np.testing.assert_array_equal(getattr(together, field.name), getattr(other, field.name))
    assert together.period.tolist() == periods


def test_a_run_that_stops_has_a_status(hammer: "ph.Hammer") -> None:
    found = ph.lyapunov(hammer.replace("magnet.range_max", "250 um"), period="1 ms", **FEW)
    assert found.status == "range left"
    assert not found.ok
    assert np.isnan(found.exponents).all()
    assert math.isnan(found.dimension)
    assert found.growth == found.zero_one.verdict == found.verdict.name == "undecided"
    assert "range left" in found.zero_one.reason
    assert found.agree is None
    row = LyapunovChart.of([found]).to_dataframe().iloc[0]
    assert row["status"] == "range left"


def test_progress_comes_to_its_end(hammer: "ph.Hammer") -> None:
    told: list[tuple[int, int]] = []
    lyapunovs(
        hammer,
        [1.3e-3, 1.2e-3],
        firings=10,
        transient=0,
        progress=lambda done, total: told.append((done, total)),
    )
    assert told[-1] == (2, 2)


def test_datasets_hold_units_and_provenance(hammer: "ph.Hammer", found: Lyapunov) -> None:
    one = found.to_dataset()
    np.testing.assert_array_equal(one["factor"][1:], found.factors)
    assert one["x"].attrs["units"] == "m"
    assert one.attrs["hammer_fingerprint"] == hammer.fingerprint
    np.testing.assert_allclose(one["running"][-1], found.exponents, rtol=1e-12)
    chart = LyapunovChart.of([found]).to_dataset()
    np.testing.assert_array_equal(chart["exponents"][0], found.exponents)
    assert chart["period"].attrs["units"] == "s"
    assert str(chart["verdict"].values[0]) == found.verdict.name
    assert chart.attrs["tolerance"] == "2e-11"


@pytest.mark.parametrize("suffix", [".csv", ".nc", ".json"])
def test_files(hammer: "ph.Hammer", tmp_path: Path, suffix: str) -> None:
    chart = lyapunovs(hammer, ["1.3 ms", "0.8 ms"], **FEW)
    path = tmp_path / f"chart{suffix}"
    chart.save(path)
    exact = chart.exponents[:, 0]
    if suffix == ".csv":
        table = pd.read_csv(path, dtype=str, comment="#")
        np.testing.assert_array_equal(table["exponent 1 [1/firing]"].map(float), exact)
    elif suffix == ".nc":
        with xr.open_dataset(path, engine="scipy") as kept:
            np.testing.assert_array_equal(kept["exponents"][:, 0], exact)
            assert [str(name) for name in kept["verdict"].values] == list(chart.verdict)
    else:
        kept = json.loads(path.read_text("utf-8"))
        assert [row[0] for row in kept["columns"]["exponents"]["values"]] == exact.tolist()


def test_json_holds_what_is_infinite_or_not_known(found: Lyapunov, tmp_path: Path) -> None:
    chart = LyapunovChart.of([found])
    odd = dataclasses.replace(chart, exponents=np.array([[-np.inf, -np.inf]]), dimension=np.array([np.nan]))
    odd.save(tmp_path / "odd.json")
    columns = json.loads((tmp_path / "odd.json").read_text("utf-8"))["columns"]
    assert columns["exponents"]["values"] == [["-inf", "-inf"]]
    assert columns["dimension"]["values"] == [None]
    with refused(None, file="odd.txt"):
        odd.save(tmp_path / "odd.txt")


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (ph.lyapunov, "period"),
        (lambda h: ph.lyapunov(h, period=1e-3, rate=1e3), "period"),
        (lambda h: ph.lyapunov(h, period=1e-3, drive=ph.SineForce(1.0, 100.0)), "drive"),
        (lambda h: ph.lyapunov(h, period="1 kg"), "period"),
        (lambda h: ph.lyapunov(h, period=1e-3, firings=0), "firings"),
        (lambda h: ph.lyapunov(h, period=1e-3, transient=-1), "transient"),
        (lambda h: ph.lyapunov(h, period=1e-3, tolerance=1.0, **FEW), "tolerance"),
        (lambda h: ph.lyapunov(h.replace("waveform", None), period=1e-3), "waveform"),
        (lambda h: lyapunovs(h, []), "periods"),
        (lambda h: lyapunovs([h, h], [1e-3] * 3), "hammers"),
        (lambda h: LyapunovChart.of([]), "periods"),
    ],
)
def test_bad_input(hammer: "ph.Hammer", call: Callable[["ph.Hammer"], object], key: str) -> None:
    with refused(key):
        call(hammer)


@pytest.mark.slow
def test_both_tests_agree_on_the_panels_of_figure_11(hammer: "ph.Hammer") -> None:
    """Holds for any shipped hammer; weak chaos and long cycles may need more firings before both decide."""
    left, firings = list(printed_verdicts()), 1000
    assert len(left) == 12
    while left and firings <= 16000:
        chart = lyapunovs(hammer, left, firings=firings, transient=1000)
        pairs = dict(zip(left, zip(chart.growth, chart.zero_one, strict=True), strict=True))
        decided = {period: pair for period, pair in pairs.items() if "undecided" not in pair}
        assert {period: pair for period, pair in decided.items() if pair[0] != pair[1]} == {}
        left = [period for period in left if period not in decided]
        firings *= 4
    assert left == []
