"""The hammer: contents, replacement, fingerprint, saving, checks."""

import pickle
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.errors import refused
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.drive.waveforms.shapes import HalfSine
from printhammer.hammer.equilibrium import pull_reversals
from printhammer.hammer.hammer import shipped
from printhammer.parts.backstop.elastomer import ElastomerBackstop
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.backstop.rigid import RigidBackstop
from printhammer.parts.magnet.table import TableMagnet
from printhammer.parts.spring.linear import PreloadSpring

OSCILLATOR = """
format = 1
name = "oscillator"   # a textbook impact oscillator

mass = { value = 1, unit = "kg", status = "assumed", source = "textbook" }  # heavy

[spring]
law = "preload"
preload = { value = 0.0, unit = "N", status = "assumed", source = "textbook" }
stiffness = { value = 1.0, unit = "N/m", status = "assumed", source = "textbook" }
"""
TABLE = "displacement [um],current [A],force [N]\n" + "".join(
    f"{x},{current},{-5 + 2 * current}\n" for x in (10, 200, 400) for current in (-1, 0, 2)
)

# The first reconstruction as it was found, SI; geometry as the captions of Figs. 2 and 3 print it.
FOUND = {
    "mass": 0.000397975875,
    "platen": 381.0e-6,
    "magnet.F0": 2.47161892,
    "magnet.Am": 0.437407904,
    "magnet.Bm": 0.0930958152,
    "spring.Bs": 14.2981139,
    "spring.As": 0.000466221211,
    "pack.stiffness": 258.826321,
    "pack.front": 203.2e-6,
    "pack.thickness": 177.8e-6,
    "backstop.position": 50.8e-6,
    "backstop.stiffness": 1.15608224e09,
    "backstop.damping": 417549759.0,
    "waveform.amplitude": 0.926579285,
    "waveform.width": 0.000351910639,
    "waveform.rise": 1.06988612e-05,
    "waveform.decay": 2.43049158e-05,
}


def test_shipped_hammer_is_the_first_reconstruction(hammer: ph.Hammer) -> None:
    assert {key: constant.si for key, constant in hammer.constants.items()} == FOUND
    stated = {key for key, constant in hammer.constants.items() if constant.status == "stated"}
    assert stated == {"platen", "pack.front", "backstop.position"}
    assert hammer.constants["pack.thickness"].status == "derived"
    assert {constant.status for constant in hammer.constants.values()} == {
        "stated",
        "derived",
        "reconstructed",
    }
    assert "first reconstruction" in " ".join(hammer.note.split())
    assert "The paper prints no constants" in hammer.note
    assert hammer.coil_resistance is None
    assert hammer.name == "hendriks-1983"
    assert hammer.name in shipped()
    assert hammer.warnings() == []


def test_attributes_are_si(hammer: ph.Hammer) -> None:
    assert hammer.mass == FOUND["mass"]
    assert hammer.platen == FOUND["platen"]
    assert hammer.position == hammer.origin == FOUND["backstop.position"]
    assert hammer.front == FOUND["pack.front"]
    assert isinstance(hammer.backstop, HertzBackstop)
    assert hammer.backstop.k == FOUND["backstop.stiffness"]
    assert hammer.waveform is not None
    assert hammer.waveform.quantity == "current"
    assert set(hammer.parts) == {"magnet", "spring", "pack", "backstop"}
    constant = hammer.constants["magnet.Am"]
    assert (constant.unit, constant.si_unit, constant.symbol) == ("N^0.5 m^0.25", "N^0.5 m^0.25", "Am")


def test_a_hammer_may_lack_all_but_the_mass() -> None:
    text = OSCILLATOR[: OSCILLATOR.index("[spring]")]
    bare = ph.Hammer.from_toml(text)
    assert bare.mass == 1.0
    assert (bare.magnet, bare.spring, bare.pack, bare.backstop, bare.waveform) == (None,) * 5
    assert (bare.position, bare.front, bare.origin, bare.platen) == (None, None, 0.0, None)
    assert bare.warnings() == []


