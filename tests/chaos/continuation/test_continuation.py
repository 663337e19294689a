import dataclasses
import functools
import json
import math
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from tests.errors import refused
from tests.strobe_maps import strobe_map

import printhammer as ph
from printhammer.chaos import Branch, BranchEvent
from printhammer.chaos.continuation.branch import event_of
from printhammer.chaos.continuation.branch_points import BranchPoint
from printhammer.chaos.continuation.family import Passage, RegimeFamily, Touch
from printhammer.chaos.continuation.regimes import InterruptedBranches
from printhammer.run.regime import Regime

SLOW = 3e-3
"""A period at which any hammer of this kind settles between firings."""
RANGE = (2.9e-3, 3.1e-3)


@pytest.fixture(scope="module")
def branch(hammer: "ph.Hammer") -> Branch:
    return ph.continuation(hammer, "period", RANGE, period=SLOW)


def test_every_orbit_returns_to_itself(branch: Branch) -> None:
    assert [stop.reason for stop in branch.stops] == ["bound", "bound"]
    assert (branch.values[0], branch.values[-1]) == RANGE
    assert branch.stable.all()
    half_widths = branch.regime.window.half_widths
    for i in (0, len(branch) // 2, len(branch) - 1):
        regime = branch.regime.with_("period", float(branch.values[i]))
        image = strobe_map(regime, (branch.x[i, 0], branch.v[i, 0]))
        assert np.abs((image.state - [branch.x[i, 0], branch.v[i, 0]]) / half_widths).max() < 1e-9
        sizes = np.abs(np.linalg.eigvals(image.jacobian))
        np.testing.assert_allclose(np.sort(sizes), np.sort(np.abs(branch.multipliers[i])), atol=1e-9)


def test_what_an_orbit_does_is_what_the_orbit_says(branch: Branch) -> None:
    for i in (0, len(branch) - 1):
        orbit = branch.orbit(i)
        assert orbit.ok
        assert branch.backstop_contacts[i] == orbit.backstop_contacts
        assert branch.pack_contacts[i] == orbit.pack_contacts
        assert (branch.printed[i], branch.lost[i]) == (orbit.printed, orbit.lost)
        np.testing.assert_allclose(branch.flight_time[i], orbit.flight_times, rtol=1e-8)
        np.testing.assert_allclose(branch.peak_force[i], orbit.peak_forces, rtol=1e-8)
        assert branch.coil_work[i] == pytest.approx(orbit.energy.coil_work, rel=1e-7)
        assert branch.pack_loss[i] == pytest.approx(orbit.energy.pack_loss, rel=1e-7)
        assert branch.backstop_loss[i] == pytest.approx(orbit.energy.backstop_loss, rel=1e-7)
        assert branch.contacts[i] == "B" * orbit.backstop_contacts + "P" * orbit.pack_contacts


@pytest.mark.slow
def test_a_branch_does_not_depend_on_threads_or_on_where_it_is_entered(hammer: "ph.Hammer") -> None:
    one, two = (ph.continuation(hammer, "period", RANGE, period=SLOW, threads=n) for n in (1, 2))
    for name in ("values", "x", "v", "multipliers", "peak_force", "coil_work", "flight_time"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    other = ph.continuation(hammer, "period", RANGE, period=2.95e-3)
    for end in (0, -1):
        np.testing.assert_allclose(other.x[end], one.x[end], rtol=1e-9)
        np.testing.assert_allclose(other.v[end], one.v[end], atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parameter", "share"), [("backstop.damping", 0.05), ("waveform.amplitude", 0.01), ("mass", 0.01)]
)
def test_any_constant_will_do(hammer: "ph.Hammer", parameter: str, share: float) -> None:
    own = hammer.constants[parameter]
    bounds = (f"{own.si * (1.0 - share)!r} {own.si_unit}", own.si * (1.0 + share))
    branch = ph.continuation(hammer, parameter, bounds, period=SLOW)
    assert branch.unit == own.si_unit
    assert [stop.reason for stop in branch.stops] == ["bound", "bound"]
    assert parameter in branch.message
    assert branch.values.max() == pytest.approx(own.si * (1.0 + share), rel=1e-12)
    assert (branch.residual < 1e-8).all()


@pytest.mark.slow
def test_from_an_orbit_as_from_its_state(hammer: "ph.Hammer", branch: Branch) -> None:
    middle = len(branch) // 2
    again = ph.continuation(branch.orbit(middle), "period", RANGE)
    np.testing.assert_allclose(again.x[[0, -1]], branch.x[[0, -1]], rtol=1e-9)
    state = (float(branch.x[middle, 0]), float(branch.v[middle, 0]))
    value = float(branch.values[middle])
    near = ph.continuation(hammer, "period", RANGE, period=value, state=state)
    np.testing.assert_allclose(near.x[[0, -1]], branch.x[[0, -1]], rtol=1e-9)


def test_a_run_that_leaves_the_range_ends_the_branch(hammer: "ph.Hammer", branch: Branch) -> None:
    peak = float(np.max(ph.simulate(hammer, ph.PulseTrain(hammer.waveform)).x))
    own = hammer.constants["waveform.amplitude"].si
    short = hammer.replace("magnet.range_max", 1.001 * peak)
    found = ph.continuation(short, "waveform.amplitude", (0.95 * own, 1.2 * own), period=SLOW)
    reasons = {stop.reason for stop in found.stops}
    assert "no value" in reasons
    assert "range left" in found.message


def test_dataset_and_files(branch: Branch, tmp_path: Path) -> None:
    data = branch.to_dataset()
    assert data["value"].attrs == {"units": "s", "long_name": "period"}
    np.testing.assert_array_equal(data["x"][:, 0], branch.x[:, 0])
    assert data.attrs["hammer_fingerprint"] == branch.regime.hammer.fingerprint
    assert "bound" in data.attrs["first_end"]
    branch.save(tmp_path / "b.nc")
    read = xr.load_dataset(tmp_path / "b.nc", engine="scipy")
    np.testing.assert_array_equal(read["flight_time"], branch.flight_time)
    branch.save(tmp_path / "b.csv")
    table = pd.read_csv(tmp_path / "b.csv", dtype=str, comment="#")
    np.testing.assert_array_equal(table["period [s]"].map(float), branch.values)
    branch.save(tmp_path / "b.json")
    read_back = json.loads((tmp_path / "b.json").read_text("utf-8"))
    assert read_back["stable_ranges"] == [list(pair) for pair in branch.stable_ranges]
    assert read_back["columns"]["v"]["values"] == branch.v.tolist()
    with refused(None, file="b.txt"):
        branch.save(tmp_path / "b.txt")


@pytest.mark.parametrize(
    ("parameter", "bounds", "how", "key"),
    [
        ("pack.nothing", (1.0, 2.0), {"period": SLOW}, "constant"),
        ("period", (2.0, 1.0), {"period": SLOW}, "bounds"),
        ("period", (1.0,), {"period": SLOW}, "bounds"),
        ("period", ("1 m", "2 m"), {"period": SLOW}, "period"),
        ("period", (1e-3, 2e-3), {"period": SLOW}, "period"),
        ("period", RANGE, {}, "period"),
        ("period", RANGE, {"period": SLOW, "most": 0}, "most"),
        ("period", RANGE, {"period": SLOW, "phase": 1.0}, "phase"),
        ("period", RANGE, {"period": SLOW, "tolerance": 1.0}, "tolerance"),
        ("period", RANGE, {"period": SLOW, "state": (1e9, 0.0)}, "parameter"),
    ],
)
def test_bad_input(
    hammer: "ph.Hammer", parameter: str, bounds: tuple[float, float], how: dict[str, float], key: str
) -> None:
    with refused(key):
        ph.continuation(hammer, parameter, bounds, **how)


def test_an_orbit_brings_its_own_train(branch: Branch) -> None:
    with refused("orbit"):
        ph.continuation(branch.orbit(0), "period", RANGE, period=SLOW)


def test_a_slope_is_a_difference_of_images(hammer: "ph.Hammer", branch: Branch) -> None:
    family = RegimeFamily(branch.regime, "rate", 1, 1e-13)
    state = np.array([branch.x[3, 0], branch.v[3, 0]])
    rate = 1.0 / float(branch.values[3])
    value = family(state, rate)
    step = 1e-4 * rate
    beside = [strobe_map(Regime.of(hammer, rate=rate + sign * step), state).state for sign in (-1.0, 1.0)]
    expected = (beside[1] - beside[0]) / (2.0 * step)
    np.testing.assert_allclose(value.slope, expected, rtol=1e-3)


def passage(*touches: tuple[str, float, float]) -> Passage:
    return Passage(tuple(Touch(name, begin, end, 1.0) for name, begin, end in touches), 1.0, 1)


def test_sequences_do_not_depend_on_the_section() -> None:
    one = passage(("pack", 0.1, 0.2), ("backstop", 0.4, 0.5), ("backstop", 0.6, 0.7))
    other = passage(("backstop", 0.1, 0.2), ("pack", 0.4, 0.5), ("backstop", 0.6, 0.7))
    assert one.sequence == other.sequence == "BBP"
    assert passage().sequence == ""


@pytest.mark.parametrize(
    ("fewer", "more", "surface", "change"),
    [
        ([("pack", 0.1, 0.2)], [("pack", 0.1, 0.2), ("pack", 0.5, 0.501)], "pack", "appears"),
        ([("pack", 0.1, 0.2)], [("pack", 0.1, 0.15), ("pack", 0.151, 0.2)], "pack", "splits"),
        ([], [("backstop", 0.1, 0.101)], "backstop", "appears"),
        (
            [("pack", 0.1, 0.2), ("backstop", 0.8, 1.2)],
            [("pack", 0.1, 0.2), ("backstop", 0.25, 0.251), ("backstop", 0.8, 1.2)],
            "backstop",
            "appears",
        ),
        ([("pack", 0.1, 0.2)], [("backstop", 0.1, 0.2)], "", "several"),
        ([], [("pack", 0.1, 0.2), ("pack", 0.5, 0.501)], "pack", "several"),
    ],
)
def test_grazings_are_named_as_the_constant_grows(
    branch: Branch,
    fewer: list[tuple[str, float, float]],
    more: list[tuple[str, float, float]],
    surface: str,
    change: str,
) -> None:
    node = branch.curve.nodes[0]
    low, high = (
        dataclasses.replace(
            node, parameter=place, value=dataclasses.replace(node.value, extra=passage(*touches))
        )
        for place, touches in ((1.0, fewer), (2.0, more))
    )
    opposite = {"appears": "vanishes", "splits": "merges", "several": "several"}
    for sides, values, named in (
        ((low, high), (1.0, 2.0), change),
        ((high, low), (1.0, 2.0), change),
        ((low, high), (2.0, 1.0), opposite[change]),
    ):
        moved = tuple(
            dataclasses.replace(side, parameter=values[0] if side is low else values[1]) for side in sides
        )
        found: BranchEvent = event_of(BranchPoint("change", node, 0, ("", ""), True, moved))
        assert (found.surface, found.change) == (surface, named)
        assert math.isfinite(found.value)


def steep(period: float, state: tuple[float, float]) -> Branch:
    """A few orbits of a branch with doublings close to folds and grazings, within 1e-4 of its range."""
    bounds = ("1.1 ms", "1.33 ms")
    return ph.continuation(ph.load("hendriks-1983-1"), "period", bounds, period=period, state=state, most=12)


@pytest.mark.parametrize(
    ("period", "state", "born", "ends", "doublings"),
    [
        # Each branch is followed from one of its two ends, upwards and downwards.
        (1.1632e-3, (50.95e-6, 0.0932), 1.1545156e-3, 1.2467185e-3, (1.1834217e-3, 1.2462172e-3)),
        (1.3215e-3, (51.496e-6, 0.0041), 1.3228613e-3, 1.2563104e-3, (1.2783385e-3, 1.3217745e-3)),
    ],
)
def test_doubled_branches_lead_from_doubling_to_doubling(
    period: float, state: tuple[float, float], born: float, ends: float, doublings: tuple[float, float]
) -> None:
    branch = steep(period, state)
    event = next(e for e in branch.events if e.kind == "period doubling" and abs(e.value - born) < 1e-9)
    doubled = branch.doubled(event, most=200)
    assert [stop.reason for stop in doubled.stops] == ["period doubling", "period doubling"]
    assert doubled.stops[1].parameter == pytest.approx(ends, abs=1e-10)
    found = sorted(e.value for e in doubled.events if e.kind == "period doubling")
    assert found == pytest.approx(list(doublings), abs=1e-10)
    assert len(doubled) > 25
    # No orbit has half the period, and no step leaps.
    assert (np.abs(doubled.x[1:-1, 0] - doubled.x[1:-1, 1]) > 0.0).all()


def test_a_doubling_among_grazings_has_its_branch() -> None:
    # It was sought too far off, at a negative period.
    branch = steep(1.1554e-3, (54.25e-6, -0.0527))
    event = next(e for e in branch.events if abs(e.value - 1.1567165e-3) < 1e-9)
    doubled = branch.doubled(event, most=40)
    assert doubled.stops[0].reason == "period doubling"
    assert any(abs(e.value - 1.1565279e-3) < 1e-9 for e in doubled.events)


@pytest.mark.slow
def test_regimes_follow_each_orbit_once(hammer: "ph.Hammer") -> None:
    rates = (1.0 / RANGE[1], 1.0 / RANGE[0])
    found = ph.regimes(hammer, rates, longest=1, seeds=2)
    assert found.refused == ()
    keys = {round(float(branch.x[0, 0]) * 1e12) for branch in found}
    assert len(keys) == len(found) >= 1
    assert str(len(found)) in found.message
    assert found.to_dataset().sizes["branch"] == len(found)
    assert any(branch.stable.all() for branch in found)


def test_an_interrupted_search_hands_over_what_was_followed(
    hammer: "ph.Hammer", monkeypatch: pytest.MonkeyPatch
) -> None:
    few = functools.partial(ph.orbits, starts=20, guesses=8, follow=0)
    monkeypatch.setattr(sys.modules[InterruptedBranches.__module__], "orbits", few)

    def stop(_done: int, _total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        ph.regimes(hammer, (330.0, 340.0), longest=1, seeds=2, most=5, progress=stop)
    assert isinstance(caught.value, InterruptedBranches)
    assert len(caught.value.branches) >= 1


@pytest.mark.parametrize(
    ("rates", "how", "key"),
    [
        ((2.0, 1.0), {}, "rates"),
        ((1.0,), {}, "rates"),
        (("1 kHz", "2 m"), {}, "rates"),
        ((1e3, 2e3), {"seeds": 0}, "seeds"),
        ((1e3, 2e3), {"doublings": -1}, "doublings"),
        ((1e3, 2e3), {"longest": 0}, "longest"),
    ],
)
def test_bad_regimes(hammer: "ph.Hammer", rates: tuple[float, float], how: dict[str, int], key: str) -> None:
    with refused(key):
        ph.regimes(hammer, rates, **how)


def test_bad_charts(branch: Branch) -> None:
    own = branch.regime.hammer.constants["backstop.damping"].si
    with refused("second"):
        ph.stability_chart(branch, "period", RANGE)
    with refused("bounds"):
        ph.stability_chart(branch, "backstop.damping", (2.0 * own, 3.0 * own))
    with refused("grid"):
        ph.stability_chart(branch, "backstop.damping", (0.5 * own, 2.0 * own), grid=(-1, 1))


def test_a_chart_without_limits_still_shows_where_trains_settle(branch: Branch) -> None:
    own = branch.regime.hammer.constants["backstop.damping"].si
    chart = ph.stability_chart(branch, "backstop.damping", (0.98 * own, 1.02 * own), grid=(3, 2), most=5)
    assert chart.curves == ()
    assert (chart.settled == 1).all()
    assert "100 % of the grid" in chart.message
    data = chart.to_dataset()
    assert data["settled"].shape == (2, 3)
    np.testing.assert_allclose(data["main"], np.linspace(*RANGE, 3))
