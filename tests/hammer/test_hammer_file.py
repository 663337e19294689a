"""Hammer files: every bad input raises one sentence with file, key, value and expectation."""

import copy
import json
import re
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.errors import refused
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.drive.waveforms.shapes import SHAPES
from printhammer.parts import PARTS

GOOD = ph.load(CRUDE).to_toml()


def changed(old: str, new: str) -> str:
    """Return the shipped file with one text replaced at its first occurrence."""
    text = re.sub(old, new, GOOD, count=1, flags=re.MULTILINE)
    assert text != GOOD
    return text


def constant(key: str, text: str) -> str:
    """Return the shipped file with a changed value and unit of a constant."""
    number, unit = text.split(" ", 1)
    return changed(
        rf'^{key} = {{ value = [^,]*, unit = "[^"]*"', f'{key} = {{ value = {number}, unit = "{unit}"'
    )


# What is wrong with the file, and the key, value and expectation that the sentence must name.
BAD = {
    "unknown key": (changed("^mass", "mess = 1\nmass"), ["the key mess is not known", "expected 'mass'"]),
    "unknown key of a part": (changed("^Am", "Amm"), ["the key magnet.Amm is not known", "expected 'Am'"]),
    "unknown key of a constant": (
        changed("status", "state"),
        ["the key mass.state is not known", "'status'"],
    ),
    "unknown table": (
        changed(r"^\[spring\]", "[feather]"),
        ["the key feather is not known: expected one of"],
    ),
    "key that is not printable": (changed("^mass", '"a\\\\nb" = 1\nmass'), [r"the key 'a\nb' is not known"]),
    "no unit": (changed(', unit = "g"', ""), ["mass = 0.397975875", "has no unit", "a mass (kg)"]),
    "empty unit": (constant("mass", "1 "), ["mass.unit = ''", "expected a unit"]),
    "unknown unit": (constant("mass", "1 grams-ish"), ["mass = 1 grams-ish", "is not known"]),
    "force for a length": (constant("front", "60 lbf"), ["pack.front = 60 lbf", "a force", "a length (m)"]),
    "length for a mass": (constant("mass", "1 in"), ["mass = 1 in", "a length", "expected a mass (kg)"]),
    "time for a current": (
        constant("amplitude", "1 us"),
        ["waveform.amplitude = 1 us", "a time", "expected a current (A)"],
    ),
    "negative mass": (constant("mass", "-0.4 g"), ["mass = -0.4 g", "expected more than 0 kg"]),
    "no mass at all": (constant("mass", "0 g"), ["mass = 0 g", "expected more than 0 kg"]),
    "NaN": (constant("mass", "nan g"), ["mass = nan", "expected a finite number"]),
    "infinity": (constant("F0", "-inf N"), ["magnet.F0 = -inf", "expected a finite number"]),
    "overflow": (constant("mass", "1e308 Gg"), ["mass = 1e+308 Gg", "is not a finite number"]),
    "a number of many digits": (constant("mass", "9" * 5000 + " g"), ["expected a TOML file"]),
    "text for a number": (constant("mass", '"1" g'), ["mass = '1'", "expected a finite number"]),
    "true for a number": (constant("mass", "true g"), ["mass = True", "expected a finite number"]),
    "a bare number": (
        changed("^mass = .*", "mass = 4e-4"),
        ["mass = 0.0004", "expected a mass (kg) as { value"],
    ),
    "a table for an option": (
        changed('"loading-branch"', "{ value = 1 }"),
        ["pack.reloading = {'value': 1}", "expected 'loading-branch' or 'unloading-curve'"],
    ),
    "no status": (
        changed(', status = "stated"', ""),
        ["platen = 0.015", "has no status", "(stated, "],
    ),
    "unknown status": (
        changed('"stated"', '"sworn"'),
        ["platen.status = 'sworn'", "expected one of stated,"],
    ),
    "no source": (changed(', source = "H[^"]*"', ""), ["platen = 0.015", "has no source"]),
    "blank source": (
        changed('source = "H[^"]*"', 'source = " "'),
        ["platen.source = ' '", "expected a source"],
    ),
    "number for a source": (changed('source = "H[^"]*"', "source = 3"), ["platen.source = 3"]),
    "no law": (
        changed("^law.*", ""),
        [
            "magnet.law is missing",
            "expected one of inverse-root, linkage-table, moving-coil, reluctance, table",
        ],
    ),
    "unknown law": (
        changed('"inverse-root"', '"cubic"'),
        ["magnet.law = 'cubic'", "inverse-root, linkage-table, moving-coil, reluctance, table"],
    ),
    "list for a law": (
        changed('"inverse-root"', "[]"),
        ["magnet.law = []", "inverse-root, linkage-table, moving-coil, reluctance, table"],
    ),
    "unknown shape": (
        changed('"rectangle"', '"round"'),
        ["waveform.shape = 'round'", "half-sine, rectangle"],
    ),
    "unknown option": (changed('"loading-branch"', '"x"'), ["pack.reloading = 'x'", "'unloading-curve'"]),
    "missing constant": (changed("^Bm.*", ""), ["magnet.Bm is missing", "N^0.5 m^0.25/A"]),
    "missing mass": (changed("^mass.*", ""), ["mass is missing: expected mass of the armature (kg)"]),
    "no thickness": (constant("thickness", "0 in"), ["pack.thickness = 0 in", "expected more than 0 m"]),
    "negative thickness": (
        constant("thickness", "-1 in"),
        ["pack.thickness = -1 in", "expected more than 0 m"],
    ),
    "negative damping": (
        constant("damping", "-1 N s/m^2.5"),
        ["backstop.damping = -1 N s/m^2.5", "0 N s/m^2.5 or"],
    ),
    "backstop beyond the pack": (
        constant("position", "0.009 in"),
        ["backstop.position = 0.009 in", "before pack.front = 0.008 in"],
    ),
    "backstop at the pack": (constant("position", "0.008 in"), ["before pack.front = 0.008 in"]),
    "pack beyond the platen": (
        constant("front", "0.4 mm"),
        ["pack.front = 0.4 mm", "before platen = 0.015 in"],
    ),
    "backstop where the magnet is singular": (
        constant("position", "0 in"),
        ["backstop.position = 0 in", "where the magnet's law holds"],
    ),
    "pack out of the range of the magnet": (
        changed("^Bm", 'range_max = { value = 0.1, unit = "mm", status = "stated", source = "x" }\nBm'),
        ["pack.front = 0.008 in", "where the magnet's law holds, 0 to 0.0001 m"],
    ),
    "a part that is no table": (
        changed(r"^\[coil\]|^mass", "coil = 1\nmass"),
        ["coil = 1", "a table [coil]"],
    ),
    "missing format": (changed("^format.*", ""), ["format is missing: expected format = 1"]),
    "other format": (changed("^format.*", "format = 2"), ["format = 2: expected 1"]),
    "format of another kind": (changed("^format.*", "format = 1.0"), ["format = 1.0: expected 1"]),
    "unknown view": (changed("^format.*", "format = 1\nviews = ['plan']"), ["views = ['plan']", "phase"]),
    "no name": (changed("^name.*", ""), ["name is missing"]),
    "number for a name": (changed("^name.*", "name = 3"), ["name = 3: expected text"]),
    "no TOML": ("mass: 3 kg\n", ["expected a TOML file", "line 1"]),
    "nothing": ("", ["format is missing"]),
    "twice the same key": (changed("^mass", "platen = 1\nmass"), ["expected a TOML file"]),
    "no file": (
        changed('^law = "inverse-root"(.|\n)*?^\n', 'law = "table"\n\n'),
        ["magnet.file is missing"],
    ),
    "a file that is not there": (
        changed('^law = "inverse-root"(.|\n)*?^\n', 'law = "table"\nfile = "gone.csv"\n\n'),
        ["gone.csv", "no such file"],
    ),
    "a record that is not there": (
        changed('^shape = "rectangle"(.|\n)*', 'shape = "sampled"\nfile = "gone.csv"\n'),
        ["gone.csv", "no such file"],
    ),
}


