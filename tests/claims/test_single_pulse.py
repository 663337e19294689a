import json

import pytest

import printhammer as ph
from printhammer.claims import JUDGES, Context, claims, judge
from printhammer.printing.dots.settling import rebounds, touches

SINGLE = (
    "single_pulse_stroke",
    "settle_out",
    "low_restitution",
    "backstop_force_dominates",
    "quiet_look_loud_force",
    "loops",
    "print_force",
    "pack_energy",
    "delivered_energy",
)
RESTITUTION = 0.6

# A mass under a constant force, thrown off a rigid backstop by a short push; the pack is out of reach.
BOUNCER = """
format = 1
name = "bouncer"
mass = { value = 1.0, unit = "g", status = "assumed", source = "test" }
[spring]
law = "preload"
preload = { value = -10.0, unit = "N", status = "assumed", source = "test" }
stiffness = { value = 0.0, unit = "N/m", status = "assumed", source = "test" }
[pack]
law = "power"
stiffness = { value = 100.0, unit = "N", status = "assumed", source = "test" }
front = { value = 100.0, unit = "mm", status = "assumed", source = "test" }
thickness = { value = 1.0, unit = "mm", status = "assumed", source = "test" }
[backstop]
law = "rigid"
position = { value = 0.0, unit = "m", status = "assumed", source = "test" }
restitution = { value = 0.6, unit = "1", status = "assumed", source = "test" }
[waveform]
shape = "half-sine"
amplitude = { value = 60.0, unit = "N", status = "assumed", source = "test" }
width = { value = 50.0, unit = "us", status = "assumed", source = "test" }
"""


@pytest.fixture(scope="module")
def bouncer() -> Context:
    return Context(ph.Hammer.from_toml(BOUNCER))


def test_rebounds_of_a_ball_under_a_constant_force(bouncer: Context) -> None:
    found = rebounds(bouncer.single, bouncer.position)[:8]
    first = touches(bouncer.single)[0]
    gravity = 10.0 / 1e-3
    speed = -first.v_in
    for bounce in found:
        speed *= RESTITUTION
        assert bounce.height == pytest.approx(speed**2 / (2.0 * gravity), rel=1e-7)
        assert bounce.duration == pytest.approx(2.0 * speed / gravity, rel=1e-7)


def test_restitution_is_read_off_the_touches(bouncer: Context) -> None:
    result = judge(bouncer, claims()["low_restitution"])
    assert result.value["restitutions"][:8] == pytest.approx([RESTITUTION] * 8, rel=1e-12)


def test_excursions_are_measured_from_the_backstop_in_strokes(bouncer: Context) -> None:
    value = judge(bouncer, claims()["settle_out"]).value
    assert value["largest_excursion_over_stroke"] == pytest.approx(RESTITUTION**2, rel=1e-6)
    assert value["each_lower"]
    assert value["each_shorter"]


def test_no_force_is_largest_on_a_rigid_backstop(bouncer: Context) -> None:
    result = judge(bouncer, claims()["quiet_look_loud_force"])
    assert (result.verdict, result.value) == ("fails", None)


def test_the_ledger_from_rest_to_rest(context: Context) -> None:
    value = judge(context, claims()["loops"]).value
    taken = value["pack_loss_J"] + value["backstop_loss_J"]
    assert value["coil_work_J"] == pytest.approx(taken, rel=1e-8)
    assert len(value["backstop_losses_J"]) == len(touches(context.single)) - 1


def test_the_largest_force_in_the_backstop_is_seen_on_a_fine_grid(context: Context) -> None:
    import numpy as np

    value = judge(context, claims()["backstop_force_dominates"]).value
    motion = context.single
    times = np.linspace(0.0, 2e-3, 200_001)
    total = np.abs(motion.forces_at(times)["total"])
    inside = motion.at(times)[0] <= context.position
    inside &= times > touches(motion)[0].t_in
    assert value["at_backstop_N"] == pytest.approx(total[inside].max(), rel=1e-5)
    assert value["elsewhere_N"] == pytest.approx(total[~inside].max(), rel=1e-5)
    assert value["at_backstop_N"] >= total[inside].max()


def test_the_static_force_of_the_backstop_is_that_of_the_rest_state(context: Context) -> None:
    value = judge(context, claims()["quiet_look_loud_force"]).value
    margin = float(ph.holding_margin(context.hammer, context.rest))
    assert value["static_force_N"] == pytest.approx(margin, rel=1e-9)


@pytest.mark.parametrize(("name", "part"), [(name, part) for name in SINGLE for part in JUDGES[name][0]])
def test_a_missing_part_is_told(context: Context, part: str, name: str) -> None:
    result = judge(Context(context.hammer.replace(part, None)), claims()[name])
    assert (result.verdict, result.detail) == ("fails", f"The hammer has no {part}.")


@pytest.mark.parametrize("amplitude", ["0 A", "0.1 A"])
def test_a_pulse_too_weak_fails_and_crashes_nothing(context: Context, amplitude: str) -> None:
    weak = Context(context.hammer.replace("waveform.amplitude", amplitude))
    names = [*SINGLE, "two_pulses_660us", "two_pulses_700us", "independent_at_low_rate"]
    results = [judge(weak, claims()[name]) for name in names]
    assert {result.verdict for result in results} == {"fails"}
    json.dumps([result.as_dict() for result in results], allow_nan=False)
