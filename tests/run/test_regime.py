import math

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import strobes
from printhammer.drive.waveforms.shapes import HalfSine
from printhammer.run.regime import Regime


def test_period_and_rate(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, period="1.25 ms")
    assert regime == Regime.of(hammer, rate="800 Hz")
    assert regime.with_("rate", 1000.0).period == 1e-3
    assert regime.with_("period", 1e-3).rate == 1000.0
    assert regime.value("period") == 1.25e-3
    assert regime.value("rate") == 800.0


def test_a_rate_and_its_period_are_the_same_firing_times_to_the_last_bit(hammer: ph.Hammer) -> None:
    rates = [1234.0, 700.0, *np.random.default_rng(14).uniform(1.0, 5000.0, 500).tolist()]
    for rate in rates:
        train = ph.PulseTrain(hammer.waveform, rate=rate, pulses=2000)
        for other in (
            ph.PulseTrain(hammer.waveform, period=1.0 / rate, pulses=2000),
            ph.Burst(hammer.waveform, rate=rate, pulses=2000),
            Regime.of(hammer, rate=rate).pulses(2000),
            Regime.of(hammer, period=1.0 / rate).with_("rate", rate).pulses(2000),
        ):
            assert np.array_equal(train.times, other.times)
            assert other.period == train.period


def test_a_regime_stands_for_itself(hammer: ph.Hammer) -> None:
    regime = ph.Regime.of(hammer, rate="1 kHz", phase=0.25)
    assert ph.Regime.of(regime) is regime
    assert ph.Regime.of(regime, phase=0.5) == ph.Regime.of(hammer, period=1e-3, phase=0.5)
    assert regime.at_firings == ph.Regime.of(hammer, rate=1000.0)
    with refused("regime"):
        ph.Regime.of(regime, rate=1000.0, overlap="replace")


def test_verbs_take_a_regime_and_make_it_of_the_short_form(hammer: ph.Hammer) -> None:
    regime = ph.Regime.of(hammer, rate=1234.0, phase=0.25)
    short = {"rate": 1234.0, "phase": 0.25}
    points = [ph.strobe(one, points=5, verdict=False, **how) for one, how in ((regime, {}), (hammer, short))]
    assert np.array_equal(points[0].x, points[1].x)
    assert np.array_equal(points[0].t, regime.pulses(6).times[:5] + 0.25 * regime.period)
    (many,) = strobes([regime], points=5, verdict=False)
    assert np.array_equal(many.x, points[0].x)
    assert ph.section(regime, touches=12).t.tolist() == ph.section(hammer, touches=12, **short).t.tolist()
    intervals = [
        ph.impact_train(ph.section(regime)),
        ph.impact_train(regime),
        ph.impact_train(hammer, **short),
    ]
    assert len({train.fano for train in intervals}) == 1
    assert ph.zero_one(regime).k == ph.zero_one(hammer, **short).k
    assert ph.recurrence(regime).rate > 0.0
    with refused("points"):
        ph.zero_one(points[0], rate=1e3)


def test_constants_of_the_hammer(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, period=1e-3)
    for name in ("mass", "backstop.damping", "waveform.amplitude", "pack.front"):
        assert regime.value(name) == hammer.constants[name].si
        changed = regime.with_(name, 1.01 * regime.value(name))
        assert changed.hammer == hammer.replace(name, 1.01 * regime.value(name))
        assert changed.value(name) == pytest.approx(1.01 * regime.value(name), rel=1e-15)
    assert regime.with_("waveform.amplitude", 0.5).fired.amplitude == 0.5


def test_a_waveform_of_its_own(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, period=1e-3, waveform=HalfSine(amplitude=1.0, width=3e-4))
    assert regime.with_("waveform.width", 2e-4).fired == HalfSine(amplitude=1.0, width=2e-4)
    assert "waveform.rise" not in regime.names
    with refused("constant"):
        regime.value("waveform.rise")


def test_an_endless_force(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, drive=ph.SineForce("1 N", "50 Hz"))
    assert regime.period == 0.02
    assert regime.memory == 0
    assert regime.with_("period", 0.01).drive == ph.SineForce(1.0, 100.0)
    assert regime.with_("drive.amplitude", 2.0).drive == ph.SineForce(2.0, 50.0)
    assert regime.with_("drive.phase", 0.5).value("drive.phase") == 0.5
    with refused("constant"):
        regime.with_("waveform.amplitude", 1.0)


def test_every_name_can_be_replaced(hammer: ph.Hammer) -> None:
    for regime in (
        Regime.of(hammer, period=1e-3),
        Regime.of(hammer, period=1e-3, waveform=HalfSine(amplitude=1.0, width=3e-4)),
        Regime.of(hammer, drive=ph.SineForce("1 N", "50 Hz", "1 rad")),
    ):
        for name in regime.names:
            assert regime.with_(name, regime.value(name)).value(name) == regime.value(name)


@pytest.mark.parametrize("period", [0.3e-3, 0.6e-3, 1.05e-3, 2e-3])
def test_a_train_looks_the_same_at_every_firing_that_counts(hammer: ph.Hammer, period: float) -> None:
    regime = Regime.of(hammer, period=period)
    train, fired_at = regime.train(3)
    since = np.linspace(0.0, period, 400, endpoint=False)
    # Away from the edges, which rounding may move to either side of a sample.
    currents = np.array([train.value(fired_at + k * period + since + 1e-9) for k in range(4)])
    np.testing.assert_allclose(currents[1:], np.broadcast_to(currents[0], (3, 400)), rtol=0.0, atol=1e-6)
    assert train.times[regime.memory] == fired_at
    assert np.array_equal(regime.moments(train, 3, 0.0), train.times[regime.memory : regime.memory + 4])


def test_with_replace_only_one_pulse_counts(hammer: ph.Hammer) -> None:
    assert Regime.of(hammer, period=1e-4, overlap="replace").memory == 1
    assert Regime.of(hammer, period=1e-4).memory == math.ceil(hammer.waveform.support / 1e-4) + 1


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({}, "period"),
        ({"period": 1e-3, "rate": 1e3}, "period"),
        ({"period": -1e-3}, "period"),
        ({"rate": "0 Hz"}, "rate"),
        ({"period": 1e-3, "overlap": "mix"}, "overlap"),
        ({"period": 1e-3, "drive": ph.SineForce(1.0, 1.0)}, "drive"),
    ],
)
def test_bad_input(hammer: ph.Hammer, options: dict, key: str) -> None:
    with refused(key):
        Regime.of(hammer, **options)


def test_more_bad_input(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, period=1e-3)
    with refused("constant"):
        regime.with_("backstop.dampingg", 1.0)
    with refused("mass"):
        regime.with_("mass", -1.0)
    with refused("period"):
        regime.with_("period", 0.0)
    with refused("waveform"):
        Regime.of(ph.Hammer.build("1 g"), period=1e-3)
    train = ph.PulseTrain(hammer.waveform, period=1e-3, pulses=9)
    with refused("drive"):
        Regime.of(hammer, drive=train)
