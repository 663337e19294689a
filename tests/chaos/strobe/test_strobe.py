import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import Strobe, strobes
from printhammer.claims import claims
from printhammer.parts.backstop.rigid import RigidBackstop
from printhammer.parts.spring.linear import PreloadSpring
from printhammer.run.ensemble import MODE_NAMES
from printhammer.run.regime import PAPER_WINDOW, window_of

MASS, STIFFNESS, FREQUENCY, AMPLITUDE = 1e-3, 900.0, 100.0, 0.5
OMEGA = 2.0 * math.pi * FREQUENCY


def oscillator(stiffness: float) -> "ph.Hammer":
    # The backstop is never met; with it other tests have compiled these laws already.
    return ph.Hammer.build(
        MASS,
        spring=PreloadSpring(preload=20e-3 * stiffness, stiffness=stiffness),
        backstop=RigidBackstop(position=-20e-3, restitution=0.5),
    )


def same(one: Strobe, other: Strobe) -> bool:
    names = ("firing", "t", "x", "v", "branch", "memory")
    equal = all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)
    return equal and str(one.verdict) == str(other.verdict)


@pytest.mark.parametrize("phase", [0.0, 0.25, 0.999])
def test_points_are_states_of_the_motion(hammer: "ph.Hammer", phase: float) -> None:
    period = 1.2e-3
    found = ph.strobe(hammer, period=period, points=4, phase=phase, verdict=False)
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, period=period, pulses=4), points=2)
    x, v = motion.at(motion.drive.times + phase * period)
    np.testing.assert_allclose(found.x, x, atol=1e-9 * 152.4e-6)
    np.testing.assert_allclose(found.v, v, atol=1e-9)
    np.testing.assert_array_equal(found.firing, [1, 2, 3, 4])
    np.testing.assert_allclose(found.t, period * (np.arange(4) + phase), rtol=1e-15)
    assert found.ok
    assert found.verdict is None


def test_a_transient_is_left_out(hammer: "ph.Hammer") -> None:
    whole = ph.strobe(hammer, rate="1 kHz", points=12, verdict=False)
    late = ph.strobe(hammer, rate="1 kHz", points=5, transient=7, verdict=False)
    assert late.period == 1e-3
    np.testing.assert_array_equal(late.firing, np.arange(8, 13))
    np.testing.assert_array_equal(late.x, whole.x[7:])
    np.testing.assert_array_equal(late.v, whole.v[7:])


def test_a_verdict_does_not_change_the_points(hammer: "ph.Hammer") -> None:
    phase = 0.3
    plain = ph.strobe(hammer, period="1.3 ms", points=10, phase=phase, verdict=False)
    judged = ph.strobe(hammer, period="1.3 ms", points=10, phase=phase)
    np.testing.assert_array_equal(judged.x, plain.x)
    np.testing.assert_array_equal(judged.v, plain.v)
    assert judged.verdict.period == 1
    assert judged.verdict.exponent < 0.0
    assert (judged.verdict.first, judged.verdict.last) == (1001, 2000)


def test_inside_the_pack_the_state_has_a_branch_and_a_memory(hammer: "ph.Hammer") -> None:
    period = 3e-3
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), points=2)
    contact = next(c for c in motion.contacts if c.surface == "pack")
    for share, branch, memory in ((0.5, "loading", 0.0), (1.3, "unloading", motion.peak_after(0)[1])):
        t = contact.t_in + share * (contact.t_peak - contact.t_in)
        found = ph.strobe(hammer, period=period, points=1, phase=t / period, verdict=False)
        assert MODE_NAMES[found.branch[0]] == branch
        assert found.memory[0] == pytest.approx(memory, rel=1e-12)
        assert found.x[0] == pytest.approx(motion.at(t)[0][0], rel=1e-9)


def test_a_train_that_hangs_up_is_judged_inside_the_pack(hammer: "ph.Hammer") -> None:
    (found,) = strobes(hammer, ["0.45 ms"], points=3, transient=1000, firings=(301, 400))
    assert (found.x > hammer.front).all()
    assert (found.memory > found.x).all()
    assert found.verdict.period == 1


