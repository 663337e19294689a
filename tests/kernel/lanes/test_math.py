"""The functions for lanes against mpmath, compiled in loops as the kernel compiles them."""

import functools
import math
from collections.abc import Callable
from typing import Any

import mpmath
import numba
import numpy as np
import numpy.typing as npt
import pytest

from printhammer.kernel.compile.compiling import inlined
from printhammer.kernel.compile.templates import compile_module
from printhammer.kernel.lanes import math as lane_math

ULP = 2.0**-53
"""Relative rounding of one operation."""

Array = npt.NDArray[np.float64]


@functools.cache
def loop(name: str) -> Any:
    """Compile a function of `lane_math` in a loop over arrays, with the settings of the kernel."""
    function = getattr(compile_module(lane_math, inlined), name)
    if name == "pow":

        def apply(x: Any, y: Any, out: Any) -> None:
            for i in range(x.size):
                out[i] = function(x[i], y[i])
    else:

        def apply(x: Any, out: Any) -> None:  # type: ignore[misc]
            for i in range(x.size):
                out[i] = function(x[i])

    return numba.njit(error_model="numpy", fastmath={"contract"})(apply)


def values(name: str, *arguments: npt.ArrayLike) -> Array:
    arrays = [np.array(a, dtype=np.float64) for a in np.broadcast_arrays(*arguments)]
    out = np.empty_like(arrays[0])
    loop(name)(*arrays, out)
    return out


def exact(function: Callable[..., Any], *arguments: Array) -> list[Any]:
    with mpmath.workprec(160):
        return [function(*(mpmath.mpf(float(a)) for a in row)) for row in zip(*arguments, strict=True)]


def errors(found: Array, truth: list[Any], *, relative: bool) -> Array:
    with mpmath.workprec(160):
        apart = [mpmath.mpf(float(f)) - t for f, t in zip(found, truth, strict=True)]
        if relative:
            apart = [a / t for a, t in zip(apart, truth, strict=True)]
        return np.array([abs(float(a)) for a in apart])


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng([38, seed])


def near_one(count: int, seed: int) -> Array:
    draw = rng(seed)
    return 1.0 + draw.choice([-1.0, 1.0], count) * 10.0 ** draw.uniform(-15.5, -0.5, count)


@pytest.mark.parametrize("span", [(-708.0, 709.0), (-1.0, 1.0), (-1e-8, 1e-8), (-60.0, 0.0)])
def test_exp(span: tuple[float, float]) -> None:
    x = np.append(rng(0).uniform(*span, 1001), span)
    assert errors(values("exp", x), exact(mpmath.exp, x), relative=True).max() < 4.0 * ULP


def test_log() -> None:
    x = np.concatenate([10.0 ** rng(1).uniform(-307.0, 308.0, 1001), near_one(700, 2), [math.sqrt(0.5), 2.0]])
    assert errors(values("log", x), exact(mpmath.log, x), relative=True).max() < 4.0 * ULP
    assert values("log", [1.0])[0] == 0.0


@pytest.mark.parametrize("y", [0.5, 1.5, 2.7, 3.7, 11.0, -8.3, -1.0])
def test_pow(y: float) -> None:
    """The error of the power is that of exp and log, plus the rounding of y log(x)."""
    x = np.concatenate([10.0 ** rng(3).uniform(-12.0, 2.0, 1001), near_one(400, 4)])
    truth = exact(lambda base: mpmath.power(base, mpmath.mpf(y)), x)
    allowed = 3.0 * ULP * (1.0 + np.abs(y * np.log(x)))
    assert (errors(values("pow", x, y), truth, relative=True) < allowed).all()


@pytest.mark.parametrize("reach", [2.0, 50.0, 5000.0])
def test_sin(reach: float) -> None:
    x = rng(5).uniform(-reach, reach, 1001)
    assert errors(values("sin", x), exact(mpmath.sin, x), relative=False).max() < 4.0 * ULP