def test_a_textbook_oscillator_is_built_of_parts() -> None:
    built = ph.Hammer.build(
        "2 kg",
        name="oscillator",
        spring=PreloadSpring(preload=0.0, stiffness=1.0),
        backstop=RigidBackstop(position=0.0, restitution=0.8),
    )
    assert (built.name, built.mass, set(built.parts)) == ("oscillator", 2.0, {"spring", "backstop"})
    assert built.spring == PreloadSpring(preload=0.0, stiffness=1.0)
    assert {constant.source for constant in built.constants.values()} == {"given in Python"}
    assert ph.Hammer.from_toml(built.to_toml()) == built
    with refused("mass"):
        ph.Hammer.build(0.0, name="oscillator")
    with refused("wheel"):
        ph.Hammer.build(1.0, wheel=None)


def test_replace_leaves_the_old_hammer_alone(hammer: ph.Hammer) -> None:
    stiff = hammer.replace("pack.stiffness", "60 lbf")
    assert hammer.constants["pack.stiffness"].si == FOUND["pack.stiffness"]
    constant = stiff.constants["pack.stiffness"]
    assert (constant.value, constant.unit) == (60.0, "lbf")
    assert constant.si == pytest.approx(60 * 4.4482216152605, rel=1e-15)
    assert (constant.status, constant.source) == ("assumed", "replaced")
    assert stiff.pack is not None
    assert stiff.pack.packed(0.0)[0] == constant.si
    assert stiff != hammer


def test_replace_takes_si_numbers_constants_and_provenance(hammer: ph.Hammer) -> None:
    measured = hammer.replace("mass", 4e-4, status="stated", source="scales, 2024-05-01")
    assert measured.mass == 4e-4
    assert measured.constants["mass"].status == "stated"
    assert measured.constants["mass"].source == "scales, 2024-05-01"
    back = measured.replace("mass", hammer.constants["mass"])
    assert back == hammer
    assert back.fingerprint == hammer.fingerprint


def test_replace_sets_several_keys_together(hammer: ph.Hammer) -> None:
    # One after the other, the front would be behind the platen.
    far = hammer.replace({"platen": "1 mm", "pack.front": "0.9 mm", "pack.reloading": "unloading-curve"})
    assert far.front == 9e-4
    assert far.pack is not None
    assert far.pack.model_dump()["reloading"] == "unloading-curve"
    with pytest.raises(ph.InputError):
        hammer.replace("pack.front", "0.9 mm")


def test_replace_one_way_of_giving_a_constant_by_another(hammer: ph.Hammer) -> None:
    other = hammer.replace(
        {"backstop.damping": None, "backstop.restitution": 0.5, "backstop.restitution_speed": "30 in/s"}
    )
    assert isinstance(other.backstop, HertzBackstop)
    assert other.backstop.l > 0.0
    assert other.constants["backstop.restitution"].unit == "1"
    assert "backstop.damping" not in other.constants
    assert ph.Hammer.from_toml(other.to_toml()) == other


@pytest.mark.parametrize(
    "part",
    [
        RigidBackstop(position=5e-5, restitution=0.4),
        {"law": "rigid", "position": 5e-5, "restitution": "40 %"},
        {"law": "rigid", "position": {"value": 50, "unit": "um"}, "restitution": 0.4},
    ],
    ids=["part", "mapping", "constants"],
)
def test_replace_a_whole_part(hammer: ph.Hammer, part: object) -> None:
    rigid = hammer.replace("backstop", part, source="a thought")
    assert rigid.backstop == RigidBackstop(position=5e-5, restitution=0.4)
    assert rigid.constants["backstop.restitution"].source == "a thought"
    again = ph.Hammer.from_toml(rigid.to_toml())
    assert again == rigid
    assert again.fingerprint == rigid.fingerprint
    assert rigid.replace("backstop.restitution", 0.3).constants["backstop.restitution"].si == 0.3