@pytest.mark.parametrize(("text", "parts"), BAD.values(), ids=BAD.keys())
def test_bad_input_is_one_sentence(tmp_path: Path, text: str, parts: list[str]) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ph.InputError) as caught:
        ph.load(path)
    told = str(caught.value)
    assert told.startswith(f"{path}: ")
    assert "\n" not in told
    for part in parts:
        assert part in told


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    with refused(None):
        ph.load("nobody")
    with refused(None):
        ph.load("hendriks-1893")
    with refused(None):
        ph.load(tmp_path)
    with refused(None):
        ph.load("a\0b")
    (tmp_path / "latin.toml").write_bytes('name = "\xe4"'.encode("latin-1"))
    with refused(None, file="latin.toml"):
        ph.load(tmp_path / "latin.toml")


def test_inch_pound_and_si_say_the_same() -> None:
    metric = GOOD
    for key, text in {
        "platen": "381 um",
        "front": "203.2 um",
        "thickness": "0.1778 mm",
        "position": "5.08e-5 m",
    }.items():
        number, unit = text.split(" ")
        metric = re.sub(
            rf'^{key} = {{ value = [^,]*, unit = "in"',
            f'{key} = {{ value = {number}, unit = "{unit}"',
            metric,
            flags=re.MULTILINE,
        )
    assert 'unit = "in"' not in metric
    assert ph.Hammer.from_toml(metric).fingerprint == ph.Hammer.from_toml(GOOD).fingerprint


