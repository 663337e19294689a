from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.errors import refused

from printhammer.drive.file import load_drive, read_drive, save_drive
from printhammer.drive.trains import Burst, Drive, PulseTrain, SineForce
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Sampled, Trapezoid, Waveform
from printhammer.errors import InputError

PULSE = Rectangle(amplitude=0.9, width=350e-6, rise=1e-5, decay=2.4e-5)
TRAIN = 'format = 1\n[train]\nrate = "1.2 kHz"\npulses = 9\n'
HALF = '[waveform]\nshape = "half-sine"\namplitude = "1 A"\nwidth = "350 us"\n'

positive = st.floats(1e-6, 1e3)
spans = st.one_of(st.just(0.0), positive)
values = st.floats(-1e3, 1e3)
quantities = st.sampled_from(["current", "force"])
samples = st.lists(values, min_size=2, max_size=6)
waveforms: st.SearchStrategy[Waveform] = st.one_of(
    st.builds(HalfSine, amplitude=values, width=positive, quantity=quantities),
    st.builds(Rectangle, amplitude=values, width=positive, rise=spans, decay=spans, quantity=quantities),
    st.builds(Trapezoid, amplitude=values, rise=spans, width=positive, fall=spans, quantity=quantities),
    st.builds(
        lambda y, step, how, what: Sampled.from_samples(
            np.arange(len(y)) * step, y, interpolation=how, quantity=what
        ),
        samples,
        positive,
        st.sampled_from(["pchip", "linear"]),
        quantities,
    ),
)
overlaps = st.sampled_from(["add", "replace"])
counts = st.integers(1, 9)
drives: st.SearchStrategy[Drive] = st.one_of(
    st.builds(PulseTrain, waveforms, rate=positive, pulses=counts, overlap=overlaps, start=spans),
    st.builds(PulseTrain, waveforms, period=positive, pulses=counts, overlap=overlaps),
    st.builds(
        PulseTrain, waveforms, at=st.lists(spans, min_size=1, unique=True).map(sorted), overlap=overlaps
    ),
    st.builds(Burst, waveforms, positive, counts, counts, positive, overlap=overlaps),
    st.builds(SineForce, values, positive, values),
)


@settings(max_examples=50)
@given(drives)
def test_what_is_written_is_read_back_to_the_last_bit(drive: Drive) -> None:
    again = read_drive(drive.to_toml())
    assert again == drive
    assert type(again) is type(drive)
    assert again.period == drive.period
    assert again.to_toml() == drive.to_toml()


def test_a_file_is_saved_and_loaded(tmp_path: Path) -> None:
    path = tmp_path / "train.toml"
    drive = Burst(PULSE, "1.2 kHz", 3, 2, "5 ms", overlap="replace")
    save_drive(drive, path)
    assert load_drive(path) == drive
    with refused("drive"):
        save_drive(drive, tmp_path / "none" / "train.toml")


def test_the_waveform_is_the_one_of_the_file_or_else_the_given_one() -> None:
    assert read_drive(TRAIN, PULSE) == PulseTrain(PULSE, rate=1200.0, pulses=9)
    half = HalfSine(amplitude=1.0, width=350e-6)
    assert read_drive(TRAIN + HALF, PULSE) == PulseTrain(half, rate=1200.0, pulses=9)
    with refused("[waveform]"):
        read_drive(TRAIN)


def test_quantities_are_strings_or_tables_in_either_system() -> None:
    text = (
        'format = 1\noverlap = "replace"\n[times]\nat = { values = [0, 700], unit = "us" }\nstart = "1 ms"\n'
    )
    drive = read_drive(text, PULSE)
    np.testing.assert_allclose(drive.times, [1e-3, 1.7e-3], rtol=1e-15)
    assert drive.overlap == "replace"
    force = '[waveform]\nshape = "half-sine"\namplitude = { value = 2, unit = "lbf" }\nwidth = "1 ms"\n'
    assert read_drive(TRAIN + force).peak == pytest.approx(2 * 4.4482216152605, rel=1e-12)
    assert read_drive(TRAIN + force).quantity == "force"
    sine = 'format = 1\n[sine]\namplitude = "1 N"\nfrequency = "50 Hz"\n'
    assert read_drive(sine) == SineForce(1.0, 50.0)