def test_replace_keeps_options_of_a_part(hammer: ph.Hammer) -> None:
    soft = ElastomerBackstop(position=5e-5, stiffness=8e7, relaxation_time=1e-5, pull=True)
    assert hammer.replace("backstop", soft).backstop == soft


def test_a_bare_number_for_a_force_stays_a_force(hammer: ph.Hammer) -> None:
    pushed = hammer.replace("waveform", HalfSine(amplitude="3 N", width="100 us"))
    harder = pushed.replace("waveform.amplitude", 4.0)
    assert harder.waveform == HalfSine(amplitude="4 N", width="100 us")
    assert harder.constants["waveform.amplitude"].unit == "N"
    assert harder.replace("waveform.amplitude", "2 A").waveform == HalfSine(amplitude=2.0, width=1e-4)


def test_replace_the_waveform_and_take_parts_away(hammer: ph.Hammer) -> None:
    pushed = hammer.replace("waveform", HalfSine(amplitude="3 N", width="100 us"))
    assert pushed.waveform is not None
    assert pushed.waveform.quantity == "force"
    assert pushed.constants["waveform.amplitude"].si_unit == "N"
    bare = pushed.replace({"magnet": None, "pack": None, "backstop": None, "waveform": None, "platen": None})
    assert set(bare.constants) == {"mass", "spring.Bs", "spring.As"}
    assert ph.Hammer.from_toml(bare.to_toml()) == bare


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("pack.stifness", 1.0, "the key 'pack.stifness' is not known"),
        ("stiffness", 1.0, "the key 'stiffness' is not known"),
        ("pack.front.value", 1.0, "the key 'pack.front.value' is not known"),
        ("wheel.radius", 1.0, "the key 'wheel.radius' is not known"),
        ("pack.law", "dashpot", "expected a whole table for 'pack' instead"),
        ("pack.stiffness", "60", "pack.stiffness: '60' has no unit: expected a force (N)"),
        ("pack.stiffness", "60 m", "pack.stiffness = 60.0 m: the unit 'm' is a length: expected a force (N)"),
        ("pack.stiffness", float("nan"), "pack.stiffness = nan: expected a finite number"),
        ("pack.stiffness", [1], "pack.stiffness = [1]: expected a number in N or text"),
        ("pack.stiffness", None, "pack.stiffness is missing: expected indenter area"),
        ("mass", None, "mass is missing: expected mass of the armature (kg)"),
        ("mass", -1.0, "mass = -1.0 kg: expected more than 0 kg"),
        ("pack.reloading", "both", "pack.reloading = 'both': expected 'loading-branch' or 'unloading-curve'"),
        ("backstop.pull", "no", "backstop.pull = 'no': expected true or false"),
        ("backstop", {"position": 0.0}, "backstop.law = None: expected one of elastomer, hertz, rigid"),
        ("backstop", 7, "backstop = 7: expected a part, a table, or None"),
        ("name", 7, "name = 7: expected text in quotes"),
    ],
)
def test_replace_refuses_in_one_sentence(hammer: ph.Hammer, key: str, value: object, sentence: str) -> None:
    with pytest.raises(ph.InputError) as caught:
        hammer.replace(key, value)
    # The file is as it should be.
    assert str(caught.value).startswith(f"{CRUDE}, changed: ")
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_hammer_in_memory_is_not_called_its_file(hammer: ph.Hammer) -> None:
    assert hammer.path == str(CRUDE)
    assert hammer.replace("mass", 4e-4).replace("mass", 5e-4).path == f"{CRUDE}, changed"
    made = ph.Hammer.build(4e-4, name="ball")
    assert made.path == "ball"
    with refused("waveform"):
        ph.quality(made, 900.0)


def test_a_table_held_in_memory_cannot_be_written_to_a_file(hammer: ph.Hammer) -> None:
    table = TableMagnet.from_arrays([1e-5, 4e-4], [0.0, 1.0], [[-5.0, 1.0], [-5.0, 1.0]])
    with refused("magnet"):
        hammer.replace("magnet", table)


