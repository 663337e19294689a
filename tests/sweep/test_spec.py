"""Specs: parsing, and error messages that name key, value and expectation."""

from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from tests.errors import refused

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
    ("spec", "key"),
    [
        (changed(format=2), "format"),
        (changed(hammer=None), "hammer"),
        (changed(hammer="no-such.toml"), None),
        (changed(colour="red"), "colour"),
        (changed(tolerance=2.0), "tolerance"),
        (changed(duration="3"), "duration"),
        (changed(duration=0.003), "duration"),
        (changed(duration="-3 ms"), "duration"),
        (changed(chunk=0), "chunk"),
        (changed(members=3), "members"),
        (changed(axis=[]), "axis"),
        (changed(outputs={}), "outputs"),
        (changed(outputs={"dots": ["stuck"]}), "outputs.dots"),
        (changed(outputs={"dots": ["struck", "struck"]}), "outputs.dots"),
        (changed(outputs={"final": 1}), "outputs.final"),
        (changed(outputs={"speed": True}), "outputs.speed"),
        (
            changed(outputs={"displacement": {"end": "1 ms", "count": 1}}),
            "outputs.displacement",
        ),
        (changed(drive={}), "drive"),
        (changed(drive={"burst": {}}), "burst.pulses"),
        (changed(drive={"train": {"pulses": 2, "rat": 1}}), "train.rat"),
        (
            changed(drive={"train": {"pulses": 2, "rate": "1 kHz"}}),
            "drive.train.rate",
        ),
        (changed(drive="none.toml"), "drive"),
        (changed(constants={"pack.stifness": "1 N"}), "constants"),
        (axes({"key": "pack.stifness", "values": ["1 N"]}), "axis[0].key"),
        (axes({"key": "drive.rat", "values": ["1 Hz"]}), "axis[0].key"),
        (axes({"key": "drive.at.1", "values": ["1 ms"]}), "drive.at.1"),
        (
            changed(drive=SEQUENCE, axis=[{"key": "waveform.width", "values": ["1 ms"]}]),
            "waveform.width",
        ),
        (
            changed(drive=SEQUENCE, axis=[{"key": "waveforms.b.width", "values": ["1 ms"]}]),
            "axis[0].key",
        ),
        (
            changed(drive=SEQUENCE, axis=[{"key": "waveforms.a.amplitude", "values": ["1 N"]}]),
            "axis[0] (waveforms.a.amplitude).values[0]",
        ),
        (axes({"key": "mass"}), "axis[0] (mass).low"),
        (axes({"key": "mass", "values": []}), "axis[0] (mass).values"),
        (axes({"key": "mass", "values": [1.0]}), "axis[0] (mass).values[0]"),
        (axes({"key": "mass", "values": ["1 mm"]}), "axis[0] (mass).values[0]"),
        (axes({"key": "mass", "values": ["0 g"]}), "axis[0] (mass)"),
        (axes({"key": "mass", "values": ["1 g", "0.001 kg"]}), "axis[0] (mass).values"),
        (axes({"key": "mass", "values": ["1 g"], "count": 2}), "axis[0] (mass)"),
        (axes({**RANGE, "high": "3 g", "count": 3}), "axis[0] (mass)"),
        (axes({**RANGE, "count": 0}), "axis[0].count"),
        (axes({**RANGE, "count": 1}), "axis[0] (mass).count"),
        (axes({**RANGE, "count": 2, "steps": 1}), "axis[0].steps"),
        (
            axes({"key": "state.x", "low": "0 m", "high": "1 m", "count": 2, "spacing": "geometric"}),
            "axis[0] (state.x)",
        ),
        (axes({**RANGE, "count": 2}, {**RANGE, "count": 3}), "axis[1].key"),
        (axes({**RANGE, "count": 2}, constants={"mass": "1 g"}), "constants"),
        (axes(RANGE, design="latin-hypercube", members=5), "seed"),
        (axes({**RANGE, "count": 2}, **LATIN), "axis[0] (mass).count"),
        (axes({"key": "mass", "values": ["1 g"]}, **LATIN), "axis[0] (mass)"),
        (
            changed(
                axis=[{"key": "drive.pulses", "low": 2, "high": 9}],
                drive={"train": {"rate": "1 kHz"}},
                **LATIN,
            ),
            "axis[0] (drive.pulses)",
        ),
        (
            changed(axis=[{"key": "drive.pulses", "values": [1.5]}], drive={"train": {"rate": "1 kHz"}}),
            "axis[0] (drive.pulses)",
        ),
        (
            changed(
                axis=[{"key": "drive.frequency", "values": ["300 Hz"]}], drive={"sine": {"amplitude": "1 N"}}
            ),
            "duration",
        ),
    ],
)
def test_a_fault_is_told_in_one_sentence(spec: dict[str, Any], key: str | None) -> None:
    with refused(key) as caught:
        make_plan(read_spec(spec))
    assert str(caught.value).startswith("spec: ")
    assert "\n" not in str(caught.value)


def test_a_fault_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "spec.toml"
    for text, key in (
        ("format = ", None),
        ("format = 1\n", "hammer"),
        (None, None),
    ):
        path.unlink(missing_ok=True)
        if text is not None:
            path.write_text(text, "utf-8")
        with refused(key) as caught:
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
