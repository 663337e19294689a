"""Compensation tables: construction, interpolation between rates, and the resulting drives."""

import numpy as np
import pytest
from tests.control.table.by_hand import by_hand
from tests.errors import refused
from tests.hammers import crude

import printhammer as ph
from printhammer.control.pulses import of_width
from printhammer.control.table.drive import COLUMNS, fading, print_pulse
from printhammer.drive.waveforms.shapes import Chain, HalfSine
from printhammer.printing.dots.strategy import slot_times


def test_at_its_own_rates_a_table_says_what_it_holds() -> None:
    table = by_hand()
    for row, rate in enumerate(table.rates.tolist()):
        said = table.at(rate)
        assert all(np.array_equal(getattr(said, name), getattr(table, name)[row]) for name in COLUMNS)


def test_between_rates_it_is_linear_in_the_period() -> None:
    table = by_hand()
    middle = 2.0 / (1.0 / table.rates).sum()
    said = table.at(f"{float(middle)!r} Hz")
    assert said.width == pytest.approx(table.width.mean(axis=0), rel=1e-12)


def test_where_one_rate_brakes_and_the_other_does_not_the_nearer_one_holds() -> None:
    brake = by_hand().brake_width.copy()
    delay = by_hand().brake_delay.copy()
    brake[1, 3], delay[1, 3] = 20e-6, 600e-6
    table = by_hand(brake_width=brake, brake_delay=delay)
    assert table.at(801.0).brake_width[3] == 0.0
    assert table.at(999.0).brake_width[3] == brake[1, 3]


@pytest.mark.parametrize("rate", [799.0, 1001.0])
def test_rates_beyond_the_table(rate: float) -> None:
    with refused("rate"):
        by_hand().at(rate)


@pytest.mark.parametrize("rate", [0.0, -5.0, "0 Hz", float("nan")])
def test_no_rates(rate: float | str) -> None:
    with refused("rate"):
        by_hand().at(rate)


def test_another_hammer_is_refused_in_one_sentence() -> None:
    other = crude().replace("mass", 1.01 * crude().mass)
    with refused("hammer"):
        by_hand().drive(other, (0, 1), 900.0)


@pytest.mark.parametrize(
    ("name", "value", "key"),
    [
        ("width", 0.0, "width"),
        ("width", np.nan, "width"),
        ("advance", np.inf, "advance"),
        ("brake_width", -1e-6, "brake_width"),
        ("advance", 0.9e-3, "advance"),
    ],
)
def test_entries_that_cannot_be_fired(name: str, value: float, key: str) -> None:
    values = getattr(by_hand(), name).copy()
    values[1, 3] = value
    with refused(key):
        by_hand(**{name: values})


def test_a_brake_pulse_that_begins_too_early() -> None:
    brake, delay = by_hand().brake_width.copy(), by_hand().brake_delay.copy()
    brake[0, 3], delay[0, 3] = 20e-6, 100e-6
    with refused("brake_delay"):
        by_hand(brake_width=brake, brake_delay=delay)


@pytest.mark.parametrize(
    ("rates", "key"), [([1000.0, 800.0], "rates"), ([0.0, 800.0], "rates"), ([], "rates")]
)
def test_rates_that_make_no_table(rates: list[float], key: str) -> None:
    with refused(key):
        by_hand(rates=np.array(rates))


def test_arrays_of_another_shape() -> None:
    with refused("width"):
        by_hand(width=by_hand().width[:, :4])


def test_a_drive_fires_each_dot_as_its_entry_says() -> None:
    table, hammer = by_hand(), crude()
    slots = (0, 1, 3, 9)
    drive = table.drive(hammer, slots, "1 kHz")
    entries = [0, 3, 7, 0]  # rest-rest, 1-rest, 2-1, rest-rest
    assert drive.times == pytest.approx(slot_times(slots, 1000.0) - table.advance[1, entries], abs=1e-15)
    assert isinstance(drive, ph.PulseSequence)
    for waveform, entry in zip(drive.waveforms, entries, strict=True):
        assert getattr(waveform, "width", None) == table.width[1, entry]


def test_a_brake_pulse_comes_after_the_slot_of_the_dot_before() -> None:
    brake, delay, advance = (
        getattr(by_hand(), name).copy() for name in ("brake_width", "brake_delay", "advance")
    )
    brake[:, 3:6], delay[:, 3:6], advance[:, 0] = 20e-6, 600e-6, 30e-6
    table = by_hand(brake_width=brake, brake_delay=delay, advance=advance)
    drive = table.drive(crude(), (0, 1), 1000.0)
    assert isinstance(drive, ph.PulseSequence)
    first = drive.waveforms[0]
    assert isinstance(first, Chain)
    offset, pulse = first.parts[1]
    assert drive.times[0] + offset == pytest.approx(slot_times((0,), 1000.0)[0] + 600e-6, abs=1e-15)
    assert getattr(pulse, "width", None) == 20e-6
    assert not isinstance(drive.waveforms[1], Chain)


def test_pulses_above_the_largest_current_are_refused() -> None:
    hammer = crude()
    assert hammer.waveform is not None
    with refused("waveform"):
        by_hand(largest_current=0.5).strategy(hammer)


def test_the_widest_pulse_is_found_by_its_peak() -> None:
    # The current of a slow coil goes on rising, so that the bound is a bound on the width.
    hammer = crude().replace({"waveform.rise": 300e-6, "waveform.amplitude": 1.2})
    pulse, widest = print_pulse(hammer, 1.0)
    assert of_width(pulse, widest).peak == pytest.approx(0.999, rel=1e-9)
    assert pulse.peak < 1.0
    assert widest == pytest.approx(-300e-6 * np.log1p(-0.999 / 1.2), rel=1e-9)


def test_fading_is_that_of_the_decay() -> None:
    hammer = crude()
    pulse = hammer.waveform
    assert pulse is not None
    decay = pulse.decay  # type: ignore[attr-defined]
    assert fading(hammer, pulse, 0.02) == pytest.approx(decay * np.log(1.0 / 0.02), rel=2e-2)
    assert fading(hammer, HalfSine(amplitude=1.0, width=1e-4), 0.02) == 0.0


def test_hammers_that_no_table_is_for() -> None:
    bare = ph.Hammer.build(crude().mass)
    with refused("waveform"):
        ph.tune(bare)
    with refused("waveform"):
        ph.tune(crude(), largest_current="0.5 A")