def test_a_sampled_waveform_lies_beside_the_drive_file(tmp_path: Path) -> None:
    (tmp_path / "pulse.csv").write_text("time [us],current [A]\n0,0\n100,1\n200,0\n")
    path = tmp_path / "drive.toml"
    path.write_text(TRAIN + '[waveform]\nshape = "sampled"\nfile = "pulse.csv"\ninterpolation = "linear"\n')
    drive = load_drive(path)
    assert drive.value(50e-6) == pytest.approx(0.5)
    # The samples travel with the drive.
    assert read_drive(drive.to_toml()) == drive


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("", "format"),
        ("format = 2", "format"),
        ("format = true", "format"),
        ("format = 1", "drive"),
        ("train", None),
        ("format = " + "1" * 5000, None),
        ("format = 1\ntrain = 3", "train"),
        ("format = 1\n[train]\n[sine]", "drive"),
        ('format = 1\n"a\\nb" = 1', "'a\\nb'"),
        ("format = 1\n[tarin]", "tarin"),
        ("format = 1\n[train]\npulses = 9", "train.rate"),
        ('format = 1\n[burst]\nrate = "1 kHz"', "burst.pulses"),
        ('format = 1\n[train]\nrate = "1 kHz"\nperiod = "1 ms"\npulses = 2', "train.period"),
        ("format = 1\n[train]\nrate = 1200\npulses = 9", "train.rate"),
        ('format = 1\n[train]\nrate = "1200"\npulses = 9', "train.rate"),
        ('format = 1\n[train]\nrate = "3 lbf"\npulses = 9', "train.rate"),
        ('format = 1\n[train]\nrate = "0 Hz"\npulses = 9', "train.rate"),
        ('format = 1\n[train]\nperiod = "0 s"\npulses = 9', "train.period"),
        ('format = 1\n[train]\nperiod = "-1 s"\npulses = 9', "train.period"),
        ("format = 1\n[train]\nrate = { value = nan, unit = 'Hz' }\npulses = 9", "train.rate"),
        ("format = 1\n[train]\nrate = { value = 3 }\npulses = 9", "train.rate.unit"),
        ("format = 1\n[train]\nrate = { value = 3, unit = 4 }\npulses = 9", "train.rate.unit"),
        ("format = 1\n[train]\nrate = { value = 3, unit = 'Hz', x = 1 }\npulses = 9", "train.rate.x"),
        ("format = 1\n[train]\nrate = { value = 'a', unit = 'Hz' }\npulses = 9", "train.rate"),
        ('format = 1\n[train]\nrate = "1 Hz"\npulses = "9"', "train.pulses"),
        ('format = 1\n[train]\nrate = "1 Hz"\npulses = 9\npuls = 1', "train.puls"),
        ('format = 1\noverlap = "both"\n[train]\nrate = "1 Hz"\npulses = 9', "overlap"),
        ("format = 1\n[times]", "times.at"),
        ("format = 1\n[times]\nat = 3", "times.at"),
        ("format = 1\n[times]\nat = [0, 1]", "times.at"),
        ("format = 1\n[times]\nat = []", "times.at"),
        ("format = 1\n[times]\nat = { values = 1, unit = 's' }", "times.at.values"),
        ("format = 1\n[times]\nat = { values = [1, 1], unit = 's' }", "times.firing times"),
        ('format = 1\n[burst]\nrate = "1 Hz"\npulses = 9\nbursts = 2', "burst.bursts"),
        ('format = 1\n[sine]\namplitude = "1 N"', "sine.frequency"),
        ('format = 1\n[sine]\namplitude = "1 A"\nfrequency = "1 Hz"', "sine.amplitude"),
        ('format = 1\noverlap = "replace"\n[sine]\namplitude = "1 N"\nfrequency = "1 Hz"', "overlap"),
        ('format = 1\n[sine]\namplitude = "1 N"\nfrequency = "1 Hz"\n' + HALF, "waveform"),
        (TRAIN + "[waveform]", "waveform.shape"),
        (TRAIN + 'waveform = 3\n[waveform]\nshape = "sine"', "train.waveform"),
        (TRAIN + '[waveform]\nshape = "sine"', "waveform.shape"),
        (TRAIN + '[waveform]\nshape = ["half-sine"]', "waveform.shape"),
        (TRAIN + HALF + 'rise = "1 us"', "waveform.rise"),
        (TRAIN + HALF.replace("350", "0"), "waveform.width"),
        (TRAIN + HALF.replace("1 A", "1 W"), "waveform.amplitude"),
        (TRAIN + HALF.replace('width = "350 us"', ""), "waveform.width"),
        (TRAIN + '[waveform]\nshape = "sampled"', "waveform"),
        (TRAIN + '[waveform]\nshape = "sampled"\nfile = 3', "waveform.file"),
        (TRAIN + '[waveform]\nshape = "sampled"\nfile = "none.csv"', None),
        (TRAIN + '[waveform]\nshape = "sampled"\nfile = "a.csv"\nstep = 1', "waveform.step"),
        (
            TRAIN + '[waveform]\nshape = "sampled"\ntime = { values = [0, 1], unit = "s" }\n'
            'current = { values = [0, 1], unit = "A" }\ninterpolation = "cubic"',
            "waveform.interpolation",
        ),
        (
            TRAIN + '[waveform]\nshape = "sampled"\ntime = { values = [1, 0], unit = "s" }\n'
            'current = { values = [0, 1], unit = "A" }',
            "times",
        ),
    ],
)
def test_a_bad_file_is_one_sentence_that_names_it(tmp_path: Path, text: str, key: str | None) -> None:
    path = tmp_path / "drive.toml"
    path.write_text(text)
    with refused(key) as caught:
        load_drive(path, PULSE)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message


