"""Work ends: for a newer state, for what takes too long, and where it would."""

import time
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused
from tests.hammers import CRUDE
from tests.studio.server import STATE

from printhammer.kernel.compile import cache
from printhammer.studio import bounds, compiling
from printhammer.studio.frames import unframe
from printhammer.studio.pictures.printed import line_frame
from printhammer.studio.states.state import State, read_state
from printhammer.studio.work import GivenUp, Patience, alike, near

TEXT = CRUDE.read_text("utf-8")
PULSE = {"shape": "half-sine", "amplitude": 1.0, "width": 2e-4, "quantity": "current"}


def of(**changed: Any) -> State:
    return read_state({**STATE, "text": TEXT, **changed})


def test_patience_ends_for_a_newer_state_and_after_its_time() -> None:
    Patience(lambda: False, "it").check()
    with pytest.raises(GivenUp):
        Patience(lambda: True, "it").check()
    with refused("seconds"):
        Patience(lambda: False, "it", 5.0).check(more=6.0)
    with refused("seconds"):
        Patience(lambda: False, "it", -1.0).progress(1, 2)


def test_patience_does_not_count_compiling() -> None:
    begun = time.monotonic()
    patience = Patience(lambda: False, "it")
    before = compiling.seconds()
    for begins in (True, False):
        for watcher in cache.watchers:
            watcher(begins)
    compiled = compiling.seconds() - before
    assert compiled > 0.0
    assert patience.spent < time.monotonic() - begun - compiled + 1e-9


@given(st.floats(-1e9, 1e9), st.floats(0.1, 10.0))
def test_near_numbers_are_of_one_sign_and_a_factor_apart(number: float, factor: float) -> None:
    other = number * factor
    assert near(number, other) == near(other, number)
    if number == other:
        assert near(number, other)
    elif abs(number) > 1e-9 and not 0.99 < factor / bounds.ALIKE < 1.01 and not 0.79 < factor < 0.81:
        assert near(number, other) == (1.0 / bounds.ALIKE < factor < bounds.ALIKE)
    assert not near(1.0, -number if number > 0.0 else number)


@pytest.mark.parametrize(
    ("changed", "same"),
    [
        ({}, True),
        ({"rate": 300.0, "line": "A"}, True),
        ({"pulses": 3}, False),
        ({"pattern": "101"}, False),
        ({"high": 2100.0}, False),
        ({"constants": {"mass": 1e-3}}, False),
        ({"waveform": PULSE}, False),
    ],
)
def test_states_are_alike_where_a_map_of_them_is_the_same_work(changed: dict[str, Any], same: bool) -> None:
    assert alike(of(**changed), of()) == same


def test_pulses_are_alike_where_their_constants_are() -> None:
    wider, wide = ({**PULSE, "width": width} for width in (2.2e-4, 4e-4))
    assert alike(of(waveform=wider), of(waveform=PULSE))
    assert not alike(of(waveform=wide), of(waveform=PULSE))


def test_a_line_that_takes_too_long_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "MOST_WORK", 1000)
    heading, _ = unframe(line_frame(of(line="HAMMER"), 1, lambda: False))
    assert "expected at most 1e+03" in heading["reason"]
    monkeypatch.setattr(bounds, "MOST_MAP_STEPS", 10)
    heading, _ = unframe(line_frame(of(line="HAMMER"), 1, lambda: False))
    assert "would take more than 10 steps" in heading["reason"]


def test_a_line_is_printed() -> None:
    heading, arrays = unframe(line_frame(of(line="I"), 1, lambda: False))
    assert heading["reason"] == ""
    assert heading["wanted"] > 0
    assert arrays


@pytest.mark.slow
def test_a_line_is_printed_with_a_measured_pulse() -> None:
    times = [5e-6 * k for k in range(93)]
    hammer = of().fired
    values = hammer.value(np.array(times)).tolist()
    pulse = {"shape": "sampled", "times": times, "values": values, "quantity": "current"}
    measured = of(line="I", waveform=pulse)
    heading, _ = unframe(line_frame(measured, 1, lambda: False))
    known, _ = unframe(line_frame(of(line="I"), 1, lambda: False))
    assert heading["reason"] == ""
    assert heading["wanted"] == known["wanted"] > 0
