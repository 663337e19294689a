"""Lists of forces and contacts in hammer files: reading, editing, errors, and equal descriptions."""

import math
from typing import Any

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.hammer.schema import schema
from printhammer.parts.spring.forces import ForceSum
from printhammer.parts.spring.terms import GRAVITY, Gravity, HertzContact, LinearContact


def written(value: float, unit: str) -> str:
    return f'{{ value = {value!r}, unit = "{unit}", status = "assumed", source = "test" }}'


def quoted(text: str) -> str:
    return f'"{text}"'


def table(name: str, /, **entries: str) -> str:
    """Format a table of a hammer file; values that are not constants are quoted."""
    lines = (f"{key} = {value if value[0] == '{' else quoted(value)}" for key, value in entries.items())
    return "\n".join([name, *lines, ""])


HEAD = f'format = 1\nname = "listed"\nmass = {written(2.0, "g")}\n'
WEIGHT = table("[[force]]", name="weight", law="gravity", angle=written(30.0, "deg"))
CONTACT = table(
    "[[contact]]",
    name="no",
    law="linear",
    side="front",
    position=written(0.4, "mm"),
    stiffness=written(3.0, "N/mm"),
)
POLE = table(
    "[[contact]]",
    name="pole",
    law="hertz",
    side="front",
    position=written(0.5, "mm"),
    stiffness=written(1e8, "N/m^1.5"),
)
SPRING = table("[spring]", law="preload", preload=written(-0.5, "N"), stiffness=written(100.0, "N/m"))
BACKSTOP = table("[backstop]", law="rigid", position=written(0.1, "mm"), restitution=written(0.3, "1"))
WHOLE = HEAD + SPRING + BACKSTOP + WEIGHT + CONTACT + POLE


def test_a_file_with_lists_is_read() -> None:
    hammer = ph.Hammer.from_toml(WHOLE)
    assert isinstance(hammer.spring, ForceSum)
    assert hammer.laws == {
        "backstop": "rigid",
        "spring": "preload",
        "force.weight": "gravity",
        "contact.no": "linear",
        "contact.pole": "hertz",
    }
    assert hammer.constants["contact.no.stiffness"].si == 3000.0
    weight = hammer.terms["force.weight"]
    assert isinstance(weight, Gravity)
    assert weight.acceleration == GRAVITY
    assert ph.Hammer.from_toml(hammer.to_toml()) == hammer


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        (0.1e-3, -0.5),
        (0.3e-3, -0.5 - 100.0 * 0.2e-3),
        (0.45e-3, -0.5 - 100.0 * 0.35e-3 - 3000.0 * 0.05e-3),
        (0.6e-3, -0.5 - 100.0 * 0.5e-3 - 3000.0 * 0.2e-3 - 1e8 * (0.1e-3) ** 1.5),
    ],
)
def test_forces_add_up_and_energies_are_their_integrals(x: float, expected: float) -> None:
    from printhammer.parts.spring import forces

    spring = ph.Hammer.from_toml(WHOLE).spring
    assert spring is not None
    c = spring.packed(0.1e-3)
    expected -= 2e-3 * GRAVITY * math.sin(math.radians(30.0))
    assert forces.spring_force(c, x) == pytest.approx(expected, rel=1e-13)
    h = 1e-9
    slope = (forces.spring_energy(c, x + h) - forces.spring_energy(c, x - h)) / (2.0 * h)
    assert -slope == pytest.approx(expected, rel=1e-6)
    assert [forces.spring_level(c, float(k)) for k in range(3)] == [0.4e-3, 0.5e-3, math.inf]


def test_lists_are_edited_in_place() -> None:
    hammer = ph.Hammer.from_toml(WHOLE + "# the end\n")
    changed = hammer.replace({"contact.no.stiffness": "4 N/mm", "force.weight.angle": 0.1})
    assert changed.constants["contact.no.stiffness"].unit == "N/mm"
    assert changed.constants["force.weight.angle"].si == 0.1
    assert hammer.constants["contact.no.stiffness"].si == 3000.0
    assert changed.to_toml().endswith("# the end\n")
    assert ph.Hammer.from_toml(changed.to_toml()) == changed
    assert changed.fingerprint != hammer.fingerprint
    less = hammer.replace("contact.no", None).replace("force.weight", None)
    assert less.laws == {"backstop": "rigid", "spring": "preload", "contact.pole": "hertz"}
    none = less.replace("contact.pole", None)
    assert "contact" not in none.to_toml()
    assert none.spring == ph.Hammer.from_toml(HEAD + SPRING + BACKSTOP).spring
    more = none.replace(
        "contact.back", {"law": "linear", "side": "back", "position": "1 mm", "stiffness": 1e3}
    )
    assert isinstance(more.terms["contact.back"], LinearContact)
    assert not isinstance(more.terms["contact.back"], HertzContact)
    assert ph.Hammer.from_toml(more.to_toml()) == more
    assert more.replace("contact.back.side", "front").fingerprint != more.fingerprint


