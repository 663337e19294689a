"""A batch of trains equals its individual trains, and rejects the same input."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.drive.batch import Ragged, firings_of, joined
from printhammer.drive.waveforms.shapes import HalfSine, Sine

PULSE = HalfSine(amplitude=1.0, width=3e-4)


@settings(max_examples=30)
@given(
    rates=st.lists(st.floats(1e-3, 1e5), min_size=1, max_size=6),
    pulses=st.integers(1, 9),
    overlap=st.sampled_from(["add", "replace"]),
)
def test_trains_at_rates_are_the_single_ones(rates: list[float], pulses: int, overlap: Any) -> None:
    trains = ph.PulseTrains.at_rates(PULSE, rates, pulses, overlap)
    single = [ph.PulseTrain(PULSE, rate=rate, pulses=pulses, overlap=overlap) for rate in rates]
    assert list(trains) == single
    for train, other in zip(trains, single, strict=True):
        assert train.times.tobytes() == other.times.tobytes()
        assert (train.period, train.fingerprint, repr(train)) == (
            other.period,
            other.fingerprint,
            repr(other),
        )
        assert train.to_toml() == other.to_toml()
        assert train.peak == other.peak


@given(st.lists(st.lists(st.integers(0, 1000), min_size=1, max_size=5, unique=True), min_size=1, max_size=5))
def test_trains_at_times_are_the_single_ones(rows: list[list[int]]) -> None:
    times = [np.sort(np.array(row)) * 1e-4 for row in rows]
    trains = ph.PulseTrains(PULSE, times)
    assert list(trains) == [ph.PulseTrain(PULSE, at=row) for row in times]
    assert trains[-1] == trains[len(rows) - 1]
    assert list(trains[::2]) == list(trains)[::2]
    assert not trains[0].times.flags.writeable
    parts = joined([trains, ph.PulseTrains(PULSE.scaled(2.0), times[:1], "replace"), trains])
    assert isinstance(parts, ph.PulseTrains)
    assert list(parts) == [*trains, ph.PulseTrain(PULSE.scaled(2.0), at=times[0], overlap="replace"), *trains]


def test_joined_with_other_drives_is_a_list() -> None:
    trains = ph.PulseTrains(PULSE, [[0.0]])
    sine = ph.SineForce(1.0, "30 Hz")
    assert joined([trains, [sine]]) == [trains[0], sine]
    assert joined([]) == []


@pytest.mark.parametrize(
    "times", [[], [-1.0], [0.0, 0.0], [1.0, 0.5], [0.0, np.nan], [np.inf], [0.0, np.inf], [np.nan, 1.0]]
)
def test_times_are_refused_as_by_a_single_train(times: list[float]) -> None:
    with pytest.raises(ph.InputError) as expected:
        ph.PulseTrain(PULSE, at=np.array(times))
    with pytest.raises(ph.InputError) as error:
        ph.PulseTrains(PULSE, [[0.0, 1.0], times, [0.5]])
    assert str(error.value) == str(expected.value)


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"rates": [500.0, -1.0]}, "rate"),
        ({"rates": [np.nan]}, "rate"),
        ({"rates": [1e-310]}, "rate"),
        ({"rates": [1e-308], "pulses": 1000}, "at"),
        ({"rates": []}, "train"),
        ({"rates": ["fast"]}, "rates"),
        ({"pulses": 0}, "pulses"),
        ({"overlap": "mix"}, "overlap"),
        ({"waveform": Sine(amplitude=1.0, frequency=30.0)}, "waveform"),
        ({"waveform": "sine"}, "waveform"),
    ],
)
def test_wrong_arguments(options: dict[str, Any], key: str) -> None:
    arguments: dict[str, Any] = {"waveform": PULSE, "rates": [500.0], "pulses": 3, **options}
    with refused(key):
        ph.PulseTrains.at_rates(**arguments)


def test_an_index_beyond_the_end() -> None:
    with pytest.raises(IndexError):
        ph.PulseTrains(PULSE, [[0.0]])[1]


@pytest.mark.parametrize("count", [1, 5])
def test_an_ensemble_of_trains_is_that_of_the_single_ones(count: int) -> None:
    hammer = ph.load("hendriks-1983")
    waveform: Any = hammer.waveform
    trains = ph.PulseTrains.at_rates(waveform, np.linspace(700.0, 1400.0, count), 4)
    grid = np.linspace(0.0, 6e-3, 50)
    batch, list_of = (
        ph.Ensemble(hammer, drives, np.full(5, 6e-3)).run(dots=True, strobes="firings", times=grid)
        for drives in (trains, list(trains))
    )
    for name, (_note, values) in batch.entries().items():
        other = list_of.entries()[name][1]
        assert np.asarray(values).tobytes() == np.asarray(other).tobytes(), name
    runs = ph.Ensemble(hammer, trains, 6e-3)
    assert runs.motion(count - 1).drive == trains[count - 1]


def test_a_map_makes_no_drive_for_each_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred rates need no more drives than two: some for the wait after the last firing, one for all."""
    hammer = ph.load("hendriks-1983")
    made: list[object] = []
    begin = ph.PulseTrain.__init__

    def counted(self: ph.PulseTrain, *args: Any, **options: Any) -> None:
        made.append(self)
        begin(self, *args, **options)

    monkeypatch.setattr(ph.PulseTrain, "__init__", counted)
    copies = ph.PulseTrain._with_checked_times
    monkeypatch.setattr(
        ph.PulseTrain, "_with_checked_times", lambda *args: made.append(args) or copies(*args)
    )
    counts = []
    for rates in (2, 100):
        made.clear()
        ph.frequency_map(hammer, np.linspace(900.0, 1000.0, rates), pulses=1, times=2)
        counts.append(len(made))
    assert counts[0] == counts[1] <= 6


@given(st.lists(st.lists(st.floats(allow_nan=False), max_size=4), max_size=5), st.data())
def test_rows_of_unequal_length(rows: list[list[float]], data: st.DataObject) -> None:
    arrays = [np.array(row, dtype=np.float64) for row in rows]
    ragged = Ragged.of(arrays)
    assert [ragged[i].tolist() for i in range(len(ragged))] == rows
    table = ragged.filled()
    assert table.shape == (len(rows), max(map(len, rows), default=0))
    for row, filled in zip(rows, table, strict=True):
        assert filled[: len(row)].tolist() == row
        assert np.isnan(filled[len(row) :]).all()
    which = data.draw(st.lists(st.integers(0, len(rows) - 1), max_size=6) if rows else st.just([]))
    some = ragged.take(np.array(which, dtype=np.int64))
    assert [some[i].tolist() for i in range(len(some))] == [rows[k] for k in which]


def test_firings_of_any_drives() -> None:
    drives = [ph.PulseTrain(PULSE, at=[0.0, 1.0]), ph.SineForce(1.0, "30 Hz")]
    assert [firings_of(drives)[i].tolist() for i in range(2)] == [[0.0, 1.0], [0.0]]
