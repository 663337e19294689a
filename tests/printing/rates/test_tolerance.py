import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tests.errors import refused

import printhammer as ph
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import SinglePulse
from printhammer.printing.rates.safe_rate import rate_grid, safe_rate, safe_rates
from printhammer.printing.rates.tolerance import draw, spreads_of, tolerance_yield
from printhammer.run.effort import DISPLAY

WIDE = Limits(force=0.2, arrival=80e-6)


def test_factors_lie_within_their_spreads_and_fill_them() -> None:
    spreads = {"mass": 0.01, "magnet.Am": 0.2}
    factors = draw(spreads, 256, 3)
    assert (np.abs(factors - 1.0) <= np.array([0.01, 0.2])).all()
    # Of a Sobol sequence every sixteenth of the range holds as many points.
    for column, spread in zip(factors.T, spreads.values(), strict=True):
        counts, _ = np.histogram(column, 16, (1.0 - spread, 1.0 + spread))
        assert counts.tolist() == [16] * 16
    np.testing.assert_array_equal(draw(spreads, 100, 3), factors[:100])
    assert not np.array_equal(draw(spreads, 100, 4), factors[:100])


def test_without_keys_all_that_matters_varies(hammer: "ph.Hammer") -> None:
    found = spreads_of(hammer, 0.02)
    assert "backstop.position" not in found
    assert "platen" not in found
    assert {"mass", "magnet.Am", "pack.front", "waveform.width"} <= set(found)
    assert set(found.values()) == {0.02}


def test_each_hammer_is_as_by_itself(hammer: "ph.Hammer") -> None:
    found = tolerance_yield(hammer, 500.0, number=2, spreads=0.01, seed=1, limits=WIDE, tolerance=1e-8)
    assert found.status.tolist() == ["ok"] * 2
    for number, factors in enumerate(found.factors.tolist()):
        changes = {
            key: hammer.constants[key].si * factor for key, factor in zip(found.spreads, factors, strict=True)
        }
        gap = hammer.front - hammer.position
        changes["pack.front"] = hammer.position + gap * factors[list(found.spreads).index("pack.front")]
        one = hammer.replace(changes)
        alone = safe_rate(one, first=500.0, last=500.0, limits=WIDE, tolerance=found.tolerance)
        assert found.single_force[number] == pytest.approx(alone.nominal.force, rel=1e-7)
        assert found.passed[number] == alone.passed[0]


def test_safe_rates_of_many_are_those_of_each(hammer: "ph.Hammer") -> None:
    light = hammer.replace("mass", 0.9 * hammer.mass)
    grid = rate_grid(500.0, 900.0, 200.0)
    options = {"limits": WIDE, "tolerance": 5e-7}
    alone = [safe_rate(one, first=500.0, last=900.0, step=200.0, **options) for one in (hammer, light)]
    singles = [SinglePulse(one.nominal.force, one.nominal.flight_time) for one in alone]
    together = safe_rates([hammer, light], singles, grid, limits=WIDE, effort=DISPLAY)
    np.testing.assert_array_equal(together, [one.rate for one in alone])


def test_hammers_that_are_none_are_counted(hammer: "ph.Hammer", tmp_path: Path) -> None:
    # So much flux that some are not released, and so little that some are not held.
    found = tolerance_yield(hammer, 300.0, number=8, spreads={"magnet.Am": 0.6})
    assert len(found.status) == 8
    odd = found.status != "ok"
    assert odd.any()
    assert not found.passed[odd].any()
    assert found.share == found.passed.mean()
    assert 0.0 < found.share_error < 0.5
    found.save(tmp_path / "yield.nc")
    with xr.open_dataset(tmp_path / "yield.nc", engine="scipy") as chart:
        assert chart.attrs["rate"] == 300.0
        assert chart["status"].values.astype(str).tolist() == found.status.tolist()
        np.testing.assert_array_equal(chart["factor"], found.factors)


def test_without_a_rate_safe_rates_are_looked_for(hammer: "ph.Hammer") -> None:
    found = tolerance_yield(hammer, number=2, spreads=0.001, first=300.0, last=500.0, step=200.0, limits=WIDE)
    assert math.isnan(found.rate)
    assert found.share_at(300.0) == found.passed.mean()
    assert found.share_at(500.0) <= found.share_at(300.0)
    assert found.share_at(501.0) == 0.0


def test_judged_by_the_design_a_stronger_hammer_fails(hammer: "ph.Hammer") -> None:
    spreads = {"waveform.amplitude": 0.3}
    own, design = (
        tolerance_yield(hammer, 80.0, number=2, spreads=spreads, judged_by=judge)
        for judge in ("own", "design")
    )
    printing = own.status == "ok"
    assert own.passed[printing].all()
    single = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=4e-3).dots[0]
    off = np.abs(design.single_force / single.peak_force - 1.0) > 0.1
    assert off.any()
    assert not design.passed[off].any()


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"number": 0}, "number"),
        ({"number": 10**6}, "number"),
        ({"spreads": -0.1}, "spread of mass"),
        ({"spreads": 1.0}, "spread of mass"),
        ({"spreads": 0.0}, "spreads"),
        ({"spreads": {"magnet.Xm": 0.1}}, "spread"),
        ({"judged_by": "nobody"}, "judged_by"),
        ({"seed": -1}, "seed"),
        ({"rate": -1.0}, "rate"),
    ],
)
def test_what_makes_no_sense_is_refused(hammer: "ph.Hammer", options: dict[str, object], key: str) -> None:
    with refused(key):
        tolerance_yield(hammer, **{"rate": 300.0, "number": 2, **options})
