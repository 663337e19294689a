import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.errors import refused

from printhammer.drive.input import even_times
from printhammer.drive.trains import Burst, Drive, Overlap, PulseTrain, SineForce
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Sampled, Sine, Trapezoid, Waveform
from printhammer.kernel.model.layout import END

PULSE = Rectangle(amplitude=0.9, width=350e-6, rise=1e-5, decay=2.4e-5)

widths = st.floats(1e-5, 2e-3)
edges = st.one_of(st.just(0.0), st.floats(1e-6, 5e-4))
amplitudes = st.floats(-2.0, 2.0)
waveforms: st.SearchStrategy[Waveform] = st.one_of(
    st.builds(HalfSine, amplitude=amplitudes, width=widths),
    st.builds(Rectangle, amplitude=amplitudes, width=widths, rise=edges, decay=edges),
    st.builds(Trapezoid, amplitude=amplitudes, rise=edges, width=widths, fall=edges),
)
firings = st.lists(st.integers(0, 400), min_size=1, max_size=8, unique=True).map(
    lambda ticks: np.sort(np.array(ticks)) * 1e-5
)
overlaps: st.SearchStrategy[Overlap] = st.sampled_from(["add", "replace"])


@given(waveforms, firings, overlaps)
def test_value_is_the_sum_of_the_pulses_or_the_latest_one(
    waveform: Waveform, times: np.ndarray, overlap: Overlap
) -> None:
    drive = PulseTrain(waveform, at=times, overlap=overlap)
    t = np.random.default_rng(1).uniform(-1e-4, times[-1] + 1.2 * waveform.support, 200)
    expected = np.zeros(len(t))
    for fire in times:
        fired = t >= fire
        if overlap == "replace":
            expected[fired] = 0.0
        expected[fired] += waveform.value(t[fired] - fire)
    assert drive.value(t) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@settings(max_examples=50)
@given(waveforms, firings, overlaps)
def test_peak_is_at_least_every_sample_and_reached_by_one(
    waveform: Waveform, times: np.ndarray, overlap: Overlap
) -> None:
    drive = PulseTrain(waveform, at=times, overlap=overlap)
    every_edge = np.add.outer(times, drive.segments()[:, 0]).ravel()
    inside = np.linspace(times[0], drive.end, 20001)
    sampled = np.abs(drive.value(np.concatenate([every_edge, np.nextafter(every_edge, -1.0), inside])))
    assert drive.peak >= sampled.max() * (1.0 - 1e-12)
    assert drive.peak <= sampled.max() * (1.0 + 1e-3) + 1e-9


@settings(max_examples=30)
@given(waveforms, st.floats(100.0, 20e3), st.integers(1, 12))
def test_peak_of_an_even_train_is_that_of_the_same_times(waveform: Waveform, rate: float, count: int) -> None:
    train = PulseTrain(waveform, rate=rate, pulses=count)
    assert train.peak == pytest.approx(train.with_times(train.times).peak, rel=1e-9)


def test_edges_are_right_continuous_at_the_rounded_sum_of_firing_and_edge() -> None:
    pulse = Rectangle(amplitude=1.0, width=3.3e-4, rise=0.0, decay=0.0)
    drive = PulseTrain(pulse, rate=1234.5, pulses=200)
    off = drive.times + 3.3e-4
    assert drive.value(drive.times).tolist() == [1.0] * 200
    assert drive.value(np.nextafter(drive.times, -1.0)).tolist() == [0.0] * 200
    assert drive.value(off).tolist() == [0.0] * 200
    assert drive.value(np.nextafter(off, 0.0)).tolist() == [1.0] * 200


def test_overlapping_pulses_add_or_the_latest_cuts_off_the_others() -> None:
    pulse = Trapezoid(amplitude=1.0, rise=0.0, width=1e-3, fall=0.0)
    times = [0.0, 0.4e-3, 0.8e-3]
    t = [0.2e-3, 0.6e-3, 0.9e-3, 1.1e-3, 1.5e-3, 1.9e-3]
    added = PulseTrain(pulse, at=times)
    assert added.value(t).tolist() == [1.0, 2.0, 3.0, 2.0, 1.0, 0.0]
    assert (added.overlapping, added.peak) == (3, 3.0)
    replaced = PulseTrain(pulse, at=times, overlap="replace")
    assert replaced.value(t).tolist() == [1.0, 1.0, 1.0, 1.0, 1.0, 0.0]
    assert (replaced.overlapping, replaced.peak) == (1, 1.0)


