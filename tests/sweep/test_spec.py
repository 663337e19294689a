"""Specs: what is read, and every fault in one sentence that names key, value and what was expected."""

from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import printhammer as ph
from printhammer.sweep.plan import make_plan
from printhammer.sweep.spec import read_spec
from printhammer.sweep.tables import schema

GOOD: dict[str, Any] = {
    "format": 1,
    "hammer": "hendriks-1983",
    "drive": {"train": {"pulses": 2}},
    "axis": [{"key": "drive.rate", "values": ["1 kHz", "1.2 kHz"]}],
    "outputs": {"dots": ["struck"]},
}
LATIN = {"design": "latin-hypercube", "members": 5, "seed": 1}
RANGE = {"key": "mass", "low": "3 g", "high": "4 g"}


SEQUENCE = {
    "sequence": {"at": ["0 us"], "waveforms": ["a"]},
    "waveforms": {"a": {"shape": "half-sine", "amplitude": "1 A", "width": "1 ms"}},
}


def changed(**changes: Any) -> dict[str, Any]:
    found = {**deepcopy(GOOD), **changes}
    return {name: value for name, value in found.items() if value is not None}


def axes(*tables: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return changed(axis=list(tables), drive={"train": {"pulses": 2, "rate": "1 kHz"}}, **changes)


@pytest.mark.parametrize(
    ("spec", "told"),
    [
        (changed(format=2), r"format = 2: expected 1"),
        (changed(hammer=None), r"hammer is missing, expected name of a shipped hammer"),
        (changed(hammer="no-such.toml"), r"no-such.toml: there is no such file"),
        (changed(colour="red"), r"the key colour is not known, expected one of format"),
        (changed(tolerance=2.0), r"tolerance = 2.0: expected less than or equal to 0.00001"),
        (changed(duration="3"), r"duration: '3' has no unit, expected a time"),
        (changed(duration=0.003), r"duration = 0.003 has no unit"),
        (changed(duration="-3 ms"), r"duration = -0.003 s: expected more than 0 s"),
        (changed(chunk=0), r"chunk = 0: expected greater than or equal to 1"),
        (changed(members=3), r"members is given, a grid is expected to have none"),
        (changed(axis=[]), r"axis = \[\]"),
        (changed(outputs={}), r"outputs: nothing is asked for"),
        (changed(outputs={"dots": ["stuck"]}), r"outputs.dots: 'stuck' is not known, expected 'struck'"),
        (changed(outputs={"dots": ["struck", "struck"]}), r"expected different names"),
        (changed(outputs={"final": 1}), r"outputs.final = 1: expected true or false"),
        (changed(outputs={"speed": True}), r"the key outputs.speed is not known, expected one of dots"),
        (
            changed(outputs={"displacement": {"end": "1 ms", "count": 1}}),
            r"outputs.displacement: expected at least 2 times",
        ),
        (changed(drive={}), r"drive: expected exactly one of the tables"),
        (changed(drive={"burst": {}}), r"burst.pulses is missing"),
        (changed(drive={"train": {"pulses": 2, "rat": 1}}), r"train.rat = 1 is not known"),
        (
            changed(drive={"train": {"pulses": 2, "rate": "1 kHz"}}),
            r"drive.train.rate is given beside the axis",
        ),
        (changed(drive="none.toml"), r"none.toml: the drive file cannot be read"),
        (changed(constants={"pack.stifness": "1 N"}), r"constants: 'pack.stifness' names no constant"),
        (axes({"key": "pack.stifness", "values": ["1 N"]}), r"expected 'pack.stiffness'"),
        (axes({"key": "drive.rat", "values": ["1 Hz"]}), r"axis\[0\].key = 'drive.rat' names no constant"),
        (axes({"key": "drive.at.1", "values": ["1 ms"]}), r"the axis 'drive.at.1' names no firing"),
        (
            changed(drive=SEQUENCE, axis=[{"key": "waveform.width", "values": ["1 ms"]}]),
            r"the axis 'waveform.width' changes what \[drive.sequence\] does not fire",
        ),
        (
            changed(drive=SEQUENCE, axis=[{"key": "waveforms.b.width", "values": ["1 ms"]}]),
            r"names no constant of .* or its drive, expected 'waveforms.a.amplitude'",
        ),
        (
            changed(drive=SEQUENCE, axis=[{"key": "waveforms.a.amplitude", "values": ["1 N"]}]),
            r"is a force, expected a current",
        ),
        (axes({"key": "mass"}), r"axis\[0\] \(mass\).low is missing, expected values, or low, high"),
        (axes({"key": "mass", "values": []}), r"values = \[\]: expected a list of quantities, at least one"),
        (axes({"key": "mass", "values": [1.0]}), r"values\[0\] = 1.0 has no unit, expected a mass \(kg\)"),
        (axes({"key": "mass", "values": ["1 mm"]}), r"is a length, expected a mass"),
        (axes({"key": "mass", "values": ["0 g"]}), r"0.0 kg is out of bounds, expected more than 0 kg"),
        (axes({"key": "mass", "values": ["1 g", "0.001 kg"]}), r"expected different values"),
        (axes({"key": "mass", "values": ["1 g"], "count": 2}), r"expected no range beside them"),
        (axes({**RANGE, "high": "3 g", "count": 3}), r"the range from 0.003 to 0.003 kg is empty"),
        (axes({**RANGE, "count": 0}), r"axis\[0\].count = 0: expected greater than or equal to 1"),
        (axes({**RANGE, "count": 1}), r"count = 1: expected at least 2 values of a range"),
        (axes({**RANGE, "count": 2, "steps": 1}), r"the key axis\[0\].steps is not known"),
        (
            axes({"key": "state.x", "low": "0 m", "high": "1 m", "count": 2, "spacing": "geometric"}),
            r"a geometric range is expected to lie above 0 m",
        ),
        (axes({**RANGE, "count": 2}, {**RANGE, "count": 3}), r"axis\[1\].key = 'mass': expected another key"),
        (axes({**RANGE, "count": 2}, constants={"mass": "1 g"}), r"'mass' is replaced by an axis"),
        (axes(RANGE, design="latin-hypercube", members=5), r"seed is missing"),
        (axes({**RANGE, "count": 2}, **LATIN), r"expected to have members instead"),
        (axes({"key": "mass", "values": ["1 g"]}, **LATIN), r"expected to have low and high"),
        (
            changed(
                axis=[{"key": "drive.pulses", "low": 2, "high": 9}],
                drive={"train": {"rate": "1 kHz"}},
                **LATIN,
            ),
            r"a count cannot be drawn",
        ),
        (
            changed(axis=[{"key": "drive.pulses", "values": [1.5]}], drive={"train": {"rate": "1 kHz"}}),
            r"expected whole numbers",
        ),
        (
            changed(
                axis=[{"key": "drive.frequency", "values": ["300 Hz"]}], drive={"sine": {"amplitude": "1 N"}}
            ),
            r"duration is missing, and the drive does not end",
        ),
    ],
)
def test_a_fault_is_told_in_one_sentence(spec: dict[str, Any], told: str) -> None:
    with pytest.raises(ph.InputError, match=told) as caught:
        make_plan(read_spec(spec))
    assert str(caught.value).startswith("spec: ")
    assert "\n" not in str(caught.value)


def test_a_fault_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "spec.toml"
    for text, told in (
        ("format = ", "expected TOML"),
        ("format = 1\n", "hammer is missing"),
        (None, "cannot be read"),
    ):
        path.unlink(missing_ok=True)
        if text is not None:
            path.write_text(text, "utf-8")
        with pytest.raises(ph.InputError, match=told) as caught:
            read_spec(path)
        assert str(caught.value).startswith(f"{path}: ")


def test_values_and_ranges_are_in_si() -> None:
    spec = read_spec(
        axes(
            {"key": "pack.front", "values": {"values": [8, 8.5], "unit": "mil"}},
            {"key": "state.v", "low": "-1 in/s", "high": "1 in/s", "count": 3},
            {"key": "waveform.width", "low": "100 us", "high": "400 us", "count": 3, "spacing": "geometric"},
        )
    )
    front, v, width = (axis.values for axis in spec.axes)
    assert front == pytest.approx([203.2e-6, 215.9e-6], rel=1e-15)
    assert v == pytest.approx([-0.0254, 0.0, 0.0254], rel=1e-15)
    assert width == pytest.approx([100e-6, 200e-6, 400e-6], rel=1e-14)
    assert [axis.name for axis in spec.axes] == ["pack_front", "state_v", "waveform_width"]


def test_what_is_computed_makes_the_fingerprint_and_layout_does_not(
    spec_file: Callable[..., Path], tmp_path: Path
) -> None:
    path = spec_file()
    before = read_spec(path).fingerprint
    path.write_text("# A remark.\n" + path.read_text("utf-8").replace('"1.9 kHz"', '"1900 Hz"'), "utf-8")
    assert read_spec(path).fingerprint == before
    text = path.read_text("utf-8")
    for old, new in (
        ("1900", "1901"),
        ("chunk = 4", "chunk = 5"),
        ("pulses = 3", "pulses = 4"),
        ("final", "#"),
    ):
        assert old in text
        path.write_text(text.replace(old, new), "utf-8")
        assert read_spec(path).fingerprint != before


def test_the_schema_knows_the_example_and_refuses_what_the_program_refuses() -> None:
    import tomllib

    validator = jsonschema.Draft202012Validator(schema())
    validator.check_schema(schema())
    root = Path(__file__).parents[2]
    example = (root / "examples" / "sweep.toml").read_text("utf-8")
    assert validator.is_valid(tomllib.loads(example))
    assert validator.is_valid(GOOD)
    for bad in (changed(colour="red"), changed(format=2), changed(chunk=0), changed(axis=[{"low": "1 g"}])):
        assert not validator.is_valid(bad)


def test_the_example_is_the_one_that_the_program_prints() -> None:
    root = Path(__file__).parents[2]
    printed = (root / "src" / "printhammer" / "sweep" / "example.toml").read_bytes()
    assert (root / "examples" / "sweep.toml").read_bytes() == printed


def test_a_plan_of_a_hypercube_lies_in_its_ranges() -> None:
    plan = make_plan(read_spec(axes(RANGE, {"key": "pack.front", "low": "7 mil", "high": "9 mil"}, **LATIN)))
    rows = plan.rows(range(5))
    assert rows.shape == (5, 2)
    strata = np.sort(np.floor((rows[:, 0] - 0.003) / 0.0002).astype(int))
    assert strata.tolist() == [0, 1, 2, 3, 4]
