"""Impact time from coil samples: exact without noise; effects of noise and of unit differences."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.control.impact_estimator import ImpactEstimator, Sampling
from printhammer.control.impact_time import errors_of, root_mean_square, unit_record
from printhammer.control.recorded_impacts import recorded_impacts
from printhammer.printing.rates.variability import Variability


@pytest.fixture(scope="module")
def wire() -> ph.Hammer:
    return ph.load("impact-wire")


@pytest.fixture(scope="module")
def plain(wire: ph.Hammer) -> ImpactEstimator:
    """The estimator for samples that no probe delays or filters."""
    return ImpactEstimator(wire, Sampling(noise=5e-3))


@pytest.fixture(scope="module")
def permanent() -> ph.Hammer:
    """The paper's hammer with a rail driver; the current ends soon after the impact."""
    coil = {"resistance": 28.6, "inductance": "6.547 mH"}
    rail = {"shape": "rail", "voltage": 100.0, "width": "177.24 us", "decay_resistance": "159.1 ohm"}
    return ph.load("hendriks-1983-1").replace({"coil": coil, "waveform": rail})


def signal_of(hammer: ph.Hammer, estimator: ImpactEstimator) -> tuple[Any, float]:
    times = estimator.times
    motion = ph.simulate(hammer, ph.PulseTrain(estimator.pulse), duration=times[-1] + 1e-6, times=times)
    flight = motion.dots[0].flight_time
    assert flight is not None
    return estimator.sampling.of(motion), flight


@pytest.mark.parametrize("rate", [2e5, 1e6])
def test_without_noise_the_time_is_exact(wire: ph.Hammer, rate: float) -> None:
    estimator = ImpactEstimator(wire, Sampling(sampling_rate=rate, bits=24))
    true, flight = signal_of(wire, estimator)
    found = estimator(estimator.sampling.read(true, np.random.default_rng(0)))
    assert found == pytest.approx(flight, abs=1e-8)


def test_the_open_coil_of_a_permanent_magnet_tells_it_too(permanent: ph.Hammer) -> None:
    estimator = ImpactEstimator(permanent, Sampling("voltage", noise=0.05))
    late = permanent.replace("pack.front", permanent.pack.front + 5e-6)  # type: ignore[union-attr]
    for unit in (permanent, late):
        true, flight = signal_of(unit, estimator)
        found = estimator(estimator.sampling.read(true, np.random.default_rng(1)))
        assert found == pytest.approx(flight, abs=1.5e-6)


def test_what_is_sampled_after_its_window_is_not_seen(wire: ph.Hammer) -> None:
    estimator = ImpactEstimator(wire, Sampling(noise=5e-3))
    true, _flight = signal_of(wire, estimator)
    samples = estimator.sampling.read(true, np.random.default_rng(2))
    assert estimator(np.concatenate([samples, np.full(50, np.nan)])) == estimator(samples)


def test_no_impact_is_not_seen(wire: ph.Hammer) -> None:
    estimator = ImpactEstimator(wire, Sampling(noise=5e-3))
    known = {key: 1e-9 * wire.constants[key].si for key in ("pack.stiffness", "pack.damping")}
    times = estimator.times
    motion = ph.simulate(wire.replace(known), ph.PulseTrain(estimator.pulse), duration=1e-3, times=times)
    true = np.concatenate([motion.current, np.full(times.size - motion.current.size, motion.current[-1])])
    assert np.isnan(estimator(estimator.sampling.read(true, np.random.default_rng(3))))


def test_errors_grow_with_noise_and_fall_with_the_sampling_rate(wire: ph.Hammer) -> None:
    study = ph.impact_time(wire, noise=["2 mA", "20 mA"], sampling_rate=["200 kHz", "1 MHz"], units=10)
    deviation = study.deviation[:, :, 0]
    assert (deviation[1] > 3.0 * deviation[0]).all()
    assert (deviation[:, 1] < deviation[:, 0]).all()
    # Four standard deviations of a mean.
    assert (np.abs(study.bias) < 4.0 * study.deviation / np.sqrt(study.dots) + 2e-8).all()
    assert (study.unit_deviation > study.deviation).all()
    assert not study.missed.any()


def test_the_study_is_a_sensor_with_an_offset_of_each_unit(wire: ph.Hammer) -> None:
    study = ph.impact_time(wire, noise=["5 mA"], units=10)
    sensor = study.sensor(seed=3)
    assert sensor.noise == study.deviation[0, 0, 0]
    assert np.hypot(sensor.noise, sensor.offset) == pytest.approx(study.unit_deviation[0, 0, 0])
    flights, forces = np.full(4000, 3e-4), np.ones(4000)
    means = [sensor.read(flights, forces, unit, 0).time.mean() - 3e-4 for unit in range(40)]
    again = [sensor.read(flights, forces, unit, 1).time.mean() - 3e-4 for unit in range(40)]
    # The same in every run, and spread over units as said.
    np.testing.assert_allclose(means, again, atol=0.1 * sensor.noise)
    assert np.std(means) == pytest.approx(sensor.offset, rel=0.4)
    plain = ph.ImpactSensor(noise=sensor.noise, seed=3)
    shown = sensor.read(flights, forces, 0, 0).time - plain.read(flights, forces, 0, 0).time
    np.testing.assert_allclose(shown, shown[0], atol=1e-15)
    with refused("index"):
        ph.impact_time(wire, noise=["5 mA", "9 mA"], dots=2, units=2).sensor()
    with refused("offset"):
        ph.ImpactSensor(offset=-1.0)


