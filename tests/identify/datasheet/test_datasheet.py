"""From data sheets to hammers: fitted forces, and the status of every constant."""

import math
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import printhammer as ph
from printhammer.identify.datasheet.build import (
    Sheet,
    damping_ratio,
    fit_magnet,
    forces_of,
    hammer_of,
)
from printhammer.identify.datasheet.plausible import SATURATION, implausible, missed_limits
from printhammer.identify.datasheet.sheet import DataSheet, read_sheet
from printhammer.parts.magnet import reluctance as law
from printhammer.parts.magnet.reluctance import MU0, ReluctanceMagnet

SHEETS = files("printhammer").joinpath("hammers", "sheets")
NAMES = sorted(entry.name.removesuffix(".toml") for entry in SHEETS.iterdir())
PLAIN = """\
name = "pull"
source = "page 3"
rail = "12 V"
resistance = "10 ohm"
force = [["0.25 mm", "85.9 N"], ["1 mm", "28.9 N"], ["2 mm", "11.1 N"], ["5 mm", "3.59 N"]]
inductance = ["45 mH", "4 mm"]
turns = 957
stroke = "4.75 mm"
end_gap = "0.25 mm"
mass = "26 g"
"""


def sheet_of(text: str, folder: Path) -> DataSheet:
    path = folder / "sheet.toml"
    path.write_text(text)
    return read_sheet(path)


def made_of(text: str, folder: Path) -> ph.Hammer:
    return hammer_of(sheet_of(text, folder))[0]


@given(
    area=st.floats(1e-6, 1e-3),
    residual=st.floats(0.05e-3, 0.3e-3),
    turns=st.floats(100.0, 2000.0),
    wide=st.floats(1e-3, 5e-3),
)
@settings(max_examples=25, deadline=None)
def test_forces_of_the_law_are_met(area: float, residual: float, turns: float, wide: float) -> None:
    part = ReluctanceMagnet(
        turns=turns,
        pole_area=area,
        closed_at=wide,
        residual_gap=residual,
        fringe_perimeter=2.0 * math.sqrt(math.pi * area),
        fringe_height=0.5 * math.sqrt(area / math.pi),
        core_reluctance=0.05e-3 / (MU0 * area),
        saturation_flux=1.6 * area,
    )
    gaps = wide * np.array([0.1, 0.3, 1.0])
    # Half of the field at which the core saturates, at the middle gap.
    current = 0.8 * gaps[1] / (MU0 * turns)
    asked = Sheet(current, gaps, np.ones(3), None, turns, None, None, wide)
    forces = forces_of(part, asked)
    fitted = fit_magnet(Sheet(current, gaps, forces, None, turns, None, None, wide))
    assert fitted.misfit < 0.02
    # The area goes with what the guesses make of gap and fringe.
    assert fitted.part.pole_area == pytest.approx(area, rel=0.25)


def test_a_constant_that_the_sheet_does_not_settle_stays_where_it_was_guessed() -> None:
    one = Sheet(1.2, np.array([5e-3]), np.array([3.59]), None, 957.0, None, None, 5e-3)
    fitted = fit_magnet(one)
    assert fitted.misfit < 1e-6
    assert fitted.derived == {}
    assert {"residual_gap", "core_reluctance", "saturation_flux", "fringe_height"} == set(fitted.assumed)
    assert fitted.part.residual_gap == pytest.approx(0.1e-3, rel=1e-3)


def test_a_published_magnet_is_met_from_four_of_its_forces(tmp_path: Path) -> None:
    # The pot magnet of the Modelica Standard Library at 1.2 A.
    sheet = sheet_of(PLAIN, tmp_path)
    hammer, magnet = hammer_of(sheet)
    assert magnet.misfit < 0.15
    assert magnet.inductance == pytest.approx(45e-3, rel=0.05)
    between = law.magnet_force(magnet.part.packed(0.0), 5e-3 - 3e-3, 1.2)
    assert between == pytest.approx(6.56, rel=0.15)
    assert hammer.front == pytest.approx(4.75e-3)
    assert hammer.waveform is not None
    assert hammer.waveform.shape == "rail"


def test_every_constant_says_what_it_is(tmp_path: Path) -> None:
    hammer = made_of(PLAIN + 'assumed = ["mass"]\n[why]\nmass = "weighed with its load"\n', tmp_path)
    constants = hammer.constants
    assert constants["mass"].status == "assumed"
    assert constants["mass"].source == "weighed with its load"
    assert constants["magnet.turns"].status == "datasheet"
    assert constants["coil.resistance"].source == "data sheet: page 3"
    assert constants["magnet.residual_gap"].status == "derived"
    assert constants["magnet.core_reluctance"].status == "assumed"
    assert constants["pack.stiffness"].status == "assumed"
    assert {constant.status for constant in constants.values()} == {"datasheet", "derived", "assumed"}


def test_what_follows_from_assumed_forces_is_assumed(tmp_path: Path) -> None:
    hammer = made_of(PLAIN + 'assumed = ["force"]\n', tmp_path)
    assert hammer.constants["magnet.pole_area"].status == "assumed"
    assert hammer.constants["magnet.residual_gap"].status == "assumed"


