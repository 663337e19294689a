"""Tables of the synthetic laboratory: seeds, noise, quantisation, outliers, invalid input."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests import hammers
from tests.errors import refused

import printhammer as ph
from printhammer.identify.bench.laboratory import KINDS, SENSORS, SI, UNITS
from printhammer.identify.bench.sensor import Amount, Channel, Sensor, by_quantity, wrong_rows
from printhammer.support.tables.readings import read_table

HAMMER = hammers.crude()
MANY = np.linspace(60e-6, 300e-6, 4000)
OWN = [kind for kind in KINDS if kind != "current"]
"""Kinds of measurement of the paper's hammer, whose waveform is not a voltage."""
RECORD = {"sampling_rate": "200 kHz"}


def short(kind: str) -> dict[str, float]:
    return {"duration": 200e-6} if kind == "motion" else {}


@pytest.mark.parametrize("kind", OWN)
def test_the_same_seed_gives_the_same_bytes_and_another_does_not(kind: str, tmp_path: Path) -> None:
    paths = [tmp_path / f"{number}.csv" for number in range(3)]
    for path, seed in zip(paths, (5, 5, 6), strict=True):
        ph.measure(kind, HAMMER, seed=seed, **short(kind)).write(path)
    first, again, other = (path.read_bytes() for path in paths)
    assert first == again
    assert first != other


def test_kinds_and_columns_do_not_disturb_each_other() -> None:
    """Changing the noise of one quantity does not change the readings of other quantities."""
    plain = ph.measure("magnet", HAMMER, seed=3)
    louder = ph.measure(
        "magnet", HAMMER, seed=3, sensor={"noise": {"displacement": "2 um"}, "outliers": "5 %"}
    )
    assert (plain.values["displacement"] != louder.values["displacement"]).any()
    np.testing.assert_array_equal(plain.values["current"], louder.values["current"])
    good = np.ones(len(plain.values["force"]), bool)
    good[louder.outliers] = False
    np.testing.assert_array_equal(plain.values["force"][good], louder.values["force"][good])
    # The noise of two kinds is not the same stretch of numbers.
    shaken = [ph.measure(kind, HAMMER, seed=3).values["force"][:20] for kind in ("magnet", "spring")]
    exact = [
        ph.measure(kind, HAMMER, sensor={"exact": True}).values["force"][:20] for kind in ("magnet", "spring")
    ]
    apart = np.corrcoef(shaken[0] - exact[0], shaken[1] - exact[1])[0, 1]
    assert abs(apart) < 0.9


@pytest.mark.parametrize("kind", OWN)
def test_a_table_is_read_back_as_it_was_measured(kind: str, tmp_path: Path) -> None:
    measured = ph.measure(kind, HAMMER, seed=1, **short(kind))
    path = tmp_path / "table.csv"
    measured.write(path)
    words = {name: tuple(set(column)) for name, column in measured.words.items()}
    table = read_table(path, {name: SI[name] for name in measured.values}, text=words)
    for name, values in measured.values.items():
        np.testing.assert_allclose(table.values[name], values, rtol=1e-14, atol=1e-20)
    for name, column in measured.words.items():
        assert table.words[name] == list(column)
    assert table.comments == measured.comments
    assert table.comments["hammer"].startswith("hendriks-1983")
    assert table.comments["seed"] == "1"


def test_the_noise_is_as_large_as_stated_and_white() -> None:
    sensor = {
        "exact": True,
        "noise": {"force": "0.1 N", "displacement": "0.3 um", "current": "2 % of full scale"},
    }
    measured = ph.measure("magnet", HAMMER, sensor=sensor, displacements=MANY, currents=[0.5, 1.0])
    full = {"force": 0.1, "displacement": 0.3e-6, "current": 0.02 * 1.0}
    for name, scale in full.items():
        noise = measured.values[name] - measured.true[name]
        count = len(noise)
        assert noise.std() == pytest.approx(scale, rel=5.0 / math.sqrt(2.0 * count))
        assert abs(noise.mean()) < 5.0 * scale / math.sqrt(count)
        assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 5.0 / math.sqrt(count)
    assert (
        abs(np.corrcoef(*(measured.values[n] - measured.true[n] for n in ("force", "current")))[0, 1]) < 0.06
    )


def test_noise_of_the_reading_grows_with_it() -> None:
    speeds = np.repeat([0.2, 1.6], 2000)
    sensor = {"exact": True, "noise": {"rebound speed": "1 % of reading"}}
    measured = ph.measure("backstop", HAMMER, sensor=sensor, speeds=speeds)
    share = measured.values["rebound speed"] / measured.true["rebound speed"] - 1.0
    for part in (share[:2000], share[2000:]):
        assert part.std() == pytest.approx(0.01, rel=0.08)
    np.testing.assert_array_equal(measured.values["impact speed"], speeds)


