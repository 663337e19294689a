"""Planar maps with two parameters that replace the strobe map. Helpers only.

The maps are textbook maps whose bifurcations are known in closed form. The force amplitude of a
regime, minus `SHIFT`, is the first parameter and the preload of its spring the second, so that the
program follows the curves as for a hammer, but without a run.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

import printhammer as ph
from printhammer.chaos.curves.starts import Start
from printhammer.chaos.curves.systems import Plane
from printhammer.chaos.strobe.map import Image
from printhammer.run.regime import Regime

Array = npt.NDArray[np.float64]

NAMES = ("drive.amplitude", "spring.preload")
SHIFT = 20.0
"""Force amplitude that stands for 0, so that the first parameter may have either sign."""
UNITS = np.array([2.0, 5.0])
"""Displacement and velocity that stand for 1."""


class Map(NamedTuple):
    """A planar map: image and derivative as functions of state and parameters."""

    image: Callable[[Array, float, float], Any]
    derivative: Callable[[Array, float, float], Any]


HENON = Map(
    lambda u, a, b: [1.0 - a * u[0] ** 2 + u[1], b * u[0]],
    lambda u, a, b: [[-2.0 * a * u[0], 1.0], [b, 0.0]],
)
"""(x, y) -> (1 - a x^2 + y, b x); determinant -b."""

CUBIC = Map(
    lambda u, p, r: [u[0] + p + r * u[0] - u[0] ** 3, 0.5 * u[1]],
    lambda u, p, r: [[1.0 + r - 3.0 * u[0] ** 2, 0.0], [0.0, 0.5]],
)
"""(x, y) -> (x + p + r x - x^3, y / 2): folds at p = +-2 (r / 3)^(3/2), which meet in a cusp at 0."""

FLIP = Map(
    lambda u, p, r: [-(1.0 + p) * u[0] + r * u[0] ** 2 - u[0] ** 3, 0.5 * u[1] + u[0] ** 2],
    lambda u, p, r: [[-(1.0 + p) + 2.0 * r * u[0] - 3.0 * u[0] ** 2, 0.0], [2.0 * u[0], 0.5]],
)
"""(x, y) -> (-(1 + p) x + r x^2 - x^3, y / 2 + x^2): doubling at p = 0, with the coefficient r^2 - 1."""

DELAYED = Map(
    lambda u, r, s: [r * u[0] * (1.0 - u[1]) - s * (u[0] - u[1]), u[0]],
    lambda u, r, s: [[r * (1.0 - u[1]) - s, -r * u[0] + s], [1.0, 0.0]],
)
"""The delayed logistic map with feedback of the difference: at x = y = 1 - 1 / r the trace of its derivative
is 1 - s and the determinant r - 1 - s, so that a Neimark-Sacker bifurcation lies at r = 2 + s."""

BOGDANOV = Map(
    lambda u, p, r: [u[1], p + r * u[1] - u[0] + u[0] * u[1]],
    lambda u, p, r: [[0.0, 1.0], [u[1] - 1.0, r + u[0]]],
)
"""(x, y) -> (y, p + r y - x + x y): at p = x = y = 0 the determinant is 1 and the trace r."""

BOTH = Map(
    lambda u, p, r: [-(1.0 + p) * u[0] - u[0] ** 3, u[1] + r - u[1] ** 2],
    lambda u, p, r: [[-(1.0 + p) - 3.0 * u[0] ** 2, 0.0], [0.0, 1.0 - 2.0 * u[1]]],
)
"""Doubling at p = 0 and fold at r = 0, side by side; the doubling turns at the fold."""


def seen_through(known: Map, matrix: npt.ArrayLike, axes: npt.ArrayLike) -> Map:
    """Return a map after changes of the coordinates of state and parameters."""
    turn, mixed = np.asarray(matrix, np.float64), np.asarray(axes, np.float64)
    back = np.linalg.inv(turn)
    return Map(
        lambda u, p, r: turn @ np.array(known.image(back @ u, *(mixed @ [p, r]).tolist())),
        lambda u, p, r: turn @ np.array(known.derivative(back @ u, *(mixed @ [p, r]).tolist())) @ back,
    )


def regime() -> Regime:
    """An oscillator whose force amplitude and preload represent two parameters, both 0."""
    hammer = ph.Hammer.build(1.0, spring={"law": "preload", "preload": 0.0, "stiffness": 1.0})
    return Regime.of(hammer, drive=ph.SineForce(SHIFT, 1.0))


def plane(p: tuple[float, float], r: tuple[float, float], firings: int = 1) -> Plane:
    """Bounds of the plane of both parameters."""
    return Plane(regime(), NAMES, ((p[0] + SHIFT, p[1] + SHIFT), r), firings, 1e-11)


def start(kind: str, u: npt.ArrayLike, p: float, over: Plane) -> Start:
    """A bifurcation at a state and a value of the first parameter."""
    state = UNITS * np.asarray(u, np.float64)
    return Start(kind, over.regime, NAMES[0], over.bounds[0], over.firings, over.tolerance, state, p + SHIFT)


def image_by(known: Map) -> Callable[..., Image]:
    """Return a replacement for `printhammer.chaos.strobe.map.image_of`."""

    def image_of(
        at: Regime, state: Array, firings: int, _tolerance: float, *, contacts: bool = True
    ) -> Image:
        p, r = at.value(NAMES[0]) - SHIFT, at.value(NAMES[1])
        u, matrix = np.asarray(state, np.float64) / UNITS, np.eye(2)
        for _ in range(firings):
            matrix = np.array(known.derivative(u, p, r)) @ matrix
            u = np.array(known.image(u, p, r))
        del contacts
        return Image(UNITS * u, matrix * UNITS[:, np.newaxis] / UNITS, "ok", True, (), np.nan)

    return image_of


@contextmanager
def standing_in(known: Map) -> Iterator[None]:
    """Replace the strobe map of every regime by a map, without contacts or surfaces."""
    curves = "printhammer.chaos.curves"
    with pytest.MonkeyPatch.context() as patch:
        for module in ("systems", "normal_forms"):
            patch.setattr(f"{curves}.{module}.image_of", image_by(known))
        for module in ("tracing", "normal_forms"):
            patch.setattr(f"{curves}.{module}.quiet_section", lambda at, state, *_: (at, state))
        patch.setattr(f"{curves}.tracing.near_touches", lambda *_: [])
        yield
