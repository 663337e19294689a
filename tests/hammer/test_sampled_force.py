"""Sampled forces in hammer files: reading, ranges, saving, fingerprints and errors."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.interpolate import PchipInterpolator
from tests.errors import refused

import printhammer as ph
from printhammer.parts.samples import curve_at, integral_to
from printhammer.parts.spring.forces import MOST_SAMPLES
from printhammer.parts.spring.terms import SampledForce

HEAD = """format = 1
name = "leaf"
mass = { value = 2, unit = "g", status = "assumed", source = "test" }
"""
ENTRY = """
[[force]]
name = "{name}"
law = "sampled"
file = "{file}"
"""
TABLE = "displacement [mm],force [N]\n1,-2\n-1,3\n0,0.5\n"


def leaf(folder: Path, content: str = TABLE, more: str = "") -> ph.Hammer:
    (folder / "leaf.csv").write_text(content, encoding="utf-8")
    (folder / "leaf.toml").write_text(
        HEAD + ENTRY.format(name="leaf", file="leaf.csv") + more, encoding="utf-8"
    )
    return ph.load(folder / "leaf.toml")


def test_samples_are_read_in_any_order(tmp_path: Path) -> None:
    hammer = leaf(tmp_path)
    term = hammer.terms["force.leaf"]
    assert isinstance(term, SampledForce)
    assert term.samples == ((-1e-3, 3.0), (0.0, 0.5), (1e-3, -2.0))
    assert hammer.domain == (-1e-3, 1e-3)
    assert hammer.files == {"force.leaf": "leaf.csv"}
    assert hammer.laws == {"force.leaf": "sampled"}
    assert hammer.rest == pytest.approx(0.2e-3)


def test_the_curve_belongs_to_the_fingerprint_and_its_name_does_not(tmp_path: Path) -> None:
    hammer = leaf(tmp_path)
    (tmp_path / "other.csv").write_text(TABLE, encoding="utf-8")
    assert hammer.replace("force.leaf.file", "other.csv").fingerprint == hammer.fingerprint
    (tmp_path / "other.csv").write_text(TABLE.replace("0.5", "0.6"), encoding="utf-8")
    assert hammer.replace("force.leaf.file", "other.csv").fingerprint != hammer.fingerprint
    straight = hammer.replace("force.leaf.interpolation", "linear")
    assert straight.fingerprint != hammer.fingerprint
    assert straight.replace("force.leaf.interpolation", None).fingerprint == hammer.fingerprint


def test_a_saved_hammer_takes_its_samples_along(tmp_path: Path) -> None:
    hammer = leaf(tmp_path)
    (tmp_path / "there").mkdir()
    hammer.save(tmp_path / "there" / "copy.toml")
    assert ph.load(tmp_path / "there" / "copy.toml") == hammer


def test_two_sampled_forces_hold_where_both_do(tmp_path: Path) -> None:
    (tmp_path / "second.csv").write_text("displacement [mm],force [N]\n-0.5,1\n4,1\n", encoding="utf-8")
    hammer = leaf(tmp_path, more=ENTRY.format(name="second", file="second.csv"))
    assert hammer.domain == (-0.5e-3, 1e-3)
    assert hammer.rest == pytest.approx(0.6e-3)
    assert hammer.spring is not None
    level = hammer.spring.function("spring_level")
    c = hammer.spring.packed(0.0)
    assert [level(c, float(k)) for k in range(3)] == [0.0, math.inf, math.inf]
    force = hammer.spring.function("spring_force")
    assert force(c, 0.25e-3) == pytest.approx(0.5 - 0.625 + 1.0)
    assert math.isnan(force(c, -0.6e-3))
    assert math.isnan(force(c, 1.1e-3))


@pytest.mark.parametrize(
    ("content", "key"),
    [
        ("displacement [mm],force [N]\n1,2\n", "samples"),
        ("displacement [mm],force [N]\n1,2\n1,3\n", "displacement"),
        ("displacement [mm],force [N]\n" + "".join(f"{k},1\n" for k in range(MOST_SAMPLES + 1)), "samples"),
        ("displacement [mm],force [A]\n1,2\n2,3\n", "force [A]"),
        ("displacement,force\n1,2\n2,3\n", "displacement"),
        ("displacement [mm],force [N]\n1,2\n2,x\n", "force"),
    ],
)
def test_bad_tables_are_refused(tmp_path: Path, content: str, key: str) -> None:
    with refused(key) as caught:
        leaf(tmp_path, content)
    assert str(tmp_path / "leaf.csv") in str(caught.value)


def test_other_bad_entries_are_refused(tmp_path: Path) -> None:
    hammer = leaf(tmp_path)
    (tmp_path / "beyond.csv").write_text("displacement [mm],force [N]\n1,1\n4,1\n", encoding="utf-8")
    far = {"law": "rigid", "position": "2 mm", "restitution": 0.5}
    beyond = {"law": "sampled", "file": "beyond.csv"}
    for key, value, wrong in (
        ("force.leaf.interpolation", "spline", "force.leaf.interpolation"),
        ("force.leaf.preload", "1 N", "force.leaf.preload"),
        ("force.leaf.file", None, "force.leaf.file"),
        ("backstop", far, "backstop.position = 2.0 mm"),
        ("force.beyond", beyond, "force.beyond.file"),
    ):
        with refused(wrong):
            hammer.replace(key, value)
    with refused(None, file="missing.csv"):
        hammer.replace("force.leaf.file", "missing.csv")
    fired = hammer.replace("waveform", {"shape": "half-sine", "amplitude": "1 N", "width": "1 ms"})
    with refused("state"):
        ph.simulate(fired, ph.PulseTrain(fired.waveform, period=1e-2, pulses=1), state=(2e-3, 0.0))


@given(
    hnp.arrays(
        float, st.integers(3, 12), elements=st.floats(-5.0, 5.0).filter(lambda y: abs(y) > 1e-6 or y == 0)
    ),
    st.integers(0, 2**32 - 1),
)
def test_the_curve_is_that_of_scipy(values: np.ndarray, seed: int) -> None:
    x = np.cumsum(np.random.default_rng(seed).uniform(0.1, 1.0, values.size))
    c = (*x.tolist(), *values.tolist())
    curve = PchipInterpolator(x, values)
    for place in np.linspace(x[0], x[-1], 37).tolist():
        assert curve_at(c, 0, values.size, False, place) == pytest.approx(float(curve(place)), abs=1e-13)
        area = float(curve.integrate(x[0], place))
        assert integral_to(c, 0, values.size, False, place) == pytest.approx(area, abs=1e-12)
        straight = float(np.interp(place, x, values))
        assert curve_at(c, 0, values.size, True, place) == pytest.approx(straight, abs=1e-13)