def test_replacing_drops_to_the_start_of_the_next_pulse() -> None:
    drive = PulseTrain(HalfSine(amplitude=1.0, width=1e-3), at=[0.0, 0.5e-3], overlap="replace")
    before, after = drive.value([np.nextafter(0.5e-3, 0.0), 0.5e-3])
    assert before == pytest.approx(1.0)
    assert after == 0.0


def test_a_train_by_rate_and_one_by_period() -> None:
    by_rate = PulseTrain(PULSE, rate="1.2 kHz", pulses=9)
    np.testing.assert_array_equal(by_rate.times, np.arange(9) / 1200.0)
    assert by_rate.period == 1.0 / 1200.0
    by_period = PulseTrain(PULSE, period="1.05 ms", pulses=4, start="1 ms")
    np.testing.assert_array_equal(by_period.times, 1e-3 + np.arange(4) * 1.05e-3)
    assert by_period.period == 1.05e-3
    assert not by_period.times.flags.writeable


def test_even_times_need_a_rate_or_a_period() -> None:
    with refused("rate"):
        even_times(None, None, 3)


def test_given_times_and_a_single_pulse() -> None:
    drive = PulseTrain(PULSE, at=["0 us", "700 us", 1e-3])
    assert drive.times.tolist() == [0.0, 700e-6, 1e-3]
    assert drive.period is None
    assert PulseTrain(PULSE, at=np.array([0, 1]), start=0.5).times.tolist() == [0.5, 1.5]
    assert PulseTrain(PULSE).times.tolist() == [0.0]
    assert PulseTrain(PULSE, start="1 ms").times.tolist() == [1e-3]


def test_bursts_repeat_after_the_gap() -> None:
    burst = Burst(PULSE, "1 kHz", 3, 2, "5 ms", start=1e-3)
    np.testing.assert_allclose(burst.times, [1e-3, 2e-3, 3e-3, 8e-3, 9e-3, 10e-3], rtol=1e-14)
    assert burst.period is None
    assert Burst(PULSE, period=1e-3, pulses=3).period == 1e-3


def test_a_sinusoidal_force_has_one_endless_segment() -> None:
    drive = SineForce("2 N", "50 Hz", "90 deg")
    assert drive.times.tolist() == [0.0]
    assert drive.segments().shape == (2, 6)
    assert drive.quantity == "force"
    assert drive.period == 0.02
    assert drive.end == math.inf
    assert drive.peak == pytest.approx(2.0)
    assert drive.value([-1.0, 0.0, 0.01, 0.02]) == pytest.approx([0.0, 2.0, -2.0, 2.0])


def test_pulses_of_force_are_a_force_drive() -> None:
    pulse = HalfSine(amplitude="3 lbf", width="1 ms")
    times, begins, pieces, replace, force = PulseTrain(
        pulse, rate=100.0, pulses=3, overlap="replace"
    ).kernel_arrays()
    assert times.tolist() == [0.0, 0.01, 0.02]
    assert begins.tolist() == [0, 0, 0]
    np.testing.assert_array_equal(pieces[:-1], pulse.segments()[:-1])
    assert pieces[-1].tolist() == [pulse.support, END, 0.0, 0.0, 0.0, 0.0]
    assert (replace, force) == (True, True)
    assert PulseTrain(PULSE).kernel_arrays()[3:] == (False, False)


def test_changed_copies_leave_the_drive_alone() -> None:
    drive = PulseTrain(PULSE, rate=1000.0, pulses=3, overlap="replace")
    stronger = drive.scaled(1.1)
    np.testing.assert_allclose(stronger.value(2e-4), 1.1 * drive.value(2e-4), rtol=1e-14)
    moved = drive.with_times([0.0, 5e-4])
    assert (moved.times.tolist(), moved.overlap, moved.waveform) == ([0.0, 5e-4], "replace", PULSE)
    other = drive.with_waveform(HalfSine(amplitude=1.0, width=1e-4))
    assert other.waveform.shape == "half-sine"
    assert drive.waveform is PULSE
    assert SineForce(1.0, 50.0).scaled(3.0).peak == pytest.approx(3.0)


def test_drives_that_do_the_same_are_equal() -> None:
    one = PulseTrain(PULSE, rate=1000.0, pulses=3)
    same = PulseTrain(PULSE, at=one.times)
    assert one == same
    assert hash(one) == hash(same)
    assert one.fingerprint == same.fingerprint
    for other in (
        PulseTrain(PULSE, rate=1000.0, pulses=4),
        PulseTrain(PULSE, rate=1000.0, pulses=3, overlap="replace"),
        one.scaled(1.1),
        PulseTrain(PULSE.model_copy(update={"quantity": "force"}), rate=1000.0, pulses=3),
    ):
        assert one != other
        assert one.fingerprint != other.fingerprint
    assert one != 3