def test_a_file_that_cannot_be_read_is_one_sentence(tmp_path: Path) -> None:
    with refused(None, file="none.toml"):
        load_drive(tmp_path / "none.toml")
    (tmp_path / "noise.toml").write_bytes(bytes(range(128, 256)))
    with refused(None, file="noise.toml"):
        load_drive(tmp_path / "noise.toml")


toml_values = st.recursive(
    st.one_of(
        st.integers(-5, 5).map(str),
        st.floats().map(repr),
        st.sampled_from(["true", '"1 Hz"', '"3 us"', '"x"', "1979-05-27", '"half-sine"', '"A"', '"Hz"']),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3).map(lambda parts: "[" + ", ".join(parts) + "]"),
        st.dictionaries(st.sampled_from(["value", "unit", "values", "x"]), inner, max_size=3).map(
            lambda table: "{" + ", ".join(f"{key} = {value}" for key, value in table.items()) + "}"
        ),
    ),
    max_leaves=4,
)
keys = st.sampled_from(
    ["rate", "period", "pulses", "start", "at", "bursts", "gap", "amplitude", "frequency", "phase", "shape"]
)
tables = st.dictionaries(keys, toml_values, max_size=5).map(
    lambda table: "\n".join(f"{key} = {value}" for key, value in table.items())
)


@settings(max_examples=50)
@given(st.sampled_from(["train", "times", "burst", "sine"]), tables, tables)
def test_any_toml_is_a_drive_or_an_input_error(kind: str, timing: str, waveform: str) -> None:
    for text in (
        f"format = 1\n[{kind}]\n{timing}\n[waveform]\n{waveform}",
        f"format = 1\n[{kind}]\n{timing}",
    ):
        try:
            drive = read_drive(text, PULSE, name="any.toml")
        except InputError as error:
            message = str(error)
            assert message.startswith("any.toml: ")
            assert "\n" not in message
        else:
            assert read_drive(drive.to_toml()) == drive


@given(st.text())
def test_any_text_is_a_drive_or_an_input_error(text: str) -> None:
    with pytest.raises(InputError) as caught:
        read_drive("format = 1\n" + text, name="any.toml")
    assert caught.value.file == "any.toml"