def test_a_contact_with_damping_dissipates() -> None:
    elastic = ph.Hammer.from_toml(WHOLE)
    damped = elastic.replace("contact.no.damping", "300 ms/m")
    assert (elastic.is_damped, damped.is_damped) == (False, True)
    assert damped.constants["contact.no.damping"].si == pytest.approx(0.3)
    assert "contact.no.damping" not in elastic.constants
    assert ph.Hammer.from_toml(damped.to_toml()) == damped
    spring = damped.spring
    assert spring is not None
    viscous = spring.function("spring_viscous")
    c = spring.packed(0.1e-3)
    assert viscous(c, 0.39e-3, 1.0) == 0.0
    assert viscous(c, 0.6e-3, 0.5) == pytest.approx(-3000.0 * 0.2e-3 * 0.15)
    # The contact opens faster than its elastic force allows: the whole force is 0, it does not pull.
    assert viscous(c, 0.6e-3, -5.0) == pytest.approx(3000.0 * 0.2e-3)


def test_a_weight_follows_the_mass_and_needs_no_spring() -> None:
    hammer = ph.Hammer.from_toml(HEAD + WEIGHT)
    for mass in (2e-3, 5e-3):
        spring = hammer.replace("mass", mass).spring
        assert spring is not None
        assert spring.packed(0.0)[3] == pytest.approx(-0.5 * mass * GRAVITY)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (WEIGHT.replace('law = "gravity"\n', ""), "force.weight.law"),
        (WEIGHT.replace("gravity", "levity"), "force.weight.law"),
        (WEIGHT.replace('name = "weight"\n', ""), "force[1].name"),
        (WEIGHT.replace('"weight"', '"Weight 1"'), "force[1].name"),
        (WEIGHT + WEIGHT, "force[2].name"),
        (WEIGHT.replace("angle", "angel"), "force.weight.angel"),
        (WEIGHT.replace("deg", "mm"), "force.weight.angle"),
        (CONTACT.replace('side = "front"\n', ""), "contact.no.side"),
        (CONTACT.replace('"front"', '"top"'), "contact.no.side"),
        (CONTACT.replace("0.4", "0.05"), "contact.no.position"),
        (CONTACT + f"damping = {written(0.0, 's/m')}\n", "contact.no.damping"),
        (CONTACT + f"damping = {written(0.3, 'N s/m')}\n", "contact.no.damping"),
        (CONTACT + POLE.replace("0.5", "0.4"), "contact.pole.position"),
        (CONTACT.replace('"no"', '"pack"'), "contact[1].name"),
        ("".join(WEIGHT.replace('"weight"', f'"w{k}"') for k in range(12)), "force"),
    ],
)
def test_a_wrong_entry_is_refused_in_one_sentence(text: str, key: str) -> None:
    with refused(key, file="listed.toml"):
        ph.Hammer.from_toml(HEAD + SPRING + BACKSTOP + text, name="listed.toml")


def test_a_list_must_be_a_list_and_the_spring_one_that_can_be_added() -> None:
    with refused("force"):
        ph.Hammer.from_toml(HEAD.replace("\nmass", "\nforce = 3\nmass"))
    with refused("force.missing.angle"):
        ph.Hammer.from_toml(HEAD + WEIGHT).replace("force.missing.angle", 1.0)
    with refused("contact.pole"):
        ph.Hammer.from_toml(HEAD + WEIGHT).replace("contact.pole", 3.0)


def test_the_schema_describes_lists() -> None:
    entries: Any = schema()["properties"]["contact"]["items"]["oneOf"]
    assert {entry["properties"]["law"]["const"] for entry in entries} == {"linear", "hertz"}
    assert all(
        {"law", "name", "side", "position", "stiffness"} <= set(entry["required"]) for entry in entries
    )


def test_a_contact_moves_the_armature_as_a_pack_without_losses() -> None:
    """A linear pack without damping is the same contact, but is handled by other code of the kernel."""
    rng = np.random.default_rng(5)
    for _ in range(5):
        stiffness, front = 10.0 ** rng.uniform(3.0, 6.0), rng.uniform(0.2e-3, 0.6e-3)
        bare = ph.Hammer.from_toml(HEAD + SPRING + BACKSTOP)
        place = {"position": front, "stiffness": stiffness}
        listed = bare.replace("contact.front", {"law": "linear", "side": "front", **place})
        pack = {"law": "dashpot", "front": front, "stiffness": stiffness, "damping": 0.0}
        drive = ph.PulseTrain(
            ph.Hammer.build(1.0, waveform={"shape": "half-sine", "amplitude": "3 N", "width": 2e-3}).waveform,
            period=3e-3,
            pulses=3,
        )
        first = ph.simulate(listed, drive, duration=9e-3, tolerance=1e-13)
        other = ph.simulate(bare.replace("pack", pack), drive, duration=9e-3, tolerance=1e-13)
        touches = [contact for contact in other.contacts if contact.surface == "pack"]
        assert len(first.closings) == len(touches) > 0
        for closing, contact in zip(first.closings, touches, strict=True):
            assert closing.t_in == pytest.approx(contact.t_in, abs=1e-11)
            assert closing.depth == pytest.approx(contact.depth, abs=1e-11)
            assert closing.peak_force == pytest.approx(contact.peak_force, rel=1e-7)


@pytest.mark.parametrize(("law", "tables"), [("rigid", "[backstop] or [pack]"), ("power", "[pack]")])
def test_a_law_that_is_not_one_of_the_list_is_told_where_it_belongs(law: str, tables: str) -> None:
    contact = table("[[contact]]", name="stop", law=law, side="front", position=written(0.5, "mm"))
    with refused("contact.stop.law", law) as caught:
        ph.Hammer.from_toml(HEAD + contact)
    assert str(caught.value.expected).endswith(tables)