def test_few_bits_are_as_bad_as_noise(wire: ph.Hammer) -> None:
    study = ph.impact_time(wire, noise=["1 mA"], bits=[6, 12], units=2)
    assert study.deviation[0, 0, 0] > 2.0 * study.deviation[0, 0, 1]


def shown_by(wire: ph.Hammer, estimator: ImpactEstimator, probe: Sampling) -> tuple[Any, float]:
    """Return noisy samples of the current by a probe with delay and bandwidth, and the true time."""
    times = estimator.step / 20 * np.arange(20 * estimator.count)
    motion = ph.simulate(wire, ph.PulseTrain(estimator.pulse), duration=times[-1] + 1e-6, times=times)
    shown = probe.shown(times, np.asarray(motion.current))[::20]
    flight = motion.dots[0].flight_time
    assert flight is not None
    return estimator.sampling.read(shown, np.random.default_rng(5)), flight


PROBES = [{"delay": 5e-6}, {"bandwidth": 2e4}, {"delay": 2e-5}, {"delay": 3e-6, "bandwidth": 5e4}]


@pytest.mark.parametrize("probe", PROBES)
def test_a_probe_that_is_known_makes_no_bias(wire: ph.Hammer, probe: dict[str, float]) -> None:
    sampling = Sampling(noise=5e-3, **probe)  # type: ignore[arg-type]
    estimator = ImpactEstimator(wire, sampling)
    samples, flight = shown_by(wire, estimator, sampling)
    estimate = estimator.estimate(samples)
    assert estimate.time == pytest.approx(flight, abs=1.5e-6)
    assert not estimate.flag


@pytest.mark.parametrize(
    "probe",
    [{"delay": late} for late in (0.0, 1e-6, 2e-6, 3e-6, 5e-6, 1e-5, 3e-5)]
    + [{"bandwidth": width} for width in (2e5, 1e5, 7e4, 5e4, 2e4, 1e4)],
)
def test_an_estimate_by_a_probe_that_is_not_known_is_near_or_flagged(
    wire: ph.Hammer, plain: ImpactEstimator, probe: dict[str, float]
) -> None:
    """The switch-off lies 5.7 us before the impact: in what the delay leaves of it the filter finds one."""
    estimator = plain
    samples, flight = shown_by(wire, estimator, Sampling(**probe))  # type: ignore[arg-type]
    estimate = estimator.estimate(samples)
    assert estimate.flag == "edge" or abs(estimate.time - flight) < 4e-6
    assert not estimate.flag or probe.get("delay", 0.0) > 1e-6 or probe.get("bandwidth", 1e9) < 1e5


def test_what_the_study_flags_is_not_used(wire: ph.Hammer) -> None:
    asked: dict[str, Any] = {"noise": ["5 mA"], "dots": 10, "units": 5, "delay": "5 us"}
    unknown = ph.impact_time(wire, known=False, **asked)
    assert unknown.flagged[0, 0, 0] == 1.0
    assert np.isnan(unknown.bias[0, 0, 0])
    known = ph.impact_time(wire, **asked)
    assert known.flagged[0, 0, 0] == 0.0
    assert abs(known.bias[0, 0, 0]) < 1e-6


def test_an_armature_that_reaches_its_pole_makes_no_impact_of_its_own() -> None:
    """The current of the relay begins far above that at the touch, and without a pack it meets its pole.

    Both bent the signal like an impact: errors reached 1 ms, and no estimate was flagged.
    """
    study = ph.impact_time(ph.load("relay-5v"), noise=["0.2 mA"], dots=24, units=12)
    assert np.hypot(study.unit_bias, study.unit_deviation)[0, 0, 0] < 4e-6
    assert study.flight_deviation > 1e-4
    assert not study.unit_flagged.any()
    assert not study.unit_missed.any()


DEVICES = ("relay-5v", "pot-magnet", "pinball-coil", "dot-peen", "impact-wire", "braille-embosser")
SMOOTH = "braille-embosser"  # Its soft contact is most of the flight: the current hardly tells the impact