@pytest.mark.parametrize("restitution", [0.2, 0.3, 0.5, 0.8, 1.0])
def test_the_stop_returns_the_restitution(restitution: float) -> None:
    ratio = damping_ratio(restitution)
    # m x'' + c x' + k x = 0 in units of its own, until the push ends.
    from scipy.integrate import solve_ivp

    def slopes(_t: float, y: Any) -> list[float]:
        return [y[1], -y[0] - 2.0 * ratio * y[1]]

    def push(_t: float, y: Any) -> float:
        return float(y[0] + 2.0 * ratio * y[1])

    push.terminal, push.direction = True, -1.0  # type: ignore[attr-defined]
    run = solve_ivp(slopes, (0.0, 20.0), [0.0, 1.0], events=push, rtol=1e-10, atol=1e-12)
    assert run.y[1, -1] == pytest.approx(-restitution, abs=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_device_is_made_of_its_sheet(name: str) -> None:
    shipped = ph.load(name)
    path = Path(str(SHEETS.joinpath(f"{name}.toml")))
    made, magnet = hammer_of(read_sheet(path))
    assert magnet.misfit < 0.1
    assert list(made.constants) == list(shipped.constants)
    for key, constant in made.constants.items():
        assert constant.si == pytest.approx(shipped.constants[key].si, rel=1e-4, abs=1e-12), key
        assert (constant.status, constant.source) == (
            shipped.constants[key].status,
            shipped.constants[key].source,
        )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("rail", None), "rail is missing: expected a voltage (V) in quotes, with its unit"),
        (("force", None), "force is missing: expected gaps and forces"),
        (("mass", '"26 mm"'), "mass: the unit 'mm' is a length: expected a mass (kg)"),
        (("mass", '"-26 g"'), "mass = '-26 g': expected more than 0"),
        (("mass", "26"), "mass: '26' has no unit: expected a mass (kg)"),
        (("mas", '"26 g"'), "the key mas is not known: expected 'mass'"),
        (("resistance", '"-10 ohm"'), "resistance = '-10 ohm': expected more than 0"),
        (("end_gap", '"-1 mm"'), "end_gap = '-1 mm': expected 0 or more"),
        (("force", "[]"), "force = []: expected gaps and forces"),
        (("force", '[["1 mm", "2 N"], ["1 mm", "3 N"]]'), "force: a gap occurs twice"),
        (("force", '[["1 N", "2 N"]]'), "the unit 'N' is a force: expected a length (m)"),
        (("force", '[["1 mm", "0 N"]]'), "force, point 1 = '0 N': expected more than 0"),
        (("inductance", '"45 mH"'), "inductance = '45 mH': expected"),
        (("target", '"6 mm"'), "target = 6 mm: expected it within the stroke of 4.75 mm"),
        (("stop", "{ restitution = 2 }"), "stop.restitution = 2: expected 1 or less"),
        (("stop", '{ stiffness = "1 N/m" }'), "stop: expected both stiffness and damping, or neither"),
        (("stop", '{ hardness = "1 N/m" }'), "the key stop.hardness is not known"),
        (("spring", '{ preload = "4 N" }'), "spring.preload = 4 N: expected less than the 3."),
        (
            ("spring", '{ stiffness = "1 N/um" }'),
            "spring.stiffness = 1e+06 N/m: expected a spring that the magnet",
        ),
        (("assumed", '["colour"]'), "assumed: 'colour' is not a key of this sheet"),
        (("why", '{ colour = "red" }'), "why.colour: no such key: expected a key of this sheet"),
        (("driver", '{ shape = "sawtooth" }'), "driver.shape = 'sawtooth': expected one of"),
        (("name", '""'), "name = '': expected text in quotes"),
        (("make_contact", '{ gap = "4 mm" }'), "make_contact.force is missing"),
        (("break_contact", '{ force = "1 N" }'), "break_contact.overtravel is missing"),
        (
            ("make_contact", '{ gap = "5 mm", force = "1 N" }'),
            "make_contact.gap = 5 mm: expected less than the",
        ),
        (("bounce_time", '"4 ms"'), "make_contact is missing"),
    ],
)
def test_what_is_no_sheet_is_refused(change: tuple[str, str | None], said: str, tmp_path: Path) -> None:
    key, value = change
    lines = [line for line in PLAIN.splitlines() if not line.startswith(f"{key} =")]
    text = "\n".join([*lines, *([f"{key} = {value}"] if value else [])])
    with pytest.raises(ph.InputError) as error:
        made_of(text, tmp_path)
    assert str(error.value).startswith(str(tmp_path / "sheet.toml"))
    assert said in str(error.value)
    assert len(str(error.value).splitlines()) == 1


