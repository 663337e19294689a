"""The endless train of a page: points, exponent and classification equal those of the library."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.studio.node import Engine
from tests.studio.reading import STATE
from tests.studio.test_live import NAME

import printhammer as ph
from printhammer.derivatives.states import strobe_exponent
from printhammer.studio import Shelf
from printhammer.studio.controls import describe

pytestmark = pytest.mark.slow

COUNTS, JUDGED = [25, 50, 100, 150, 200], [1001, 2000]


@pytest.fixture(scope="module")
def engine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Engine]:
    with Engine(Shelf(ph.load(NAME), only=True), tmp_path_factory.mktemp("engine")) as made:
        yield made


def judged(engine: Engine, rate: float, **changed: Any) -> list[dict[str, Any]]:
    state = {**STATE, "hammer": NAME, "rate": rate, **changed}
    return engine.work("section", state, counts=COUNTS, judged=JUDGED)


def test_points_and_exponent_before_the_class_are_those_of_the_library(engine: Engine) -> None:
    state = {**STATE, "hammer": NAME, "rate": 1000.0}
    frames = engine.work("section", state, counts=[25, 60, 150], judged=None)
    assert [frame["data"]["x"].size for frame in frames] == [25, 60, 150]
    hammer = ph.load(NAME)
    points = ph.strobe(hammer, rate=1000.0, points=20, verdict=False)
    for frame in frames:
        np.testing.assert_allclose(frame["data"]["x"][:20], points.x, rtol=1e-6)
        np.testing.assert_allclose(frame["data"]["v"][:20], points.v, atol=1e-6 * np.abs(points.v).max())
    assert [frame["verdict"] for frame in frames] == [None] * 3
    assert [frame["exponent"] is None for frame in frames] == [True, True, False]
    exponent = frames[-1]["exponent"]
    whole = strobe_exponent(hammer, hammer.waveform, 1e-3, first=76, last=150)
    assert exponent["value"] == pytest.approx(whole.value, abs=1e-7)
    assert exponent["standard_error"] == pytest.approx(whole.standard_error, rel=0.01)
    assert exponent["firings"] == [76, 150]


@pytest.mark.parametrize("rate", [900.0, 1000.0, 1350.0])
def test_the_class_of_a_motion_is_that_of_the_library(engine: Engine, rate: float) -> None:
    frames = judged(engine, rate)
    assert [len(frame["data"]["x"]) for frame in frames] == [*COUNTS, COUNTS[-1]]
    section = ph.strobe(ph.load(NAME), rate=rate, points=COUNTS[-1])
    expected = section.verdict
    assert expected is not None
    verdict = frames[-1]["verdict"]
    assert (verdict["verdict"], verdict["nearest_period"]) == (expected.name, expected.nearest)
    within = 4.0 * (verdict["standard_error"] + expected.standard_error)
    assert verdict["exponent_per_firing"] == pytest.approx(expected.exponent, abs=within)
    # Two estimates from a thousand firings each, with about thirty batches, differ by far less than twice.
    assert 0.5 < verdict["standard_error"] / expected.standard_error < 2.0
    early = slice(0, 20)
    np.testing.assert_allclose(frames[-1]["data"]["x"][early], section.x[early], rtol=1e-6)
    assert [frame["exponent"] is None for frame in frames] == [True, True, True, False, False, True]


def test_near_a_doubling_the_class_rests_on_newtons_method(engine: Engine) -> None:
    # States two firings apart agree, those one firing apart nearly.
    verdict = judged(engine, 1.0 / 1.0482e-3)[-1]["verdict"]
    assert verdict["verdict"] == "period-1"
    assert verdict["multiplier"] == pytest.approx(math.exp(verdict["exponent_per_firing"]), abs=1e-5)
    assert "Newton's method" in verdict["phrases"][1]


def test_a_train_that_leaves_the_range_is_refused(engine: Engine) -> None:
    pulse = {"shape": "half-sine", "amplitude": -90.0, "width": 4e-4, "quantity": "current"}
    (refused,) = judged(engine, 1000.0, waveform=pulse)
    assert "the first 25 strobe points" in refused["refusal"]


def test_a_continuous_force_is_classified_as_by_the_library(tmp_path: Path) -> None:
    oscillator = ph.load("duffing-holmes")
    opening = describe(oscillator)["start"]
    wave = opening["waveform"]
    with Engine(Shelf(oscillator, only=True), tmp_path) as engine:
        state = {**STATE, "hammer": oscillator.name, **opening}
        verdict = engine.work("section", state, counts=COUNTS, judged=JUDGED)[-1]["verdict"]
        part = {"rates": [opening["low"], opening["high"]], "columns": 40, "wanted": False}
        (piece,) = engine.work("piece", state, part=part)
    force = ph.SineForce(wave["amplitude"], opening["rate"], phase=wave["phase"])
    expected = ph.strobe(oscillator, drive=force, points=1).verdict
    assert expected is not None
    # Per firing, 2 pi times the exponent of 0.158 per unit of time of Holmes.
    assert (verdict["verdict"], expected.name) == ("strange", "strange")
    assert verdict["exponent_per_firing"] == pytest.approx(2.0 * math.pi * 0.158, abs=0.1)
    end = opening["pulses"] / opening["low"]
    for rate, row in zip(part["rates"], np.reshape(piece["x"], (2, part["columns"])), strict=True):
        force = ph.SineForce(wave["amplitude"], rate, phase=wave["phase"])
        motion = ph.simulate(oscillator, force, duration=end)
        x = motion.curves_at(np.linspace(0.0, end, part["columns"]))[0]
        np.testing.assert_allclose(row[:8], x[:8], atol=1e-4)