def test_hertz_backstop_from_bodies_and_a_rebound() -> None:
    bodies = {
        "radius1": (5, "mm"),
        "radius2": (0.2, "in"),
        "youngs_modulus1": (30e6, "psi"),
        "youngs_modulus2": (207, "GPa"),
        "poisson_ratio1": (0.3, "1"),
        "poisson_ratio2": (0.3, "1"),
        "restitution": (0.5, "1"),
        "restitution_speed": (20, "in/s"),
    }
    lines = [
        f'{key} = {{ value = {v}, unit = "{u}", status = "assumed", source = "x" }}'
        for key, (v, u) in bodies.items()
    ]
    text = changed(
        r"^(law = .hertz.*\nposition.*\n)stiffness.*\ndamping.*\n", "\\1" + "\n".join(lines) + "\n"
    )
    hammer = ph.Hammer.from_toml(text)
    assert hammer.to_toml() == text
    assert hammer.constants["backstop.radius2"].si == 0.00508
    stiffness, damping, _ = hammer.backstop.packed(0.0)  # type: ignore[union-attr]
    # E* of steel on steel is about 114 GPa, R about 2.52 mm: 4/3 E* sqrt(R).
    assert stiffness == pytest.approx(4 / 3 * 113.7e9 * 0.00252**0.5, rel=2e-3)
    assert 0.0 < damping * 0.508 / stiffness < 2.0


@given(st.text(max_size=30), st.integers(0, len(GOOD)), st.integers(0, 30))
@settings(max_examples=75)
def test_any_text_is_read_or_refused(text: str, place: int, cut: int) -> None:
    told = ""
    try:
        ph.Hammer.from_toml(GOOD[:place] + text + GOOD[place + cut :])
    except ph.InputError as error:
        told = str(error)
    assert "\n" not in told


LEAVES = [
    (section, key)
    for section, table in tomllib.loads(GOOD).items()
    if isinstance(table, dict)
    for key in table
    if section not in ("mass", "platen")
]
anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=2) | st.dictionaries(st.sampled_from(["value", "unit", "x"]), inner)
    ),
    max_leaves=4,
)


@given(st.sampled_from(LEAVES), anything)
def test_any_value_is_taken_or_refused(hammer: ph.Hammer, leaf: tuple[str, str], value: object) -> None:
    told = ""
    try:
        hammer.replace(".".join(leaf), value)
    except ph.InputError as error:
        told = str(error)
    assert "\n" not in told


@pytest.fixture(scope="module")
def validator() -> jsonschema.protocols.Validator:
    schema = json.loads(json.dumps(ph.Hammer.schema()))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_schema_holds_every_part_and_shape(validator: jsonschema.protocols.Validator) -> None:
    properties = validator.schema["properties"]
    for role in ("magnet", "spring", "pack", "backstop"):
        kinds = {entry["properties"]["law"]["const"] for entry in properties[role]["oneOf"]}
        assert kinds == {law for known, law in PARTS if known == role}
    shapes = {entry["properties"]["shape"]["const"] for entry in properties["waveform"]["oneOf"]}
    assert shapes == set(SHAPES)
    assert validator.schema["required"] == ["format", "name", "mass"]


def test_schema_takes_the_shipped_file(validator: jsonschema.protocols.Validator) -> None:
    validator.validate(tomllib.loads(GOOD))


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("", "mess", 1),
        ("", "views", ["plan"]),
        ("", "format", 2),
        ("", "mass", 4e-4),
        ("mass", "value", -1),
        ("mass", "unit", ""),
        ("mass", "status", "sworn"),
        ("mass", "x", 1),
        ("magnet", "law", "cubic"),
        ("magnet", "x", 1),
        ("pack", "reloading", "x"),
        ("pack", "thickness", {"value": 0, "unit": "in", "status": "stated", "source": "x"}),
        ("backstop", "pull", 1),
        ("waveform", "quantity", "current"),
    ],
)
def test_schema_refuses(
    validator: jsonschema.protocols.Validator, section: str, key: str, value: object
) -> None:
    document: dict[str, Any] = copy.deepcopy(tomllib.loads(GOOD))
    (document[section] if section else document)[key] = value
    assert not validator.is_valid(document)
