"""States passed from one run to the next: in the pack, and with coil currents."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import interpreted

import printhammer as ph
from printhammer.chaos import strobes
from printhammer.chaos.bifurcation.columns import run_columns
from printhammer.chaos.strobe.train import FROM_REST
from printhammer.control.least_work.burst import least_work
from printhammer.drive.waveforms.drivers import Capacitor, Chopper, Rail
from printhammer.identify.bench.benches import _currents
from printhammer.printing.rates.damping import damping_study
from printhammer.run.effort import Effort
from printhammer.run.ensemble import MODE_NAMES
from printhammer.run.regime import Regime

Driver = Rail | Chopper | Capacitor

WIDTH = 177e-6
DRIVERS: tuple[Driver, ...] = (
    Rail(voltage=100.0, width=WIDTH, decay="diode", decay_resistance=159.0),
    Chopper(voltage=100.0, width=WIDTH, upper=0.9, lower=0.8),
    Capacitor(voltage=100.0, width=WIDTH, capacitance=2e-6, charging_resistance=50.0),
)


def on_a_rail(*, turn: bool = False) -> ph.Hammer:
    """The shipped hammer with a coil."""
    coil = {"resistance": "28.6 ohm", "inductance": "6.5 mH"}
    if turn:
        coil |= {"turn_resistance": "60 ohm", "leakage": "1 mH"}
    return ph.load("hendriks-1983-1").replace("coil", coil)


@pytest.mark.parametrize(("driver", "turn"), list(itertools.product(DRIVERS, [False, True])))
def test_a_motion_goes_on_from_its_state_at_a_firing(driver: Rail | Chopper | Capacitor, turn: bool) -> None:
    """Also while leaving the pack, while the current decays, and with a half-empty capacitor."""
    # Each driver once at either period, and each coil at both.
    period = 0.3e-3 if turn == isinstance(driver, Chopper) else 0.7e-3
    hammer = on_a_rail(turn=turn)
    stroke = hammer.front - hammer.position
    with interpreted():
        whole = ph.simulate(
            hammer, ph.PulseTrain(driver, period=period, pulses=4), duration=4 * period, tolerance=1e-14
        )
        state = whole.state_at(2 * period)
        after = ph.PulseTrain(driver, period=period, pulses=2)
        rest = ph.simulate(hammer, after, duration=2 * period, state=state, tolerance=1e-14)
        times = 1.999 * period * np.linspace(0.0, 1.0, 101)
        assert len(state) == 7
        assert state[4] > 1e-4
        assert np.abs(rest.at(times)[0] - whole.at(2 * period + times)[0]).max() < 1e-12 * stroke
        assert np.abs(rest.driven_at(times) - whole.driven_at(2 * period + times)).max() < 1e-11


def test_a_motion_goes_on_from_inside_the_pack_under_a_current() -> None:
    hammer, period = ph.load("hendriks-1983-1"), 0.3e-3
    with interpreted():
        train = ph.PulseTrain(hammer.waveform, period=period, pulses=4, overlap="replace")
        whole = ph.simulate(hammer, train, duration=4 * period, tolerance=1e-14)
        states = [whole.state_at(k * period) for k in range(1, 4)]
        after = ph.PulseTrain(hammer.waveform, period=period, pulses=2, overlap="replace")
        rest = ph.simulate(hammer, after, duration=2 * period, state=states[1], tolerance=1e-14)
        times = 1.999 * period * np.linspace(0.0, 1.0, 101)
        assert np.abs(rest.at(times)[0] - whole.at(2 * period + times)[0]).max() < 1e-12 * hammer.front
    assert {len(state) for state in states} == {4}
    assert states[1][2] == MODE_NAMES.index("unloading")


@pytest.mark.parametrize("turn", [False, True])
def test_trains_hand_on_the_current(turn: bool) -> None:
    """Columns of a diagram equal strobes: 2n firings equal n firings twice."""
    hammer = on_a_rail(turn=turn)
    regime = Regime.of(hammer, period=0.7e-3, waveform=DRIVERS[0])
    with interpreted():
        rest = np.array([FROM_REST])
        whole, half = (run_columns([regime], rest, count, 0, Effort(1e-13, threads=1)) for count in (6, 3))
        other = run_columns([regime], half.last, 3, 0, Effort(1e-13, threads=1))
        points = ph.strobe(regime, points=6, tolerance=1e-13, verdict=False)
    assert half.last[0, 4] > 1e-4
    assert half.last[0, 5] > 1e-4 or not turn
    assert np.abs(other.x[0] - whole.x[0, 3:]).max() < 1e-12 * (hammer.front - hammer.position)
    assert np.abs(other.current[0] - whole.current[0, 3:]).max() < 1e-11
    assert points.current == pytest.approx(whole.current[0], abs=1e-11)
    assert points.x == pytest.approx(whole.x[0], abs=1e-15)
    assert "current" in points.to_dataset()


def test_states_of_a_current_driven_train_have_no_current() -> None:
    with interpreted():
        points = ph.strobe(ph.load("hendriks-1983-1"), period=1.3e-3, points=2, verdict=False)
    assert points.current is None
    assert "current" not in points.to_dataset()


def test_a_period_includes_the_current() -> None:
    """With a voltage drive, states repeat with their current; if no state repeats, the exponent decides."""
    with interpreted():
        regular, irregular = (
            strobes(
                on_a_rail(),
                [period],
                waveform=DRIVERS[0],
                points=1,
                firings=(2, 8),
                tolerance=1e-9,
                threads=1,
            )[0]
            for period in (8e-3, 1.3e-3)
        )
    assert regular.verdict is not None
    assert irregular.verdict is not None
    assert regular.verdict.name == "period-1"
    assert irregular.verdict.period is None
    assert np.isfinite(irregular.verdict.exponent)


@pytest.mark.parametrize(
    ("state", "key"),
    [
        ((1e-4,), "state"),
        ((1e-4, 0.0, math.inf), "state"),
        ((1e-4, 0.0, 0.1, 0.2, 0.0), "state"),
        ((1e-4, 0.0, 2.0, 2e-4), "x"),
    ],
)
def test_what_is_no_state_is_refused(state: tuple[float, ...], key: str) -> None:
    with refused(key):
        ph.simulate(on_a_rail(), ph.PulseTrain(DRIVERS[0]), state=state)


def test_a_current_in_a_state_needs_a_voltage() -> None:
    hammer = ph.load("hendriks-1983-1")
    drive = ph.PulseTrain(hammer.waveform)
    with refused("state"):
        ph.simulate(hammer, drive, state=(1e-4, 0.0, 0.1))
    with refused("states"):
        ph.Ensemble(hammer, drive, 1e-3, states=[1e-4, 0.0, 0.1]).run()


def test_members_under_a_voltage_are_single_runs_on_any_number_of_threads() -> None:
    hammer = on_a_rail()
    drives = [ph.PulseTrain(DRIVERS[0], rate=rate, pulses=3) for rate in (900.0, 1000.0, 1100.0)]
    ensemble = ph.Ensemble(hammer, drives, 4e-3, tolerance=1e-9)
    alone, both = (ensemble.run(strobes="firings", threads=count).strobes for count in (1, 2))
    assert alone is not None
    assert both is not None
    assert alone.current is not None
    np.testing.assert_array_equal(alone.x, both.x)
    np.testing.assert_array_equal(alone.current, both.current)
    for member, drive in enumerate(drives):
        motion = ensemble.motion(member)
        assert alone.x[member].tolist() == motion.strobe[1].tolist()
        assert alone.current[member].tolist() == [motion.state_at(t)[4] for t in drive.times.tolist()]
    with refused("engine"):
        ensemble.run(engine="lanes")


def test_sentences_name_the_voltage_and_a_magnet_is_measured_up_to_the_current_of_the_rail() -> None:
    hammer = on_a_rail().replace("waveform", DRIVERS[0])
    for refuse in (
        lambda: least_work(hammer, rate="900 Hz", dots=2),
        lambda: damping_study(hammer),
    ):
        with refused("waveform"):
            refuse()
    assert _currents(hammer).max() == pytest.approx(100.0 / 28.6, rel=1e-12)


def test_the_terminal_shows_the_current_of_strobe_points() -> None:
    with interpreted():
        points = ph.strobe(on_a_rail(), period=1e-3, waveform=DRIVERS[0], points=2, verdict=False)
    (row,) = (line for line in points.summary().text().splitlines() if line.startswith("current"))
    assert row.endswith(" A")
