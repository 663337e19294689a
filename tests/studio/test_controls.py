"""Controls: one for each constant, with a range that contains its value."""

from contextlib import nullcontext

import pytest
from tests.hammers import CRUDE, interpreted
from tests.studio.reading import STATE, drive_of

from printhammer.drive.trains import SineForce
from printhammer.hammer.hammer import Hammer, load, shipped
from printhammer.hammer.names import range_of
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.run.simulate import simulate
from printhammer.studio import bounds, controls
from printhammer.units import to_si

HAMMERS = [*shipped(), str(CRUDE)]
RARE = {"dankowicz-schilder-2013"}
"""Hammers whose combination of laws no other fast test compiles."""


@pytest.mark.parametrize("name", HAMMERS)
def test_every_constant_has_a_control_whose_range_holds_it(name: str) -> None:
    hammer = load(name)
    told = controls.describe(hammer)
    keys = [constant["key"] for constant in told["constants"]]
    assert keys == [key for key in hammer.constants if not key.startswith("waveform.")]
    for constant in told["constants"]:
        assert constant["low"] <= constant["value"] <= constant["high"], constant["key"]
        assert constant["low"] < constant["high"]
        assert constant["source"]
        assert constant["low"] > 0.0 or not constant["log"]


def test_a_slow_device_of_ones_own_opens_without_overlapping_pulses() -> None:
    slow, fast = (load(name).replace("name", "mine") for name in ("relay-5v", "hendriks-1983"))
    assert slow.waveform is not None
    start = controls.describe(slow)["start"]
    assert start["low"] < start["rate"] < start["high"] < 1.0 / slow.waveform.width
    assert controls.describe(fast)["start"] == {}


@pytest.mark.parametrize("name", HAMMERS)
def test_every_law_has_its_equation_or_first_line(name: str) -> None:
    hammer = load(name)
    for role, part in hammer.parts.items():
        assert len(controls.equation_of(role, type(part))) > 10
    for control in controls.describe(hammer)["constants"]:
        assert len(control["equation"]) > 10 or control["key"] == "platen"


def test_the_equations_are_of_laws_that_there_are() -> None:
    from printhammer.parts import PARTS

    assert {tuple(key.split(".")) for key in controls.EQUATIONS if "." in key} <= set(PARTS)


def test_the_paper_lies_on_the_platen_whatever_is_moved() -> None:
    """Each combined control of platen, front and thickness preserves platen = front + thickness."""
    hammer = load(CRUDE)
    (distance, thickness) = controls.describe(hammer)["combined"]
    assert distance["value"] == pytest.approx(hammer.platen - hammer.position)
    assert thickness["value"] == pytest.approx(hammer.pack.thickness)
    for control in (distance, thickness):
        moves = control["moves"]
        assert moves.get("platen", 0.0) == moves["pack.front"] + moves.get("pack.thickness", 0.0)
        for end in ("low", "high"):
            change = control[end] - control["value"]
            moved = {key: hammer.constants[key].si + weight * change for key, weight in moves.items()}
            for key, value in moved.items():
                span = range_of(hammer, key)
                assert span.low <= value <= span.high, (control["key"], end, key)
            assert isinstance(hammer.replace(moved), Hammer)


@pytest.mark.parametrize("name", shipped())
def test_units_are_shown_by_factors_of_the_unit_table(name: str) -> None:
    for si, systems in controls.units_of(load(name)).items():
        for shown in systems:
            plain = (
                shown["name"].replace("µ", "u").replace("·", " ").replace("°C", "degC").replace("°", "deg")
            )
            assert shown["factor"] * to_si(1.0, plain, si) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("name", sorted(shipped()))
def test_a_shipped_hammer_opens_with_something_that_strikes_its_backstop(name: str) -> None:
    hammer = load(name)
    opening = controls.describe(hammer)["start"]
    assert ("waveform" in opening) == (hammer.waveform is None)
    state = {**STATE, **opening}
    drive = drive_of(state, hammer.waveform)
    duration = state["pulses"] / state["rate"] if isinstance(drive, SineForce) else None
    with interpreted() if name in RARE else nullcontext():
        motion = simulate(hammer, drive, duration=duration, tolerance=DISPLAY_TOLERANCE)
    assert motion.status == "ok"
    assert motion.steps <= bounds.MOST_STEPS
    struck = any(contact.surface == "backstop" for contact in motion.contacts)
    # Without a spring an armature stays where it was pulled.
    assert struck == (hammer.backstop is not None and hammer.spring is not None)
