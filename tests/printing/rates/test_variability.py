"""Hammers drawn from the variability of the production."""

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import crude

import printhammer as ph
from printhammer.printing.rates.variability import Variability


def test_constants_are_spread_as_stated() -> None:
    hammer = crude()
    drawn = Variability().draw(hammer, 400, 3)
    assert len(drawn) == 400
    for key, part in (
        ("magnet.Am", 0.01),
        ("backstop.damping", 0.2),
        ("magnet.Bm", 0.05),
        ("pack.stiffness", 0.1),
    ):
        values = np.array([other.constants[key].si for other in drawn]) / hammer.constants[key].si - 1.0
        assert np.std(values) == pytest.approx(part, rel=0.12)
        assert abs(values).max() <= 3.0 * part + 1e-12
    fronts = np.array([other.front for other in drawn], dtype=float)
    assert np.std(fronts) == pytest.approx(10e-6, rel=0.12)
    platens = np.array([other.platen for other in drawn], dtype=float)
    assert platens - fronts == pytest.approx(np.full(400, platens[0] - fronts[0]), abs=1e-12)


def test_other_laws_have_other_constants() -> None:
    """A device with a reluctance magnet, a preloaded spring, a coil circuit and a rigid stop."""
    hammer = ph.load("impact-wire")
    spread = Variability().constants(hammer)
    assert spread["backstop.restitution"] == pytest.approx(0.2 * hammer.constants["backstop.restitution"].si)
    assert spread["coil.resistance"] == pytest.approx(0.05 * hammer.constants["coil.resistance"].si)
    assert {"magnet.pole_area", "spring.preload", "spring.stiffness"} < set(spread)
    without = hammer.replace("pack", None)
    assert (Variability.of(without).travel, Variability.of(without).paper) == (0.0, 0.0)
    assert Variability.of(hammer) == Variability()


def test_the_same_seed_draws_the_same() -> None:
    first, again, other = (
        [each.fingerprint for each in Variability().draw(crude(), 5, seed)] for seed in (1, 1, 2)
    )
    assert first == again != other


def test_sigma_points_are_one_deviation_off() -> None:
    points = Variability(magnet=0.0, spring=0.0, damping=0.0, travel=0.0, paper=0.0).sigma_points(crude())
    own = crude().constants["magnet.Bm"].si
    assert [point.constants["magnet.Bm"].si / own for point in points] == pytest.approx([1.05, 0.95])
    assert Variability().times(0.5).current == 0.025
    assert "travel 10 µm" in Variability().text


def test_bad_numbers_are_refused() -> None:
    with refused("current"):
        Variability(current=0.5)
    with refused("travel"):
        Variability(travel=-1.0)
    with refused("travel"):
        Variability().constants(crude().replace("pack", None))


def test_where_no_hammer_rests_the_draw_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    name = "printhammer.printing.rates.variability.changed"
    monkeypatch.setattr(name, lambda hammer, rows: ([hammer] * len(rows), ["no hammer"] * len(rows)))
    with refused("variability"):
        Variability().draw(crude(), 4, 1)