@pytest.mark.parametrize("phase", [0.0, 0.6])
def test_forced_oscillation_is_a_fixed_point(phase: float) -> None:
    # m x'' + s x = A sin(w t) has the solution A / (s - m w^2) sin(w t).
    amplitude = AMPLITUDE / (STIFFNESS - MASS * OMEGA**2)
    (found,) = strobes(
        oscillator(STIFFNESS),
        drives=[ph.SineForce(AMPLITUDE, FREQUENCY)],
        states=[(0.0, amplitude * OMEGA)],
        phase=phase,
        points=10,
        firings=(401, 500),
        tolerance=1e-12,
    )
    angle = 2.0 * math.pi * phase
    np.testing.assert_allclose(found.x, amplitude * math.sin(angle), atol=1e-9 * amplitude)
    np.testing.assert_allclose(found.v, amplitude * OMEGA * math.cos(angle), atol=1e-9 * amplitude * OMEGA)
    assert found.verdict.name == "period-1"


@pytest.mark.parametrize(("turns", "period"), [(2, 5), (3, 2)])
def test_a_free_oscillation_on_top_has_its_own_period(turns: int, period: int) -> None:
    # The oscillator turns `turns` times in `period` periods of the drive; it is not damped.
    own = OMEGA * turns / period
    (found,) = strobes(
        oscillator(MASS * own**2),
        drives=[ph.SineForce(AMPLITUDE, FREQUENCY)],
        states=[(1e-4, 0.0)],
        points=1,
        firings=(401, 500),
        tolerance=1e-13,
    )
    assert found.verdict.name == f"period-{period}"


def test_a_train_settles_from_any_state(hammer: "ph.Hammer") -> None:
    rest, moved = strobes(
        hammer,
        ["1.3 ms"],
        points=3,
        transient=200,
        states=[(ph.rest_state(hammer), 0.0), (60e-6, 0.2)],
        firings=(150, 200),
    )
    assert rest.verdict.period == moved.verdict.period == 1
    np.testing.assert_allclose(moved.x, rest.x, atol=1e-13)


def test_the_points_do_not_depend_on_company_or_threads(hammer: "ph.Hammer") -> None:
    periods = [1.3e-3, 1.15e-3, 0.8e-3]
    options = {"points": 30, "firings": (101, 200)}
    together = strobes(hammer, periods, threads=2, **options)
    for period, found in zip(periods, together, strict=True):
        (alone,) = strobes(hammer, [period], threads=1, **options)
        assert same(found, alone)
        assert dataclasses.astuple(found.verdict)[:4] == dataclasses.astuple(alone.verdict)[:4]
        assert np.array_equal(
            [found.verdict.exponent, found.verdict.standard_error],
            [alone.verdict.exponent, alone.verdict.standard_error],
            equal_nan=True,
        )


def test_a_run_that_stops_has_a_status_and_no_period(hammer: "ph.Hammer") -> None:
    short = hammer.replace("magnet.range_max", "250 um")
    found = ph.strobe(short, period="1 ms", points=3)
    assert found.status == "range left"
    assert np.isnan(found.x[1:]).all()
    assert (found.branch[1:] == -1).all()
    assert found.verdict.name == "undecided"
    assert "range left" in found.verdict.reason


def test_progress_comes_to_its_end(hammer: "ph.Hammer") -> None:
    told: list[tuple[int, int]] = []
    strobes(
        hammer,
        [1.3e-3, 1.15e-3],
        points=3,
        firings=(11, 60),
        progress=lambda done, total: told.append((done, total)),
    )
    assert told[-1][0] == told[-1][1]
    assert told == sorted(told)


