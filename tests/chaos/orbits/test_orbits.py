import dataclasses
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from tests.chaos import samples
from tests.errors import refused
from tests.hammers import CRUDE
from tests.strobe_maps import strobe_map

import printhammer as ph
from printhammer.chaos import Orbits, orbit
from printhammer.chaos.orbits.orbit import KINDS
from printhammer.run.regime import Regime

PERIOD = 1.3e-3
SMALL = {"longest": 2, "starts": 100, "guesses": 8, "follow": 0}


@pytest.fixture(scope="module")
def found() -> Orbits:
    return samples.orbits(ph.load(CRUDE))


@pytest.fixture(scope="module")
def fast() -> Orbits:
    """A strange train with overlapping pulses and firings during pack contacts."""
    return ph.orbits(ph.load(CRUDE), period=0.6e-3, **SMALL)


def test_the_train_from_rest_ends_on_a_stable_orbit(found: Orbits, hammer: ph.Hammer) -> None:
    points = ph.strobe(hammer, period=PERIOD, points=1, transient=300, verdict=False, tolerance=1e-13)
    scales = found.regime.window.half_widths
    gaps = [
        max(abs(one.x[0] - points.x[0]) / scales[0], abs(one.v[0] - points.v[0]) / scales[1])
        for one in found.stable
    ]
    assert min(gaps) < 1e-9


def test_every_orbit_closes_and_no_two_are_the_same(found: Orbits, fast: Orbits) -> None:
    for orbits in (found, fast):
        scales = orbits.regime.window.half_widths
        for one in orbits:
            image = strobe_map(orbits.regime, one.section, firings=one.firings, phase=one.phase)
            growth = max(1.0, abs(one.multipliers[0]))
            assert np.abs((image.state - one.section) / scales).max() < 1e-9 * growth
            exact = np.sort_complex(np.linalg.eigvals(image.jacobian))
            np.testing.assert_allclose(np.sort_complex(one.multipliers), exact, atol=1e-6 * growth)
            assert one.residual < 1e-6 * growth
            assert one.ok
        for k, one in enumerate(orbits):
            for other in list(orbits)[k + 1 :]:
                gap = np.abs(one.x[0] - other.x) / scales[0] + np.abs(one.v[0] - other.v) / scales[1]
                assert gap.min() > 1e-6 or one.memory[0] != other.memory[np.argmin(gap)]


def test_a_change_along_a_saddle_grows_by_its_multiplier(found: Orbits) -> None:
    (saddle,) = [one for one in found if one.kind == "saddle"]
    image = strobe_map(found.regime, saddle.section)
    values, vectors = np.linalg.eig(image.jacobian)
    along = vectors[:, np.argmax(np.abs(values))].real
    step = 1e-6 * along / np.abs(along / found.regime.window.half_widths).max()
    ends = [strobe_map(found.regime, saddle.section + sign * step).state for sign in (1.0, -1.0)]
    grown = (ends[0] - ends[1]) @ along / (2.0 * step @ along)
    assert grown == pytest.approx(saddle.multipliers[0].real, rel=1e-6)


def test_energies_and_dots_of_a_period(found: Orbits, fast: Orbits) -> None:
    for orbits in (found, fast):
        for one in orbits:
            ledger = one.energy
            assert ledger.coil_work == pytest.approx(
                ledger.pack_loss + ledger.backstop_loss, rel=1e-6, abs=1e-6 * ledger.throughput
            )
            assert one.printed + one.lost == one.firings == len(one.dots)
            assert one.pack_contacts == sum(dot.struck + dot.extra_contacts for dot in one.dots)
            assert np.isnan(one.flight_times).sum() == one.lost
            lost = sum(contact.loss for contact in one.contacts if contact.surface == "pack")
            assert lost == pytest.approx(ledger.pack_loss, rel=1e-6, abs=1e-6 * ledger.throughput)
            for k, dot in enumerate(one.dots):
                assert dot.index == k
                assert dot.fired_at == k * orbits.regime.period
                if dot.struck:
                    touches = [c.t_in for c in one.contacts if c.surface == "pack" and c.firing == k]
                    first = dot.flight_time + dot.fired_at
                    assert min(abs(t - first) for t in touches) < 1e-12


