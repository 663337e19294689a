"""The frequency-time map of the studio is that of the laboratory, to its codes."""

from typing import Any

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import CRUDE
from tests.studio.server import STATE

import printhammer as ph
from printhammer.maps.frequency import TAIL
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.studio import bounds
from printhammer.studio.frames import unframe
from printhammer.studio.pictures.chart import GAP, codes_of, map_frame, try_map
from printhammer.studio.pictures.keys import KEYS
from printhammer.studio.states.state import State, read_state
from printhammer.studio.work import GivenUp

TEXT = CRUDE.read_text("utf-8")


def of(**changed: Any) -> State:
    return read_state({**STATE, "text": TEXT, **changed})


def displacements(state: State, size: tuple[int, int]) -> tuple[dict[str, Any], Any]:
    heading, found = unframe(map_frame(state, 1, size, lambda: False))
    return heading, heading["low"] + found["codes"] / (GAP - 1) * (heading["high"] - heading["low"])


def test_it_is_that_of_the_library_to_its_codes() -> None:
    state = of(low=700.0, high=1500.0, pulses=3)
    heading, shown = displacements(state, (8, 40))
    end = 2 / 700.0 + TAIL
    times = np.linspace(0.0, end, 40)
    rates = np.linspace(700.0, 1500.0, 8)
    chart = ph.frequency_map(state.changed, rates, pulses=3, times=times, tolerance=DISPLAY_TOLERANCE)
    x = np.clip(chart["displacement"].values, heading["low"], heading["high"])
    assert np.abs(shown - x).max() <= 1.01 * (heading["high"] - heading["low"]) / (GAP - 1)
    assert heading["end"] == pytest.approx(end)


def test_it_follows_the_pattern() -> None:
    state = of(low=700.0, high=1500.0, pulses=9, pattern="1011")
    heading, shown = displacements(state, (3, 60))
    end = 3 / 700.0 + TAIL
    assert heading["end"] == pytest.approx(end)
    assert heading["pattern"] == "1011"
    waveform = state.changed.waveform
    assert waveform is not None
    drives = [ph.PulseTrain(waveform, at=[0.0, 2.0 / rate, 3.0 / rate]) for rate in (700.0, 1100.0, 1500.0)]
    runs = ph.Ensemble(state.changed, drives, end, tolerance=DISPLAY_TOLERANCE)
    x = np.clip(runs.run(times=np.linspace(0.0, end, 60)).x, heading["low"], heading["high"])
    assert np.abs(shown - x).max() <= 1.01 * (heading["high"] - heading["low"]) / (GAP - 1)
    assert KEYS["map"](state) != KEYS["map"](of(low=700.0, high=1500.0, pulses=9))


def test_a_pattern_of_all_pulses_is_the_train() -> None:
    assert KEYS["map"](of(pattern="111", pulses=9)) == KEYS["map"](of(pulses=3))


def test_a_gap_has_a_code_of_its_own() -> None:
    x = np.float32([[np.nan, 0.0, 1.0, -5.0, 9.0]])
    assert codes_of(x, 0.0, 1.0).tolist() == [[GAP, 0, GAP - 1, 0, GAP - 1]]


def test_it_is_given_up_for_a_newer_state() -> None:
    with pytest.raises(GivenUp):
        map_frame(of(), 1, (64, 64), lambda: True)


def test_what_takes_too_long_is_refused_by_runs_at_some_rates(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "MOST_MAP_STEPS", 200)
    with refused("a run of the map, at 500 Hz,"):
        try_map(of(), None)
    try_map(of(pulses=1, low=1999.0), None)


def test_what_is_like_a_map_before_is_not_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    known = try_map(of(), None)
    monkeypatch.setattr(bounds, "MOST_MAP_STEPS", 1)
    stiffness = known.changed.constants["pack.stiffness"].si
    assert try_map(of(constants={"pack.stiffness": 1.1 * stiffness}), known) is known
    with refused("a run of the map, at 500 Hz,"):
        try_map(of(constants={"pack.stiffness": 2.0 * stiffness}), known)
    with refused("a run of the map, at 500 Hz,"):
        try_map(of(pulses=10), known)


def test_descending_rates_are_refused() -> None:
    with refused("map"):
        try_map(of(low=900.0, high=800.0), None)


def test_runs_that_fail_are_soon_done() -> None:
    # So strong a current drives the armature away from where the law of the magnet holds.
    pulse = {"shape": "rectangle", "amplitude": -90.0, "width": 4e-4, "rise": 1e-5, "decay": 2e-5}
    away = of(waveform=pulse)
    try_map(away, None)
    heading, data = unframe(map_frame(away, 1, (8, 16), lambda: False))
    assert heading["failed"] == 8
    assert (data["codes"] == GAP).any()


def test_where_nothing_moves_there_are_codes_all_the_same() -> None:
    x = np.array([[0.0, 0.0, np.nan]], np.float32)
    high = float(np.nextafter(np.float32(0.0), np.float32(1.0)))
    assert codes_of(x, 0.0, high).tolist() == [[0, 0, 65535]]
