import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests import sequences
from tests.errors import refused
from tests.hammers import crude

import printhammer as ph
from printhammer.derivatives.parameters import parameter_names, parameters
from printhammer.drive.file import read_drive
from printhammer.drive.segments import END as END_OF_TABLE
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Sine, Trapezoid, Waveform
from printhammer.kernel.model import pulses
from printhammer.kernel.model.layout import END, Train

PULSE = Rectangle(amplitude=0.9, width=350e-6, rise=1e-5, decay=2.4e-5)
SHORT = Trapezoid(amplitude=0.5, rise=0.0, width=2e-4, fall=0.0)
LONG = Trapezoid(amplitude=1.0, rise=0.0, width=2e-3, fall=0.0)


def moments(drive: PulseSequence) -> np.ndarray:
    """Times within, before and after a drive, including all its edges."""
    rng = np.random.default_rng(1)
    every = [time + w.segments()[:, 0] for time, w in zip(drive.times.tolist(), drive.waveforms, strict=True)]
    inside = rng.uniform(-1e-4, drive.end + 1e-4, 20)
    return np.unique(np.concatenate([inside, *every, np.nextafter(np.concatenate(every), -1.0)]))


@settings(max_examples=30)
@given(sequences.sequences())
def test_the_value_is_the_sum_of_the_pulses_or_the_latest_one(drive: PulseSequence) -> None:
    t = np.random.default_rng(1).uniform(-1e-4, 1.1 * drive.end, 15)
    for moment, value in zip(t, drive.value(t), strict=True):
        fired = [k for k, time in enumerate(drive.times) if time <= moment]
        counted = fired[-1:] if drive.overlap == "replace" else fired
        expected = sum(float(drive.waveforms[k].value(moment - drive.times[k])) for k in counted)
        assert value == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert drive.value(float(moment)) == value


@settings(max_examples=18)
@given(sequences.sequences())
def test_the_kernel_has_the_same_value_wherever_it_begins(drive: PulseSequence) -> None:
    firings, begins, pieces, replace, _force = drive.kernel_arrays()
    given = np.array(firings), np.array(begins), np.array(pieces), replace
    count = len(drive.times)
    walked = Train(*given, np.zeros(count, np.int64), np.zeros(1 + 7 * count))
    jumped = Train(*given, np.zeros(count, np.int64), np.zeros(1 + 7 * count))
    first, last = 0, 0
    t = moments(drive)
    expected = drive.value(t)
    for moment, value in zip(t.tolist(), expected.tolist(), strict=True):
        first, last, edge = pulses.pass_edges(moment, walked, first, last)
        _first, _last, edge_too = pulses.edges_at(moment, jumped)
        used = 1 + 7 * int(walked.live[0])
        assert walked.live[:used].tolist() == jumped.live[:used].tolist()
        assert edge == edge_too > moment
        assert (first == last) == (used == 1)
        found = pulses.sum_of_pulses(moment, walked.live) if used > 1 else 0.0
        # Beside an edge of a steep piece a rounding of the time since the firing counts.
        assert found == pytest.approx(value, rel=1e-9, abs=1e-6)


@settings(max_examples=25)
@given(sequences.sequences())
def test_edges_are_where_a_pulse_or_a_piece_begins_or_ends(drive: PulseSequence) -> None:
    firings, begins, pieces, replace, _force = drive.kernel_arrays()
    given = np.array(firings), np.array(begins), np.array(pieces), replace
    train = Train(*given, np.zeros(len(firings), np.int64), np.zeros(1 + 7 * len(firings)))
    edge, found = -1.0, []
    while edge < math.inf:
        edge = pulses.edges_at(edge, train)[2]
        found.append(edge)
    ends = [*drive.times[1:].tolist(), math.inf] if replace else [math.inf] * len(firings)
    expected = {
        time + start
        for time, waveform, cut in zip(drive.times.tolist(), drive.waveforms, ends, strict=True)
        for start in waveform.segments()[:, 0].tolist()
        if time + start < cut
    }
    assert found[:-1] == sorted(expected | set(drive.times.tolist()))


@settings(max_examples=25)
@given(sequences.sequences())
def test_what_is_written_is_read_back_to_the_last_bit(drive: PulseSequence) -> None:
    again = read_drive(drive.to_toml())
    assert again == drive
    assert isinstance(again, PulseSequence)
    assert (again.fingerprint, hash(again)) == (drive.fingerprint, hash(drive))
    assert again.to_toml() == drive.to_toml()
    assert pickle.loads(pickle.dumps(drive)) == drive