def test_a_pole_that_the_device_cannot_hold_is_named(tmp_path: Path) -> None:
    """5 N at 10 mm and 300 mA require a pole of about 80 cm2, whose armature would weigh kilograms."""
    wrong = PLAIN.replace(
        'force = [["0.25 mm", "85.9 N"], ["1 mm", "28.9 N"], ["2 mm", "11.1 N"], ["5 mm", "3.59 N"]]',
        'force = [["10 mm", "5 N"]]\ncurrent = "0.3 A"',
    ).replace('"4.75 mm"', '"10 mm"')
    for text, count in ((PLAIN, 0), (wrong, 1)):
        sheet = sheet_of(text, tmp_path)
        magnet = hammer_of(sheet)[1]
        assert len(implausible(sheet, magnet.part)) == count, text


@pytest.mark.parametrize("name", NAMES)
def test_the_shipped_devices_are_plausible(name: str, tmp_path: Path) -> None:
    sheet = sheet_of(SHEETS.joinpath(f"{name}.toml").read_text("utf-8"), tmp_path)
    assert implausible(sheet, hammer_of(sheet)[1].part) == []


def test_a_pole_wider_than_its_device_is_named(tmp_path: Path) -> None:
    area = hammer_of(sheet_of(PLAIN, tmp_path))[1].part.pole_area
    width = 2e3 * math.sqrt(area / math.pi)
    for size, count in ((0.99 * width, 1), (1.01 * width, 0)):
        sheet = sheet_of(f'{PLAIN}size = "{size} mm"', tmp_path)
        assert len(implausible(sheet, hammer_of(sheet)[1].part)) == count


def test_a_force_beyond_saturated_iron_is_named(tmp_path: Path) -> None:
    """A pole face of area A carries at most B A, and holds B^2 A / (2 mu0)."""
    for factor, count in ((0.99, 1), (1.01, 0)):
        # The area at which the largest force of the sheet, 85.9 N, saturates the pole.
        area = factor * 85.9 * 2.0 * MU0 / SATURATION**2
        sheet = sheet_of(f'{PLAIN}pole_diameter = "{2e3 * math.sqrt(area / math.pi)} mm"', tmp_path)
        found = [each for each in implausible(sheet, hammer_of(sheet)[1].part) if "saturated" in each]
        assert len(found) == count


CONTACTS = """
spring = { preload = "0.5 N", stiffness = "100 N/m" }
make_contact = { gap = "4 mm", force = "1.5 N" }
break_contact = { overtravel = "0.2 mm", force = "0.2 N" }
rating = "16 A at 250 V AC"
on_time = "40 ms"
"""


def test_contacts_become_springs_between_their_gap_and_the_end_of_the_stroke(tmp_path: Path) -> None:
    hammer = made_of(PLAIN + CONTACTS, tmp_path)
    assert hammer.constants["contact.make.position"].si == pytest.approx(4e-3)
    assert hammer.constants["contact.make.stiffness"].si == pytest.approx(1.5 / 0.75e-3, rel=1e-5)
    assert hammer.constants["contact.make.stiffness"].status == "derived"
    assert hammer.constants["contact.break.position"].status == "datasheet"
    assert hammer.constants["contact.break.stiffness"].si == pytest.approx(0.2 / 0.2e-3, rel=1e-5)
    assert "16 A at 250 V AC" in hammer.note
    # The work of the magnet, which determines the stiffness of the stop, excludes that of the contacts.
    bare = made_of(PLAIN + CONTACTS.replace('"1.5 N"', '"1e-9 N"').replace('"0.2 N"', '"1e-9 N"'), tmp_path)
    work = 0.5 * 1.5 * 0.75e-3 - 0.5 * 0.2 * 0.2e-3
    spared = bare.constants["pack.stiffness"].si - hammer.constants["pack.stiffness"].si
    left = 0.25e-3 + hammer.constants["magnet.residual_gap"].si
    assert spared == pytest.approx(2.0 * work / (0.25 * left) ** 2, rel=1e-2)


def test_switching_times_are_compared_with_the_limits(tmp_path: Path) -> None:
    sheet = sheet_of(PLAIN + CONTACTS, tmp_path)
    assert missed_limits(sheet, hammer_of(sheet)[0]) == []
    wide = 'operate_time = "1 s"\nrelease_time = "1 s"\nbounce_time = "1 s"'
    sheet = sheet_of(f"{PLAIN}{CONTACTS}{wide}", tmp_path)
    assert missed_limits(sheet, hammer_of(sheet)[0]) == []
    sheet = sheet_of(f'{PLAIN}{CONTACTS}operate_time = "1 ms"', tmp_path)
    missed = missed_limits(sheet, hammer_of(sheet)[0])
    assert len(missed) == 2
    assert all("operate time" in each for each in missed)
    # A pulse too short to lift the armature: one sentence for each contact, not for each of its limits.
    brief = CONTACTS.replace("40 ms", "0.1 ms")
    sheet = sheet_of(f"{PLAIN}{brief}{wide}", tmp_path)
    assert [each.split(",")[0] for each in missed_limits(sheet, hammer_of(sheet)[0])] == [
        "the make contact does not switch",
        "the break contact does not switch",
    ]