def test_an_unchanged_file_is_written_back_to_the_byte(hammer: ph.Hammer, tmp_path: Path) -> None:
    hammer.save(tmp_path / "same.toml")
    again = ph.load(tmp_path / "same.toml")
    assert again.to_toml() == hammer.to_toml()
    assert again == hammer
    odd = OSCILLATOR.replace("\n", "\r\n")
    (tmp_path / "odd.toml").write_bytes(odd.encode())
    ph.load(tmp_path / "odd.toml").save(tmp_path / "odder.toml")
    assert (tmp_path / "odder.toml").read_bytes() == odd.encode()


def test_comments_and_layout_survive_a_replacement(hammer: ph.Hammer) -> None:
    text = hammer.replace("magnet.F0", "0.5 lbf").to_toml()
    changed = [
        (old, new)
        for old, new in zip(hammer.to_toml().splitlines(), text.splitlines(), strict=True)
        if old != new
    ]
    assert len(changed) == 1
    assert changed[0][1].startswith('F0 = { value = 0.5, unit = "lbf", status = "assumed"')
    oscillator = ph.Hammer.from_toml(OSCILLATOR).replace({"mass": "2 kg", "platen": "3 m", "note": "a\nb"})
    text = oscillator.to_toml()
    assert "# a textbook impact oscillator" in text
    assert re.search(r"^mass = .*# heavy$", text, re.MULTILINE)
    assert ph.Hammer.from_toml(text) == oscillator
    assert ph.Hammer.from_toml(text).note == "a\nb"


KEYS = sorted(FOUND)


@settings(max_examples=40)
@given(
    st.dictionaries(st.sampled_from(KEYS), st.floats(0.97, 1.03)),
    st.sampled_from(["a # b", 'c "d"', "e\\f µ"]),
)
def test_any_replacement_is_written_back_without_loss(
    hammer: ph.Hammer, factors: dict[str, float], source: str
) -> None:
    other = hammer.replace({key: FOUND[key] * factor for key, factor in factors.items()}, source=source)
    again = ph.Hammer.from_toml(other.to_toml())
    assert again == other
    assert again.fingerprint == other.fingerprint
    assert dict(again.constants) == dict(other.constants)
    for key, factor in factors.items():
        assert again.constants[key].si == FOUND[key] * factor


def test_fingerprint_sees_physics_only(hammer: ph.Hammer) -> None:
    told = {"title": "another", "note": "", "name": "x"}
    assert hammer.replace(told).fingerprint == hammer.fingerprint
    inches = hammer.replace({"platen": 381.0e-6, "pack.front": "203.2 um", "backstop.position": "2 mil"})
    assert inches.fingerprint == hammer.fingerprint
    assert inches != hammer
    assert hammer.replace("backstop.pull", True).fingerprint == hammer.fingerprint
    seen = {hammer.fingerprint}
    for key, value in [
        ("backstop.pull", False),
        ("pack.reloading", "unloading-curve"),
        ("coil.resistance", "5 ohm"),
        ("platen", None),
        ("waveform", None),
        *((key, value * (1 + 2.0**-50)) for key, value in FOUND.items()),
    ]:
        seen.add(hammer.replace(key, value).fingerprint)
    assert len(seen) == 1 + 5 + len(FOUND)


def test_fingerprint_sees_the_contents_of_a_table(hammer: ph.Hammer, tmp_path: Path) -> None:
    hammer.save(tmp_path / "h.toml")
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "b.csv").write_text(TABLE.replace("[um]", "[µm]"), encoding="utf-8")
    (tmp_path / "c.csv").write_text(TABLE.replace("-5", "-5.5"))
    loaded = ph.load(tmp_path / "h.toml")
    one, same, other = (loaded.replace("magnet", {"law": "table", "file": f"{name}.csv"}) for name in "abc")
    assert one.fingerprint == same.fingerprint
    assert one.fingerprint != other.fingerprint
    assert one.magnet is not None
    assert one.magnet.domain == (1e-5, 4e-4)