@settings(max_examples=25)
@given(sequences.sequences())
def test_the_peak_is_at_least_every_sample_and_reached_by_one(drive: PulseSequence) -> None:
    inside = np.linspace(drive.times[0], drive.end, 20001)
    sampled = np.abs(drive.value(np.concatenate([moments(drive), inside])))
    assert drive.peak >= sampled.max() * (1.0 - 1e-12)
    assert drive.peak <= sampled.max() * (1.0 + 1e-3) + 1e-9
    assert drive.largest_pulse == max(waveform.peak for waveform in drive.waveforms)


def test_what_a_pulse_would_have_reached_had_it_not_been_cut_off_is_not_the_peak() -> None:
    late = Trapezoid(amplitude=1.0, rise=1e-3, width=1e-4, fall=1e-3)
    drive = PulseSequence([late, SHORT], [0.0, 0.25e-3], "replace")
    assert drive.peak == SHORT.peak
    assert drive.largest_pulse == late.peak


@settings(max_examples=25)
@given(sequences.waveforms, st.sampled_from(["add", "replace"]))
def test_equal_waveforms_are_the_train(waveform: Waveform, overlap: Any) -> None:
    times = [0.0, 3e-4, 1e-3]
    train = ph.PulseTrain(waveform, at=times, overlap=overlap)
    drive = PulseSequence([waveform] * 3, times, overlap)
    assert drive == train
    assert (drive.fingerprint, hash(drive)) == (train.fingerprint, hash(train))
    assert (drive.end, drive.peak, drive.overlapping) == (train.end, train.peak, train.overlapping)
    t = np.linspace(0.0, drive.end, 101)
    assert drive.value(t).tolist() == train.value(t).tolist()
    assert drive.uniform


def test_a_long_pulse_outlives_later_ones() -> None:
    drive = PulseSequence([LONG, SHORT, SHORT], [0.0, 0.5e-3, 0.9e-3])
    assert drive.value([0.1e-3, 0.6e-3, 0.8e-3, 1.0e-3, 1.5e-3, 2.0e-3]).tolist() == [
        1.0, 1.5, 1.0, 1.5, 1.0, 0.0,
    ]  # fmt: skip
    assert (drive.overlapping, drive.end, drive.peak) == (2, 2e-3, 1.5)
    assert drive.waveform is LONG
    assert drive.waveforms == (LONG, SHORT, SHORT)
    assert (drive.period, drive.uniform) == (None, False)
    assert repr(drive) == "<PulseSequence: 2 waveforms of current, 3 firings from 0 to 0.9 ms, overlap add>"
    assert repr(PulseSequence([SHORT], [0.0], "replace")) == (
        "<PulseSequence: 1 waveform of current, 1 firing at 0 ms, overlap replace>"
    )


def test_another_order_or_another_waveform_is_another_drive() -> None:
    times = [0.0, 1e-3]
    drives = [PulseSequence(pair, times) for pair in ([PULSE, SHORT], [SHORT, PULSE], [PULSE, PULSE])]
    drives.append(PulseSequence([PULSE, SHORT.scaled(1.1)], times))
    drives.append(PulseSequence([PULSE, SHORT], times, "replace"))
    assert len(set(drives)) == len({drive.fingerprint for drive in drives}) == len(drives)
    assert drives[0] == PulseSequence([PULSE.model_copy(), SHORT.model_copy()], ["0 s", "1 ms"])


def test_a_scaled_sequence() -> None:
    drive = PulseSequence([PULSE, SHORT, PULSE], [0.0, 1e-3, 2e-3])
    stronger = drive.scaled(1.1)
    t = np.linspace(0.0, drive.end, 101)
    np.testing.assert_allclose(stronger.value(t), 1.1 * drive.value(t), rtol=1e-14)
    assert stronger.waveforms[0] == stronger.waveforms[2] == PULSE.scaled(1.1)
    assert drive.waveforms == (PULSE, SHORT, PULSE)
    with refused("factor"):
        drive.scaled(math.nan)


def test_the_same_pulses_at_other_times() -> None:
    drive = PulseSequence([PULSE, SHORT], [0.0, 1e-3], "replace")
    assert drive.with_times(["0 s", "2 ms"]) == PulseSequence([PULSE, SHORT], [0.0, 2e-3], "replace")
    with refused("firing times"):
        drive.with_times([0.0])


def test_the_start_shifts_the_firings() -> None:
    assert PulseSequence([PULSE, SHORT], [0.0, 1e-3], start="1 ms").times.tolist() == [1e-3, 2e-3]


def test_the_tables_lie_one_after_the_other_the_longest_last() -> None:
    _times, begins, pieces, _replace, _force = PulseSequence(
        [LONG, SHORT, LONG], [0.0, 1.0, 2.0]
    ).kernel_arrays()
    assert begins.tolist() == [2, 0, 2]
    assert [row.tolist() for row in pieces[:, :3]] == [
        [0.0, 0.0, 0.5], [2e-4, END, 0.0], [0.0, 0.0, 1.0], [2e-3, END, 0.0],
    ]  # fmt: skip
    assert END == END_OF_TABLE