def test_readings_are_whole_steps_and_have_the_offset() -> None:
    sensor = {
        "exact": True,
        "resolution": {"displacement": "2 um", "force": "0.25 N"},
        "offset": {"force": "-1 N"},
    }
    measured = ph.measure("spring", HAMMER, sensor=sensor)
    steps = measured.values["displacement"] / 2e-6
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)
    assert np.abs(measured.values["displacement"] - measured.true["displacement"]).max() <= 1e-6 * (
        1.0 + 1e-9
    )
    wrong = measured.values["force"] - measured.true["force"] + 1.0
    assert np.abs(wrong).max() <= 0.125 * (1.0 + 1e-9)


@given(full=st.floats(1e-6, 1e9), share=st.floats(1e-5, 0.1))
def test_a_step_that_is_a_share_is_a_round_one_just_below(full: float, share: float) -> None:
    step = Channel(resolution=Amount(share, "of full scale")).step(full)
    assert step <= share * full * (1.0 + 1e-9) < 2.6 * step
    digit = float(f"{step:.3e}".partition("e")[0])
    assert digit in (1.0, 2.0, 5.0)


@given(
    true=st.floats(-1e3, 1e3),
    normal=st.floats(-5.0, 5.0),
    noise=st.floats(0.0, 10.0),
    step=st.floats(1e-3, 1.0),
)
def test_a_reading_is_what_is_there_with_noise_to_half_a_step(
    true: float, normal: float, noise: float, step: float
) -> None:
    channel = Channel(Amount(noise), Amount(step))
    read = channel.readings(np.array([true]), np.array([normal]))[0]
    assert abs(read - (true + noise * normal)) <= 0.5 * step * (1.0 + 1e-9)


def test_outliers_are_as_many_as_asked_and_far_off() -> None:
    measured = ph.measure("pack", HAMMER, sensor={"exact": True, "outliers": 0.1})
    wrong = measured.values["force"] != measured.true["force"]
    assert wrong.sum() == len(measured.outliers) == round(0.1 * len(wrong))
    np.testing.assert_array_equal(np.flatnonzero(wrong), measured.outliers)
    assert measured.comments["outliers"] == f"{wrong.sum()} of {len(wrong)} rows"
    np.testing.assert_array_equal(measured.values["indentation"], measured.true["indentation"])
    rows, errors = wrong_rows(0.5, np.array([-3.0, 100.0] * 1000), np.random.default_rng(0))
    assert len(set(rows.tolist())) == 1000
    assert errors.std() == pytest.approx(10.0, rel=0.15)


def test_a_record_begins_before_the_firing_at_rest() -> None:
    sensor = {"exact": True, "sampling_rate": "500 kHz"}
    measured = ph.measure("motion", HAMMER, sensor=sensor, duration="1 ms", before="50 us")
    t, x = measured.values["time"], measured.values["displacement"]
    assert t[0] == -50e-6
    assert 0.0 in t
    assert t[-1] == 1e-3
    np.testing.assert_allclose(np.diff(t), 2e-6, rtol=1e-9)
    assert (x[t <= 0.0] == ph.rest_state(HAMMER)).all()
    assert (measured.values["current"][t < 0.0] == 0.0).all()
    motion = ph.simulate(HAMMER, ph.PulseTrain(HAMMER.waveform), times=t[t >= 0.0], duration=1e-3)
    np.testing.assert_array_equal(x[t >= 0.0], motion.x)


def test_what_stands_in_the_comments() -> None:
    comments = ph.measure("motion", HAMMER, duration=100e-6, sensor={"bandwidth": "50 kHz"}).comments
    assert comments["bandwidth"] == "50 kHz"
    assert comments["sampling rate"] == "1000 kHz"
    assert comments["displacement"] == "noise 0.2 um, resolution 0.05 um, offset 0 um"
    assert (
        ph.measure("motion", HAMMER, duration=100e-6, sensor={"bandwidth": "none"}).comments["bandwidth"]
        == "none"
    )
    told = ph.measure("backstop", HAMMER).comments["impact speed"]
    assert told == "noise 1 % of reading, resolution none, offset 0 m/s"
    forces = ph.measure("spring", HAMMER, sensor={"noise": {"force": "1 %"}}).comments["force"]
    full = ph.measure("spring", HAMMER, sensor={"exact": True}).values["force"].max()
    assert forces.startswith(f"noise {0.01 * full:.6g} N (1 % of full scale), resolution 0.005 N")


def test_every_quantity_has_a_unit() -> None:
    for sensor in SENSORS.values():
        assert set(sensor.channels) <= set(UNITS)


def test_settings_of_the_command_line() -> None:
    lengths = {"displacement": "m", "indentation": "m", "force": "N"}
    assert by_quantity(["0.2 um", "force=1 %"], "noise", lengths) == {
        "displacement": "0.2 um",
        "indentation": "0.2 um",
        "force": "1 %",
    }