def test_tables_are_saved_beside_the_file(hammer: ph.Hammer, tmp_path: Path) -> None:
    (tmp_path / "force.csv").write_text(TABLE)
    hammer.save(tmp_path / "h.toml")
    table = ph.load(tmp_path / "h.toml").replace("magnet", {"law": "table", "file": "force.csv"})
    table.save(tmp_path / "h.toml")
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    table.save(folder / "h.toml")
    assert ph.load(folder / "h.toml") == table
    (folder / "force.csv").write_text("something else")
    with refused(None, file="force.csv"):
        table.save(folder / "h.toml")
    assert (folder / "force.csv").read_text() == "something else"


def test_what_cannot_be_written_leaves_nothing_behind(hammer: ph.Hammer, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    (tmp_path / "folder.toml").mkdir()
    for target in (tmp_path / "file" / "h.toml", tmp_path / "missing" / "h.toml", tmp_path / "folder.toml"):
        with refused(None):
            hammer.save(target)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "folder.toml"]
    assert (tmp_path / "file").read_text() == "kept"


def test_hammers_travel_between_processes(hammer: ph.Hammer) -> None:
    other = hammer.replace("mass", "0.5 g")
    again = pickle.loads(pickle.dumps(other))
    assert again == other
    assert hash(again) == hash(other)
    assert again.to_toml() == other.to_toml()
    assert again.fingerprint[:8] in repr(again)


def test_a_hammer_that_flies_off_its_backstop_is_refused(hammer: ph.Hammer) -> None:
    # At 0.002 in, Am^2 / sqrt(x) is 26.8 N against F0 + Bs = 16.8 N; a spring of 30 N overcomes it.
    for force in ("30 N", 0.437407904**2 / 50.8e-6**0.5 - 2.47161892 + 1e-9):
        with refused("rest", file="hendriks-1983.toml"):
            hammer.replace("spring.Bs", force).check()
    with refused("rest"):
        hammer.replace("spring.Bs", "30 N").warnings()
    hammer.replace({"spring.Bs": "30 N", "magnet": None}).check()


def test_a_hammer_that_may_not_return_is_a_warning_that_names_the_interval(hammer: ph.Hammer) -> None:
    # F = 2 - 0.02/sqrt(x) + Bs, at x = 1e-4 m it is zero for Bs = 0; the spring is nearly constant.
    weak = hammer.replace({"magnet.F0": 2.0, "magnet.Am": 0.02**0.5, "spring.Bs": 1e-12, "spring.As": 1.0})
    told = "positive from 100 to 381 um: the armature may never return from there"
    assert weak.warnings() == [f"the net force at zero current is {told}"]


def test_a_measured_pull_that_changes_sign_is_a_warning(tmp_path: Path) -> None:
    # L = 40 + 24 x - 2.4 x^2 mH, x in mm: the force at 1 A, 12 - 2.4 x N, is zero at 5 mm.
    linkages = {0: 40.0, 2: 78.4, 4: 97.6, 6: 97.6, 8: 78.4}
    table = tmp_path / "plunger.csv"
    rows = [f"{place},0,0\n{place},1,{linkage}" for place, linkage in linkages.items()]
    table.write_text("\n".join(["displacement [mm],current [A],linkage [mWb]", *rows, ""]))
    magnet = {"law": "linkage-table", "file": str(table)}
    spring = PreloadSpring(preload=-0.5, stiffness=20.0)
    turning = ph.Hammer.build(
        0.02, magnet=magnet, spring=spring, backstop=RigidBackstop(position=0.0, restitution=0.3)
    )
    (place,) = pull_reversals(turning)
    assert place == pytest.approx(5e-3, rel=1e-9)
    assert turning.warnings() == ["the pull changes sign at 5 mm within the table"]
    # Behind a backstop at 6 mm the armature does not come there, and a formula is no table.
    assert pull_reversals(turning.replace("backstop.position", "6 mm")) == []
    assert pull_reversals(ph.load("relay-5v")) == []