def test_sin_near_its_zeros() -> None:
    n = rng(6).integers(-1500, 1500, 1000)
    x = math.pi * n[n != 0]
    # What is left there is the rounding of n pi, and of that a ten-thousandth at most is lost.
    assert errors(values("sin", x), exact(mpmath.sin, x), relative=True).max() < 1e-4


@pytest.mark.parametrize("reach", [2.0, 50.0, 5000.0])
def test_cos(reach: float) -> None:
    """An argument shifted by a quarter turn is rounded; the slope of the sine transfers this error."""
    x = rng(7).uniform(-reach, reach, 1001)
    allowed = 4.0 * ULP + ULP * np.abs(x + 0.5 * math.pi) + 0.5 * np.spacing(0.5 * math.pi)
    assert (errors(values("cos", x), exact(mpmath.cos, x), relative=False) < allowed).all()


def test_sqrt_is_rounded_correctly() -> None:
    x = np.append(10.0 ** rng(8).uniform(-307.0, 308.0, 1001), [0.0, 5e-324, math.inf])
    np.testing.assert_array_equal(values("sqrt", x), np.sqrt(x))


@pytest.mark.parametrize(
    ("name", "arguments", "result"),
    [
        ("exp", (0.0,), 1.0),
        ("exp", (5e-324,), 1.0),
        ("exp", (-708.5,), 0.0),
        ("exp", (-math.inf,), 0.0),
        ("exp", (709.5,), math.inf),
        ("exp", (math.inf,), math.inf),
        ("exp", (math.nan,), math.nan),
        ("log", (0.0,), -math.inf),
        ("log", (-0.0,), -math.inf),
        ("log", (-1.0,), math.nan),
        ("log", (-math.inf,), math.nan),
        ("log", (math.nan,), math.nan),
        ("pow", (0.0, 2.7), 0.0),
        ("pow", (-0.0, 2.7), 0.0),
        ("pow", (0.0, -8.3), math.nan),
        ("pow", (0.0, 0.0), math.nan),
        ("pow", (-1e-9, 2.7), math.nan),
        ("pow", (-1.0, 2.0), math.nan),
        ("pow", (1.0, 0.0), 1.0),
        ("pow", (math.nan, 2.7), math.nan),
        ("pow", (2.0, math.nan), math.nan),
        ("pow", (math.inf, 2.7), math.inf),
        ("pow", (2.0, 1100.0), math.inf),
        ("pow", (2.0, -1100.0), 0.0),
        ("sin", (0.0,), 0.0),
        ("sin", (math.nan,), math.nan),
        ("cos", (math.nan,), math.nan),
        ("sqrt", (-1.0,), math.nan),
        ("sqrt", (math.nan,), math.nan),
    ],
)
def test_special_values(name: str, arguments: tuple[float, ...], result: float) -> None:
    # Alone, in the vector part of the loop, and in what is left over after it.
    for count in (1, 16, 37):
        found = values(name, *(np.full(count, a) for a in arguments))
        np.testing.assert_array_equal(found, np.full(count, result))


def test_isnan() -> None:
    np.testing.assert_array_equal(values("isnan", [0.0, math.nan, math.inf, -1.0]), [0.0, 1.0, 0.0, 0.0])


@pytest.mark.parametrize("name", ["exp", "log", "sin", "cos"])
def test_a_value_does_not_depend_on_its_neighbours(name: str) -> None:
    """Bit-identical alone, in vectors, among NaN and infinities, and in the remainder of a loop."""
    x = rng(9).uniform(0.01, 700.0, 64)
    together = values(name, x)
    alone = np.array([values(name, [number])[0] for number in x])
    np.testing.assert_array_equal(together, alone)
    odd = np.insert(x, np.arange(64), np.tile([math.nan, math.inf, -1.0, 0.0], 16))
    np.testing.assert_array_equal(values(name, odd)[1::2], together)
