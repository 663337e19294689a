import math
from typing import TYPE_CHECKING

import pytest

from printhammer.claims import Context, claims, judge

if TYPE_CHECKING:
    import printhammer as ph


def measured(context: Context, name: str) -> dict[str, object]:
    value = judge(context, claims()[name]).value
    assert value is not None
    return dict(value)


def free_force(hammer: "ph.Hammer", x: float) -> float:
    """Equations (3) and (4) at zero current, evaluated directly."""
    c = {key: constant.si for key, constant in hammer.constants.items()}
    magnet = c["magnet.F0"] - c["magnet.Am"] ** 2 / math.sqrt(x)
    return magnet + c["spring.Bs"] * (1.0 - (x - c["backstop.position"]) / c["spring.As"])


def test_geometry_is_told_in_si(context: Context) -> None:
    assert judge(context, claims()["geometry"]).verdict == "holds"
    moved = Context(context.hammer.replace("platen", "0.016 in"))
    result = judge(moved, claims()["geometry"])
    assert result.verdict == "fails"
    # The pack is as thick as before: what is wrong is the platen alone.
    assert result.missed == ["platen_m"]


def test_rest_state_balances_the_hertz_force(context: Context) -> None:
    value = measured(context, "rest_state")
    stiffness = context.hammer.constants["backstop.stiffness"].si
    pressed = -free_force(context.hammer, value["rest_m"])
    assert stiffness * value["depth_m"] ** 1.5 == pytest.approx(pressed, rel=1e-9)


def test_largest_net_force_is_that_of_the_printed_laws(context: Context) -> None:
    value = measured(context, "return_from_everywhere")
    c = {key: constant.si for key, constant in context.hammer.constants.items()}
    # The derivative of (3) + (4) vanishes there.
    x = (0.5 * c["magnet.Am"] ** 2 * c["spring.As"] / c["spring.Bs"]) ** (2.0 / 3.0)
    assert context.position < x < c["platen"]
    assert value["at_m"] == pytest.approx(x, rel=1e-6)
    assert value["largest_net_force_N"] == pytest.approx(free_force(context.hammer, x), rel=1e-12)


def test_a_hammer_that_may_not_return_fails(context: Context) -> None:
    weak = Context(context.hammer.replace("magnet.Am", 0.41))
    result = judge(weak, claims()["return_from_everywhere"])
    assert result.verdict == "fails"
    (interval,) = result.value["positive_from_to_m"]
    for end in interval:
        assert free_force(weak.hammer, end) == pytest.approx(0.0, abs=1e-9)


def test_release_margin(context: Context) -> None:
    value = measured(context, "release_margin")
    net, b = free_force(context.hammer, context.position), context.position
    c = {key: constant.si for key, constant in context.hammer.constants.items()}
    magnet = c["magnet.F0"] - c["magnet.Am"] ** 2 / math.sqrt(b)
    assert value["net_over_magnet_force"] == pytest.approx(abs(net / magnet), rel=1e-12)


def test_current_range(context: Context) -> None:
    value = measured(context, "current_range")
    c = {key: constant.si for key, constant in context.hammer.constants.items()}
    assert value["Am_over_Bm_A"] == pytest.approx(c["magnet.Am"] / c["magnet.Bm"])
    # Pulses longer than the shortest period, with sharp ends, add up in pairs.
    changes = {"waveform.width": "1.5 ms", "waveform.amplitude": "1.5 A", "waveform.decay": "0 us"}
    long = Context(context.hammer.replace(changes))
    assert measured(long, "current_range")["largest_current_A"] == pytest.approx(3.0, rel=1e-3)
    assert judge(long, claims()["current_range"]).verdict == "fails"


def test_a_hammer_driven_by_a_force_has_no_current_range(context: Context) -> None:
    pushed = context.hammer.replace(
        "waveform", {"shape": "half-sine", "amplitude": "30 N", "width": "300 us"}
    )
    result = judge(Context(pushed), claims()["current_range"])
    assert result.verdict == "fails"
    assert "force" in result.detail