@pytest.mark.parametrize(
    ("waveforms", "at", "key"),
    [
        ([], [0.0], "waveforms"),
        (PULSE, [0.0], "waveforms"),
        (3, [0.0], "waveforms"),
        ([PULSE, "soft"], [0.0, 1.0], "waveforms[1]"),
        ([PULSE], [0.0, 1.0], "firing times"),
        ([PULSE, PULSE], [1.0, 0.5], "firing times"),
        ([PULSE], [-1.0], "at"),
        ([PULSE], ["1 A"], "firing time"),
        (
            [Sine(amplitude=1.0, frequency=1.0)],
            [0.0],
            "waveforms[0]",
        ),
        (
            [PULSE, HalfSine(amplitude="1 N", width=1e-3)],
            [0.0, 1.0],
            "waveforms[1]",
        ),
    ],
)
def test_bad_input_is_refused_in_one_sentence(waveforms: Any, at: Any, key: str) -> None:
    with refused(key):
        PulseSequence(waveforms, at)


def test_an_unknown_overlap_rule_is_refused() -> None:
    with refused("overlap"):
        PulseSequence([PULSE], [0.0], "sum")  # type: ignore[arg-type]


FILE = """format = 1
[sequence]
at = ["0 us", "700 us", "1.4 ms"]
waveforms = ["print", "soft", "print"]
[waveforms.print]
shape = "rectangle"
amplitude = "0.9 A"
width = "350 us"
rise = "10 us"
decay = "24 us"
[waveforms.soft]
shape = "trapezoid"
amplitude = "0.5 A"
rise = "0 us"
width = "200 us"
fall = "0 us"
"""


def test_a_file_names_the_waveforms() -> None:
    assert read_drive(FILE) == PulseSequence([PULSE, SHORT, PULSE], ["0 us", "700 us", "1.4 ms"])
    assert read_drive(FILE, LONG) == read_drive(FILE)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        (
            '"soft", "print"]',
            '"soft", "hard"]',
            "sequence.waveforms",
        ),
        ('["print", "soft", "print"]', '"print"', "sequence.waveforms"),
        ('["print", "soft", "print"]', '["print"]', "sequence.firing times"),
        ('waveforms = ["print", "soft", "print"]\n', "", "sequence.waveforms"),
        ('rise = "0 us"\n', "", "waveforms.soft.rise"),
        ('shape = "trapezoid"', 'shape = "bell"', "waveforms.soft.shape"),
        ("[waveforms.soft]", "[waveforms.soft]\nsoftness = 1", "waveforms.soft.softness"),
        ("[sequence]", '[waveform]\nshape = "half-sine"\n[sequence]', "waveform"),
        ("format = 1\n", "format = 1\nwaveforms = 3\n", None),
        ("format = 1\n", 'format = 1\noverlap = "sum"\n', "overlap"),
    ],
)
def test_a_bad_file_is_refused_in_one_sentence(old: str, new: str, key: str | None) -> None:
    assert old in FILE
    with refused(key):
        read_drive(FILE.replace(old, new, 1))


def test_waveforms_belong_to_a_sequence() -> None:
    train = FILE.replace('at = ["0 us", "700 us", "1.4 ms"]\n', 'rate = "1 kHz"\npulses = 3\n')
    train = train.replace("[sequence]", "[train]").replace('waveforms = ["print", "soft", "print"]\n', "")
    with refused("waveforms"):
        read_drive(train)


def test_firings_of_their_own_have_no_constants_of_the_pulse() -> None:
    hammer = crude()
    drive = PulseSequence([PULSE, SHORT], [0.0, 1e-3])
    names = parameter_names(hammer, drive)
    assert "firing.1" in names
    assert not [name for name in names if name.startswith("waveform.")]
    with refused("constant"):
        parameters(hammer, drive, ["waveform.width"])
    assert "waveform.width" in parameter_names(hammer, PulseSequence([PULSE, PULSE], [0.0, 1e-3]))


def test_dots_belong_to_their_firings() -> None:
    hammer = crude()
    w = hammer.waveform
    assert w is not None
    spent = w.scaled(1e-3)
    alone = ph.simulate(hammer, ph.PulseTrain(w), duration=4e-3)
    first = next(contact for contact in alone.contacts if contact.surface == "pack")
    times = [0.0, 4e-3, 8e-3]
    drives = [PulseSequence([w, spent, w], times), PulseSequence([spent, w, spent], times)]
    dots = ph.Ensemble(hammer, drives, 12e-3).run(dots=True).dots
    assert dots is not None
    assert dots.struck.tolist() == [[True, False, True], [False, True, False]]
    assert dots.flight_time[0, 0] == pytest.approx(first.t_in, rel=1e-9)