@pytest.mark.parametrize(
    ("kind", "options", "said"),
    [
        ("speed", {}, "kind = 'speed': expected one of magnet, spring, pack, backstop, motion"),
        ("magnet", {"seed": -1}, "seed = -1: expected a whole number, 0 or more"),
        ("magnet", {"sensor": {"loudness": 1}}, "'loudness' is not known: expected one of noise"),
        ("magnet", {"sensor": {"noise": 3}}, "noise = 3: expected amounts by quantity"),
        ("magnet", {"sensor": {"noise": {"force": "3 kg"}}}, "noise of force: the unit 'kg' is a mass"),
        (
            "magnet",
            {"sensor": {"noise": {"force": "-3 N"}}},
            "noise of force = '-3 N': expected 0 or more",
        ),
        ("magnet", {"sensor": {"noise": {"force": "1 % of it"}}}, "'1 % of it': expected nothing"),
        ("magnet", {"sensor": {"noise": {"force": "x %"}}}, "noise of force: 'x %' is not a finite number"),
        (
            "magnet",
            {"sensor": {"noise": {"speed": 3}}},
            "'speed' is not measured: expected one of displacement",
        ),
        (
            "magnet",
            {"sensor": {"resolution": {"force": "1 % of reading"}}},
            "a resolution of reading: expected a resolution with a constant step",
        ),
        ("magnet", {"sensor": {"bandwidth": "1 kHz"}}, "expected this setting for records only"),
        ("magnet", {"sensor": {"outliers": 0.6}}, "outliers = 0.6: expected a fraction from 0 to 50 %"),
        (
            "motion",
            {"sensor": {"bandwidth": "0 Hz"}},
            "bandwidth = '0 Hz': expected greater than 0 Hz",
        ),
        ("motion", {"sensor": {"sampling_rate": "none"}}, "sampling_rate: 'none' is not a finite number"),
        ("motion", {"sensor": RECORD, "duration": "1 us"}, "has no sample after the firing"),
        ("motion", {"duration": "100 s"}, "is too long: expected a shorter record"),
        ("motion", {"before": -1e-6}, "before = -1e-06: expected 0 s or more"),
        (
            "motion",
            {"sensor": Sensor({})},
            "the sensor has no sampling rate: expected a sampling rate, to make a record",
        ),
        ("magnet", {"displacements": [0.0]}, "the magnet has no force at 0 m"),
        ("magnet", {"displacements": []}, "displacements: expected a list of finite numbers in SI"),
        ("magnet", {"currents": ["1 A"]}, "currents: expected a list of finite numbers in SI"),
        ("pack", {"peaks": [-1e-6]}, "peaks and points: expected positive indentations"),
        (
            "pack",
            {"peaks": [1e-3]},
            "a peak of 0.001 m: expected less than the thickness, 0.0001778 m",
        ),
        ("pack", {"points": 1}, "peaks and points: expected positive indentations"),
        ("backstop", {"speeds": [0.0]}, "speeds: expected greater than 0 m/s"),
    ],
)
def test_what_is_refused(kind: str, options: dict, said: str) -> None:
    with pytest.raises(ph.InputError) as caught:
        ph.measure(kind, HAMMER, **options)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"sampling_rate": 0.0}, "sampling_rate"),
        ({"bandwidth": math.inf}, "bandwidth"),
        ({"outliers": 0.7}, "outliers"),
    ],
)
def test_sensors_that_cannot_be(options: dict, key: str) -> None:
    with refused(key):
        Sensor({}, **options)


@pytest.mark.parametrize("kind", OWN)
def test_a_hammer_that_lacks_what_is_measured(kind: str) -> None:
    key = "waveform" if kind == "motion" else kind
    with refused(key):
        ph.measure(kind, HAMMER.replace(key, None))


def test_benches_that_cannot_choose_for_themselves() -> None:
    with refused("current"):
        ph.measure("magnet", HAMMER.replace("waveform", None))
    bare = HAMMER.replace({"pack": None, "platen": None})
    with refused("platen"):
        ph.measure("spring", bare)
    assert len(ph.measure("spring", bare, displacements=[60e-6, 90e-6]).values["force"]) == 2
    soft = HAMMER.replace("pack", hammers.PACKS["dashpot"])
    with refused("pack"):
        ph.measure("pack", soft.replace("waveform", None))
    table = ph.measure("pack", soft, sensor={"exact": True}, peaks=[20e-6], points=4)
    # A linear spring pressed slowly has no loop.
    np.testing.assert_allclose(table.values["force"], 3e5 * table.values["indentation"], rtol=1e-12)


def test_a_drive_by_force_has_no_column_of_currents() -> None:
    pushed = hammers.shelf().replace("waveform", hammers.block(14.0, 300e-6).waveform)
    with hammers.interpreted():
        measured = ph.measure("motion", pushed, duration=100e-6)
    assert set(measured.values) == {"time", "displacement"}