@pytest.mark.slow
@pytest.mark.parametrize("name", DEVICES)
def test_estimates_of_random_devices_are_right_or_flagged(name: str) -> None:
    """Mass, resistance and gap of a device are drawn, then units of that device."""
    base, rng = ph.load(name), np.random.default_rng(34)
    for _ in range(4):
        factors = {"mass": 2.0, "coil.resistance": 1.2, "pack.front": 1.1}
        device = base.replace(
            {key: base.constants[key].si * most ** rng.uniform(-1, 0) for key, most in factors.items()}
        )
        scale = float(np.abs(ph.simulate(device, ph.PulseTrain(device.waveform)).current).max())
        try:
            estimator = ImpactEstimator(device, Sampling("current", 1e-3 * scale))
        except ph.InputError:
            continue  # The current is over before the impact.
        units = Variability.of(device).draw(device, 28, 1)
        records = [unit_record(unit, estimator, estimator.sampling) for unit in units]
        errors, believed = errors_of(estimator, records, len(records), rng)
        stated = root_mean_square(errors[:20][believed[:20]])
        worst = float(np.abs(errors[20:][believed[20:]]).max(initial=0.0))
        assert worst < (4.0 * stated if name == SMOOTH else 0.25 * estimator.contact)
        assert believed.mean() > 0.5 or name == "impact-wire"


def test_clipped_readings_are_not_searched() -> None:
    relay = ph.load("relay-5v")
    estimator = ImpactEstimator(relay, Sampling(noise=2e-4, full_scale=0.045))
    units = Variability.of(relay).draw(relay, 6, 0)
    records = [unit_record(unit, estimator, estimator.sampling) for unit in units]
    errors, believed = errors_of(estimator, records, len(records), np.random.default_rng(0))
    assert np.abs(errors[believed & np.isfinite(errors)]).max(initial=0.0) < 1e-5


def test_an_estimate_no_better_than_the_nominal_time_is_vague(tmp_path: Path) -> None:
    """The current of the embosser, whose contact exceeds half its flight, shows the impact only weakly."""
    embosser = ph.load(SMOOTH)
    soft = embosser.replace("pack.stiffness", 0.2 * embosser.constants["pack.stiffness"].si)
    path = tmp_path / "shot.csv"
    ph.measure("current", soft, sensor={"sampling_rate": "100 kHz"}, duration="12 ms").write(path)
    impacts = recorded_impacts(soft, [path])
    assert impacts.flag[0] or impacts.uncertainty[0] > 3e-5


def test_impacts_in_recorded_files(wire: ph.Hammer, tmp_path: Path) -> None:
    paths = [tmp_path / f"{k}.csv" for k in range(2)]
    sensor = {"sampling_rate": "500 kHz", "bandwidth": "100 kHz"}
    for seed, path in enumerate(paths):
        ph.measure("current", wire, seed=seed, sensor=sensor, duration="1 ms").write(path)
    impacts = recorded_impacts(wire, paths)
    assert impacts.record == ("0.csv", "1.csv")
    np.testing.assert_allclose(impacts.time, impacts.flight_time, atol=2e-6)
    assert set(impacts.flag) == {""}
    assert (impacts.uncertainty > 1e-6).all()
    assert (impacts.uncertainty < 5e-6).all()
    # As an oscilloscope shows it, by a clamp that is inverted and 3 us late.
    rows = [line.split(",") for line in paths[0].read_text("utf-8").splitlines() if line[:1] in "-0123456789"]
    body = "".join(f"{float(t) + 3.0};{-0.1 * float(i):.7f}\n" for t, i in rows)
    scope = tmp_path / "scope.csv"
    scope.write_text("Time;Channel A\n(us);(V)\n\n" + body, "utf-8")
    columns = "time=1, current=2*-10 A/V, delay(current)=3 us"
    shown = recorded_impacts(wire, [scope], bandwidth="100 kHz", columns=columns)
    assert shown.time[0] == pytest.approx(impacts.time[0], abs=2e-7)
    paths[0].write_text("time [us],current [A]\n" + "\n".join(f"{k},0.5" for k in range(90)), "utf-8")
    with refused("time"):
        recorded_impacts(wire, paths)


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({"signal": "voltage"}, "signal"),
        ({"noise": ["2 A"]}, "signal"),
        ({"noise": ["-1 mA"]}, "noise"),
        ({"sampling_rate": ["20 kHz"]}, "sampling_rate"),
        ({"bits": [0]}, "bits"),
        ({"bits": [30]}, "bits"),
        ({"dots": 1}, "dots"),
        ({"signal": "charge"}, "signal"),
        ({"delay": "-1 us"}, "delay"),
        ({"bandwidth": "0 Hz"}, "bandwidth"),
    ],
)
def test_what_cannot_be_used(wire: ph.Hammer, wrong: dict[str, Any], key: str) -> None:
    with refused(key):
        ph.impact_time(wire, **wrong)


def test_a_pulse_that_is_over_before_the_impact_says_so(permanent: ph.Hammer) -> None:
    fast = permanent.replace({"waveform.decay": "zener", "waveform.decay_voltage": 300.0})
    with refused("signal"):
        ph.impact_time(fast)


def test_a_current_without_a_circuit_tells_nothing() -> None:
    with refused("waveform"):
        ph.impact_time(ph.load("hendriks-1983-1"))