def test_a_drive_is_told_in_one_line_and_pickled() -> None:
    drive = PulseTrain(PULSE, rate="1.2 kHz", pulses=9)
    assert repr(drive) == ("<PulseTrain: rectangle current, 9 firings from 0 to 6.66667 ms, overlap add>")
    assert repr(SineForce(1.0, 2.0)) == "<SineForce: sine force, 1 firing at 0 ms, overlap add>"
    assert pickle.loads(pickle.dumps(drive)) == drive


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"rate": 0.0, "pulses": 3}, "rate"),
        ({"rate": -1.0, "pulses": 3}, "rate"),
        ({"rate": math.nan, "pulses": 3}, "rate"),
        ({"rate": "1.2 kN", "pulses": 3}, "rate"),
        ({"rate": "1.2", "pulses": 3}, "rate"),
        ({"rate": None, "pulses": 3}, "pulses"),
        ({"rate": True, "pulses": 3}, "rate"),
        ({"period": 0.0, "pulses": 3}, "period"),
        ({"period": "0 ms", "pulses": 3}, "period"),
        ({"period": math.inf, "pulses": 3}, "period"),
        ({"rate": 1.0, "period": 1.0, "pulses": 3}, "period"),
        ({"rate": 1.0, "at": [0.0]}, "at"),
        ({"rate": 1.0, "pulses": 0}, "pulses"),
        ({"rate": 1.0, "pulses": 2.5}, "pulses"),
        ({"rate": 1.0, "pulses": True}, "pulses"),
        ({"rate": 1.0, "pulses": 10**12}, "pulses"),
        ({"at": [0.0], "pulses": 1}, "pulses"),
        ({"at": []}, "at"),
        ({"at": 1.0}, "at"),
        ({"at": "0 us"}, "at"),
        ({"at": [[0.0, 1.0]]}, "firing time"),
        ({"at": np.zeros((2, 2))}, "firing times"),
        ({"at": [0.0, 0.0]}, "firing times"),
        ({"at": [1.0, 0.5]}, "firing times"),
        ({"at": [-1.0, 0.5]}, "at"),
        ({"at": [0.0, math.nan]}, "firing time"),
        ({"at": np.array([0.0, math.inf])}, "at"),
        ({"at": [0.0, "x"]}, "firing time"),
        ({"rate": 1.0, "pulses": 2, "start": -1.0}, "start"),
        ({"rate": 1.0, "pulses": 2, "overlap": "both"}, "overlap"),
        ({"period": 1e-20, "pulses": 2, "start": 1.0}, "firing times"),
    ],
)
def test_a_bad_train_is_one_sentence(arguments: dict[str, object], key: str) -> None:
    with refused(key):
        PulseTrain(PULSE, **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"pulses": 3}, "rate"),
        ({"rate": 1.0, "period": 1.0, "pulses": 3}, "rate"),
        ({"rate": 1.0}, "pulses"),
        ({"rate": 1.0, "pulses": 3, "bursts": 2}, "bursts"),
        ({"rate": 1.0, "pulses": 3, "bursts": 2, "gap": 0.0}, "gap"),
        ({"rate": 1.0, "pulses": 3, "bursts": 0, "gap": 1.0}, "bursts"),
        ({"rate": 1.0, "pulses": 10**6, "bursts": 10**6, "gap": 1.0}, "pulses"),
    ],
)
def test_a_bad_burst_is_one_sentence(arguments: dict[str, object], key: str) -> None:
    with refused(key):
        Burst(PULSE, **arguments)  # type: ignore[arg-type]


def test_what_is_not_a_pulse_is_refused() -> None:
    with refused("waveform"):
        PulseTrain(None, rate=1.0, pulses=2)  # type: ignore[arg-type]
    endless = Sine(amplitude=1.0, frequency=50.0)
    with refused("waveform"):
        PulseTrain(endless, rate=1.0, pulses=2)
    with refused("waveform"):
        PulseTrain(PULSE).with_waveform(endless)
    with refused("waveform"):
        PulseTrain(PULSE).with_waveform(3)  # type: ignore[arg-type]
    with refused("frequency"):
        SineForce(1.0, 0.0)
    with refused("factor"):
        PulseTrain(PULSE).scaled(math.nan)


def test_a_drive_of_a_record_starts_with_its_first_sample() -> None:
    record = Sampled.from_samples([1e-4, 2e-4, 3e-4], [0.5, 1.0, 0.0], interpolation="linear")
    drive: Drive = PulseTrain(record, at=[1e-3])
    assert drive.value([1e-3, 1.05e-3, 1.15e-3, 1.3e-3]) == pytest.approx([0.0, 0.0, 0.75, 0.0])