def test_states_at_the_firings_are_those_of_a_train(fast: Orbits) -> None:
    # Carried on from the section by the ensemble, which keeps the mode and the memory inside the pack.
    regime = fast.regime
    inside = 0
    for one in fast:
        train, _ = regime.train(one.firings + 1)
        sections = regime.moments(train, one.firings + 1, one.phase)
        firings = regime.moments(train, one.firings + 1, 0.0)
        ensemble = ph.Ensemble(
            regime.hammer,
            train,
            float(sections[-1]),
            states=one.section,
            starts=float(sections[0]),
            tolerance=1e-13,
        )
        table = ensemble.run(strobes=[firings[firings >= sections[0]]]).strobes
        shift = 0 if one.phase == 0.0 else 1
        for k in range(one.firings - shift):
            growth = max(1.0, abs(one.multipliers[0]))
            assert table.x[0, k] == pytest.approx(one.x[k + shift], abs=1e-12 * growth)
            assert table.branch[0, k] == one.branch[k + shift]
            assert table.memory[0, k] == pytest.approx(one.memory[k + shift], abs=1e-12 * growth)
        inside += int((one.x > regime.hammer.front).sum())
    assert inside > 0


def test_the_search_does_not_depend_on_threads(hammer: ph.Hammer) -> None:
    """The orbits on the branches that the search follows do not depend on the number of threads."""
    seen: list[tuple[int, int]] = []
    options = {"period": 0.6e-3, "longest": 1, "starts": 100, "guesses": 8}
    found = ph.orbits(hammer, **options)
    again = ph.orbits(hammer, **options, threads=1, progress=lambda done, total: seen.append((done, total)))
    assert again.message == found.message
    assert again.to_dataset().identical(found.to_dataset())
    assert seen[-1][0] == seen[-1][1]
    assert [done for done, _total in seen] == sorted(done for done, _total in seen)


def test_every_guess_is_accounted_for(found: Orbits, fast: Orbits) -> None:
    for orbits in (found, fast):
        assert sum(orbits.guesses) == len(orbits) + orbits.repeats + sum(orbits.failures.values())
        assert orbits.starts == 129
        # What it is closed with in the end, and that at another section, may add to what a guess led to.
        assert sum(orbits.hits) <= len(orbits) + orbits.repeats
        assert len(orbits.hits) == len(orbits)
        assert 0.0 <= orbits.coverage <= 1.0
        assert sum(orbits.counts.values()) == len(orbits)
        for count in orbits.failures.values():
            assert str(count) in orbits.message


def test_a_search_that_finds_nothing_says_so(hammer: ph.Hammer) -> None:
    # No motion under this drive stays where the law of the magnet holds.
    short = hammer.replace("magnet.range_max", "250 um")
    found = ph.orbits(short, period="1.3 ms", longest=2, starts=20)
    assert len(found) == 0
    assert "no orbits of up to 2 firings" in found.message
    assert "129 states" in found.message
    assert np.isnan(found.coverage)
    assert len(found.to_dataset()["orbit"]) == 0


@pytest.mark.golden
def test_branches_lead_to_orbits_that_no_motion_comes_close_to() -> None:
    # Saddles with multipliers of 89 and -4, partners in a fold, and one of period 2 between them with -315.
    hammer = ph.load("hendriks-1983-1")
    found = ph.orbits(hammer, period="1.05 ms", longest=2, starts=100, follow=1)
    half = found.regime.window.half_widths
    for firings, x, v in ((1, 93.314e-6, -0.49619), (1, 95.380e-6, -0.48855), (2, 93.154e-6, -0.49431)):
        gaps = [
            np.abs(np.array([one.x[0] - x, one.v[0] - v]) / half).max()
            for one in found
            if one.firings == firings
        ]
        assert min(gaps) < 1e-4


@pytest.mark.slow
def test_more_effort_finds_no_fewer_orbits(hammer: ph.Hammer) -> None:
    lists = {
        (starts, guesses): ph.orbits(
            hammer, period=0.6e-3, longest=2, starts=starts, guesses=guesses, follow=0
        )
        for starts, guesses in ((32, 8), (32, 24), (128, 8), (128, 24))
    }
    for (starts, guesses), few in lists.items():
        for (more, others), many in lists.items():
            if more >= starts and others >= guesses:
                scales = few.regime.window.half_widths
                for one in few:
                    gaps = [
                        np.maximum(
                            abs(one.x[0] - other.x) / scales[0], abs(one.v[0] - other.v) / scales[1]
                        ).min()
                        for other in many
                        if other.firings == one.firings
                    ]
                    assert min(gaps) < 1e-6
                assert len(many) >= len(few)


def test_how_sure_a_list_is_follows_from_how_often_its_orbits_were_met(found: Orbits) -> None:
    known = dataclasses.replace(found, hits=(1, 1, 1, 2, 95))
    assert known.coverage == pytest.approx(0.97)
    assert known.unseen == pytest.approx(1.5)
    assert "97.0 %" in known.message


