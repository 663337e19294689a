"""Tests of the search space: conversion of variables to constants and back, and the two scales."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from studies.reconstruction.family.choice import scaled
from studies.reconstruction.search.space import (
    BEYOND,
    CURRENT,
    PRINT_FORCE,
    VARIABLES,
    constants_at,
    geometry,
    hammer_of,
    point_of,
    printing_stiffness,
    template,
    values_at,
    values_of,
)
from studies.reconstruction.tests.samples import constants_in, values_in
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.claims.judging import claims
from printhammer.hammer.equilibrium import rest_state
from printhammer.hammer.static_force import StaticForce

POINTS = st.lists(st.floats(0.0, 1.0), min_size=len(VARIABLES), max_size=len(VARIABLES)).map(np.array)
MASSES = st.floats(1e-5, 1e-2)


@given(POINTS)
def test_points_and_values_are_the_same(point: np.ndarray) -> None:
    values = values_at(point)
    assert list(values) == [variable.name for variable in VARIABLES]
    for variable in VARIABLES:
        assert variable.low * (1.0 - 1e-12) <= values[variable.name] <= variable.high * (1.0 + 1e-12)
    np.testing.assert_allclose(point_of(values), point, rtol=0.0, atol=1e-12)


def test_shares_of_a_range_are_even_over_it_or_over_its_logarithm() -> None:
    for variable in VARIABLES:
        middle = float(variable.value(np.asarray(0.5)))
        mean = math.sqrt(variable.low * variable.high) if variable.logarithmic else None
        wanted = 0.5 * (variable.low + variable.high) if mean is None else mean
        assert middle == pytest.approx(wanted, rel=1e-12)
        assert variable.meaning


@given(POINTS, MASSES)
def test_values_to_constants_and_back(point: np.ndarray, mass: float) -> None:
    values = values_at(point)
    assert values_of(constants_at(values, mass, 200.0)) == pytest.approx(values, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("shape", ["trapezoid", "half-sine"])
@given(point=POINTS.map(lambda point: np.clip(point, 0.02, 0.98)), mass=MASSES)
def test_other_waveforms_to_constants_and_back(point: np.ndarray, mass: float, shape: Any) -> None:
    values = values_at(point)
    constants = constants_at(values, mass, 200.0, shape)
    # Only the width counts for a half sine.
    free = {"rise", "decay"} if shape == "half-sine" else set()
    again = values_of(constants)
    for name in set(values) - free:
        assert again[name] == pytest.approx(values[name], rel=1e-9, abs=1e-12)
    waveform = hammer_of(constants).waveform
    assert waveform is not None
    assert waveform.shape == shape
    largest = CURRENT if values["release"] * BEYOND * 2.0 < CURRENT else values["release"] * BEYOND * 2.0
    assert waveform.peak == pytest.approx(largest, rel=1e-9)


@given(POINTS, MASSES, st.floats(0.01, 100.0), st.floats(0.1, 10.0))
def test_neither_scale_is_a_variable(point: np.ndarray, mass: float, force: float, current: float) -> None:
    constants = constants_at(values_at(point), mass, 200.0)
    units = {key: constant.si_unit for key, constant in template().constants.items()}
    other = scaled(constants, units, force, current)
    assert other["mass"] == pytest.approx(force * mass)
    assert values_of(other) == pytest.approx(values_of(constants), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("hammer", ["hendriks-1983", CRUDE])
def test_the_shipped_hammer_is_in_the_space(hammer: str | Path) -> None:
    point = point_of(values_in(hammer))
    assert ((point >= 0.0) & (point <= 1.0)).all()
    constants = constants_in(hammer)
    back = constants_at(values_in(hammer), constants["mass"], constants["pack.stiffness"])
    # The current of the hammer may differ from that of the search.
    ratio = constants["waveform.amplitude"] / back["waveform.amplitude"]
    back["waveform.amplitude"] *= ratio
    back["magnet.Bm"] /= ratio
    # Constants are written with six digits.
    assert back == pytest.approx(constants, rel=1e-5)


def test_the_geometry_is_that_of_the_paper() -> None:
    inch = 0.0254
    place = geometry()
    assert place["b"] == pytest.approx(0.002 * inch)
    assert place["xp"] == pytest.approx(0.008 * inch)
    assert place["platen"] == pytest.approx(0.015 * inch)
    assert place["d"] == pytest.approx(0.007 * inch)
    # 0.0112 in, to the printed digits.
    assert place["top"] == pytest.approx(0.0112 * inch, abs=0.00005 * inch)


def test_the_stiffness_gives_five_pounds_at_the_printed_stroke() -> None:
    # Equation (5) with the numbers of the paper in pounds and inches, independent of the package's units.
    indentation = (geometry()["top"] / 0.0254 - 0.008) / (0.015 - 0.008)
    pounds = printing_stiffness() / (0.45359237 * 9.80665) * math.exp(2.7 * math.log(indentation))
    assert pounds == pytest.approx(5.0, rel=1e-12)
    hammer = hammer_of({"pack.stiffness": printing_stiffness()})
    assert abs(StaticForce(hammer).pack(geometry()["top"])) == pytest.approx(PRINT_FORCE, rel=1e-12)


@settings(max_examples=25)
@given(POINTS, MASSES)
def test_the_variables_are_what_they_say(point: np.ndarray, mass: float) -> None:
    values = values_at(point)
    # A hammer file requires a force F0.
    assume(values["bias"] > 0.0)
    hammer = hammer_of(constants_at(values, mass, 200.0))
    force, b = StaticForce(hammer), geometry()["b"]
    magnet, spring = force.magnet(b), force.spring(b)
    assert -magnet / mass == pytest.approx(values["pull"], rel=1e-9)
    assert -(magnet + spring) == pytest.approx(values["margin"] * -magnet, rel=1e-9)
    # Equation (4): the spring is slack at As.
    assert force.spring(values["reach"] + b) == pytest.approx(0.0, abs=1e-9 * spring)


def test_a_hammer_of_the_space_rests_as_deep_as_its_depth() -> None:
    hammer = hammer_of(constants_in(CRUDE))
    depth = geometry()["b"] - rest_state(hammer)
    # The magnet pulls a little more inside the backstop, equation (3), and the spring pushes more.
    assert depth == pytest.approx(values_in(CRUDE)["depth"], rel=0.1)


def test_what_is_set_is_reconstructed_and_what_the_paper_prints_is_stated() -> None:
    hammer = hammer_of(constants_in(CRUDE))
    found = {key: constant.status for key, constant in hammer.constants.items()}
    assert all(found[key] == "reconstructed" for key in constants_in(CRUDE))
    for key in ("platen", "pack.front", "backstop.position"):
        assert found[key] == "stated"
    assert claims()["geometry"].kind == "stated"
    assert isinstance(hammer, ph.Hammer)