def test_the_window_is_that_of_the_paper(hammer: "ph.Hammer") -> None:
    settings = claims()["poincare_window"].settings
    drive = ph.PulseTrain(hammer.waveform)
    window = window_of(hammer, drive)
    assert window is PAPER_WINDOW
    assert list(window.x) == settings["window_x_m"]
    assert list(window.v) == settings["window_v_m_per_s"]
    wider = window_of(hammer.replace("pack.front", "14 mil"), drive)
    # Twice the way, and as far from the backstop in parts of it.
    assert wider.half_widths[0] == pytest.approx(2.0 * PAPER_WINDOW.half_widths[0])
    assert wider.x[0] - hammer.position == pytest.approx(2.0 * (window.x[0] - hammer.position))
    loose = window_of(oscillator(STIFFNESS), ph.SineForce(AMPLITUDE, FREQUENCY))
    assert (loose.half_widths > 0.0).all()


def test_a_dataset_has_units_and_where_it_comes_from(hammer: "ph.Hammer", tmp_path: Path) -> None:
    (found,) = strobes(hammer, [1.3e-3], points=5, firings=(101, 140))
    chart = found.to_dataset()
    assert {name: chart[name].attrs["units"] for name in chart} == {
        "t": "s",
        "x": "m",
        "v": "m/s",
        "branch": "1",
        "memory": "m",
    }
    assert chart.attrs["hammer_fingerprint"] == hammer.fingerprint
    assert chart.attrs["verdict"] == "period-1"
    path = tmp_path / "points.nc"
    found.save(path)
    with xr.open_dataset(path, engine="scipy") as kept:
        np.testing.assert_array_equal(kept["x"], found.x)
        np.testing.assert_array_equal(kept["firing"], found.firing)
        assert kept.attrs["tolerance"] == "2e-11"
    table = found.to_dataframe()
    assert list(table) == ["firing", "t [s]", "x [m]", "v [m/s]", "branch", "memory [m]"]
    assert set(table["branch"]) <= set(MODE_NAMES)


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({}, "period"),
        ({"period": 1e-3, "rate": 1e3}, "period"),
        ({"period": -1e-3}, "period"),
        ({"period": "1 kg"}, "period"),
        ({"rate": 0.0}, "rate"),
        ({"period": 1e-3, "points": 0}, "points"),
        ({"period": 1e-3, "transient": -1}, "transient"),
        ({"period": 1e-3, "transient": 1.5}, "transient"),
        ({"period": 1e-3, "phase": 1.0}, "phase"),
        ({"period": 1e-3, "phase": -0.1}, "phase"),
        ({"period": 1e-3, "tolerance": 1.0}, "tolerance"),
        ({"period": 1e-3, "state": (math.nan, 0.0)}, "state"),
        ({"drive": ph.SineForce(1.0, 1e3), "period": 1e-3}, "drive"),
    ],
)
def test_what_makes_no_sense_is_refused(hammer: "ph.Hammer", options: dict[str, object], key: str) -> None:
    with refused(key):
        ph.strobe(hammer, **options)


def test_what_does_not_fit_together_is_refused(hammer: "ph.Hammer") -> None:
    with refused("waveform"):
        ph.strobe(hammer.replace("waveform", None), period=1e-3)
    for pulses in (1, 3):
        with refused("drive"):
            ph.strobe(hammer, drive=ph.PulseTrain(hammer.waveform, period=1e-3, pulses=pulses))
    with refused("hammers"):
        strobes([hammer, hammer], [1e-3, 1.1e-3, 1.2e-3])
    with refused("periods"):
        strobes(hammer)
    with refused("periods"):
        strobes(hammer, [])
    with refused("firings"):
        strobes(hammer, [1e-3], firings=(5, 5))


def test_near_a_doubling_a_verdict_rests_on_newtons_method() -> None:
    # States two firings apart agree to 7e-8 of the window, those one firing apart to 7e-6 only.
    hammer = ph.load("hendriks-1983-1")
    assert ph.strobe(hammer, period=1.047408e-3, points=1).verdict.name == "period-1"
    judged = ph.strobe(hammer, period=1.0482e-3, points=1).verdict
    assert judged.name == "period-1"
    assert judged.multiplier == pytest.approx(math.exp(judged.exponent), abs=1e-5)
    assert "Newton's method" in judged.evidence