def test_from_a_strobe_point(hammer: ph.Hammer, found: Orbits) -> None:
    regime = Regime.of(hammer, period=PERIOD)
    point = ph.strobe(hammer, period=PERIOD, points=1, transient=20, verdict=False)
    once = orbit(regime, (point.x[0], point.v[0]))
    twice = orbit(regime, (point.x[0], point.v[0]), firings=2)
    assert once.ok
    # A motion that repeats after one firing is no orbit of two.
    assert twice.firings == 1
    np.testing.assert_allclose(twice.x, once.x, rtol=0.0, atol=1e-12)
    assert any(np.allclose(once.x, one.x, rtol=1e-9) for one in found.stable)
    assert once.name == "period-1 stable"
    later = orbit(regime, strobe_map(regime, once.section).state, phase=0.0)
    assert later.x[0] == pytest.approx(once.x[0], abs=1e-12)


def test_the_phase_of_the_section_does_not_matter(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, period=PERIOD)
    point = ph.strobe(hammer, period=PERIOD, points=1, transient=20, verdict=False)
    late = ph.strobe(hammer, period=PERIOD, points=1, transient=20, phase=0.75, verdict=False)
    one = orbit(regime, (point.x[0], point.v[0]))
    other = orbit(regime, (late.x[0], late.v[0]), phase=0.75)
    assert other.phase == 0.75
    np.testing.assert_allclose(other.x, one.x, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(other.multipliers, one.multipliers, rtol=0.0, atol=1e-9)
    assert [c.surface for c in other.contacts] == [c.surface for c in one.contacts]
    np.testing.assert_allclose(
        [c.t_in for c in other.contacts], [c.t_in for c in one.contacts], rtol=0.0, atol=1e-13
    )
    assert other.flight_times == pytest.approx(one.flight_times, abs=1e-13)
    assert other.energy.coil_work == pytest.approx(one.energy.coil_work, rel=1e-9)


def test_no_orbit_near_has_a_status(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, period=PERIOD)
    none = orbit(regime, (hammer.front + 20e-6, -0.1))
    assert not none.ok
    assert none.status == "in the pack"
    assert none.name == "no period-1 orbit"
    assert none.kind == "undecided"
    assert np.isnan(none.x).all()
    with pytest.raises(ValueError, match="in the pack"):
        none.motion()
    with refused("orbit"):
        none.plot()


def test_files(found: Orbits, tmp_path: Path) -> None:
    paths = {kind: tmp_path / f"orbits.{kind}" for kind in ("csv", "nc", "json")}
    for path in paths.values():
        found.save(path)
    table = pd.read_csv(paths["csv"], dtype=str, comment="#")
    assert len(table) == sum(one.firings for one in found)
    assert table["x [m]"].map(float).tolist() == [x for one in found for x in one.x]
    assert table["multiplier_real 1"].map(float).tolist() == [
        one.multipliers[0].real for one in found for _ in one.x
    ]
    with xr.open_dataset(paths["nc"], engine="scipy") as chart:
        np.testing.assert_array_equal(chart["coil_work"], [one.energy.coil_work for one in found])
        assert chart["v"].attrs["units"] == "m/s"
        assert chart.attrs["search"] == found.message
        assert chart.attrs["hammer_fingerprint"] == found.regime.hammer.fingerprint
    kept = json.loads(paths["json"].read_text("utf-8"))
    assert [KINDS[code] for code in kept["columns"]["kind"]["values"]] == [one.kind for one in found]
    with refused(None, file="orbits.txt"):
        found.save(tmp_path / "orbits.txt")
    one = found[0].to_dataset()
    assert one["x"].dims == ("firing",)
    assert float(one["x"][0]) == found[0].x[0]


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({}, "period"),
        ({"period": 1e-3, "rate": 1e3}, "period"),
        ({"period": 1e-3, "longest": 0}, "longest"),
        ({"period": 1e-3, "longest": 65}, "longest"),
        ({"period": 1e-3, "longest": 1.5}, "longest"),
        ({"period": 1e-3, "starts": 0}, "starts"),
        ({"period": 1e-3, "guesses": "many"}, "guesses"),
        ({"period": 1e-3, "tolerance": 1.0}, "tolerance"),
        ({"period": 1e-3, "threads": 0}, "threads"),
    ],
)
def test_bad_input(hammer: ph.Hammer, options: dict, key: str) -> None:
    with refused(key):
        ph.orbits(hammer, **options)


def test_bad_input_of_one(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, period=PERIOD)
    with refused("state"):
        orbit(regime, (1.0,))
    with refused("firings"):
        orbit(regime, (1e-4, 0.0), firings=65)
    with refused("phase"):
        orbit(regime, (1e-4, 0.0), phase=1.0)
