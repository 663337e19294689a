"""Effect of a bifurcation on neighbouring orbits: coefficients of normal forms.

*Period doubling.* Let A, B and C be the first, second and third derivatives of the strobe map over one period
of the orbit, and q and p the eigenvectors with A q = -q, p A = -p and p . q = 1. The coefficient is

    c = p . (C(q, q, q) + 3 B(q, (I - A)^-1 B(q, q))) / 6

(Yu. A. Kuznetsov, *Elements of Applied Bifurcation Theory*, Springer 2004, equation 5.35). If c > 0 the
doubling is supercritical: the orbits of twice the period are stable where the orbit of the single period is
not. B and C are computed as finite differences of A along q; states are in half-widths of the strobe window.

*Grazing of a rigid backstop.* A touch of depth h adds (1 + e) sqrt(2 a h) to the velocity, with the
acceleration a at the touch and the restitution e, so that the strobe map contains a square root (A. B.
Nordmark, J. Sound Vib. 145 (1991) 279). To first order, orbits with the touch exist where the square root of
the depth is positive, and orbits without the touch where they stay off the surface.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from printhammer.chaos.curves.systems import CurvePoint, Plane
from printhammer.chaos.strobe.map import image_of, quiet_section
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray

MOST_PERIODS: Final = 4
"""Largest number of orbit periods per touch for which orbits near a grazing are tested; arbitrary."""

_SPACINGS: Final = (2e-3, 2e-4, 5e-5)
"""Finite-difference steps tried, the largest first, in half-widths; arbitrary."""
_AGREE: Final = 0.05  # Arbitrary
"""Largest accepted relative difference between the coefficients for a step and for half the step."""
_DOUBLES: Final = 1e-4
"""Largest distance of a multiplier from -1 at which a normal-form coefficient is computed; arbitrary."""
_FEW: Final = 1e-9  # Relative magnitude below which a denominator is singular; arbitrary


def doubling_coefficient(plane: Plane, place: CurvePoint) -> float:
    """Compute the coefficient c of a period doubling; NaN if the finite differences are inconclusive."""
    regime = replace(plane.at(place.first, place.second), phase=place.phase)
    quiet = quiet_section(regime, place.state, plane.firings, plane.tolerance)
    if quiet is None:
        return math.nan
    regime, state = quiet
    scales = plane.scales[:2]

    def slope(away: FloatArray) -> tuple[FloatArray, tuple[str, ...]] | None:
        image = image_of(regime, state + away * scales, plane.firings, plane.tolerance)
        if not image.ok:
            return None
        return image.jacobian * scales / scales[:, np.newaxis], tuple(name for name, _ in image.contacts)

    here = slope(np.zeros(2))
    if here is None or not np.isfinite(here[0]).all():
        return math.nan
    matrix, contacts = here
    values, right = np.linalg.eig(matrix)
    if float(np.abs(values + 1.0).min()) > _DOUBLES:
        return math.nan
    q = right[:, int(np.argmin(np.abs(values + 1.0)))].real
    values, left = np.linalg.eig(matrix.T)
    p = left[:, int(np.argmin(np.abs(values + 1.0)))].real
    if abs(float(p @ q)) < _FEW:
        return math.nan
    p = p / float(p @ q)

    def coefficient(spacing: float) -> float:
        ahead, behind = slope(spacing * q), slope(-spacing * q)
        if ahead is None or behind is None or ahead[1] != contacts or behind[1] != contacts:
            return math.nan
        second = (ahead[0] - behind[0]) / (2.0 * spacing)
        third = (ahead[0] - 2.0 * matrix + behind[0]) / spacing**2
        turned = np.linalg.solve(np.eye(2) - matrix, second @ q)
        return float(p @ (third @ q + 3.0 * second @ turned)) / 6.0

    for spacing in _SPACINGS:
        whole, half = coefficient(spacing), coefficient(0.5 * spacing)
        if abs(half - whole) <= _AGREE * abs(half):
            # The error is proportional to the square of the spacing.
            return (4.0 * half - whole) / 3.0
    return math.nan


def root_coefficient(plane: Plane, place: CurvePoint) -> float:
    """Compute the grazing coefficient (1 + e) sqrt(2 a), m^(1/2)/s; e: restitution, a: acceleration."""
    try:
        restitution = plane.at(place.first, place.second).value("backstop.restitution")
    except InputError:
        return math.nan
    return (1.0 + restitution) * math.sqrt(2.0 * place.acceleration) if place.acceleration > 0.0 else math.nan


def grazing_sides(plane: Plane, place: CurvePoint) -> tuple[int, ...]:
    """Determine on which sides of a grazing, in the first parameter, orbits with and without the touch exist.

    Returns
    -------
    tuple of int
        Five sides, in this order: the side on which the orbit without the touch exists, and the sides on
        which orbits with one touch in 1, 2, 3 and 4 periods exist. A side is 1 for larger values of the
        parameter, -1 for smaller values, and 0 for neither.
    """
    matrix, root = place.jacobian, root_coefficient(plane, place)
    if place.slope is None or not math.isfinite(root):
        return (0,) * (MOST_PERIODS + 1)
    free = float(np.linalg.solve(np.eye(2) - matrix, place.slope)[0])
    kick = np.array([0.0, root])
    passages = range(1, MOST_PERIODS + 1)
    return int(np.sign(free)), *(_touching_side(matrix, place.slope, kick, n) for n in passages)


def _touching_side(matrix: FloatArray, slope: FloatArray, kick: FloatArray, periods: int) -> int:
    """Determine the side on which an orbit with one touch in `periods` periods exists: 1, -1 or 0.

    The derivative of the strobe map in the state is A (`matrix`), in the parameter s (`slope`). In units of
    the square root of the depth, a touch adds the kick k to the state. The state before the kick, u_0 =
    (0, v), and the shift m of the parameter solve A^n (u_0 + k) + (I + A + ... + A^(n-1)) s m = u_0, where n
    is `periods`. Between touches the orbit has to stay off the surface.
    """
    power = np.linalg.matrix_power(matrix, periods)
    summed = sum((np.linalg.matrix_power(matrix, k) for k in range(periods)), np.zeros((2, 2))) @ slope
    system = np.column_stack([power[:, 1] - np.array([0.0, 1.0]), summed])
    if abs(float(np.linalg.det(system))) < _FEW * float(np.abs(system).max()) ** 2:
        return 0
    v, move = np.linalg.solve(system, -power @ kick)
    u = np.array([0.0, v]) + kick
    for _ in range(periods - 1):
        u = matrix @ u + slope * move
        if u[0] <= 0.0:
            return 0
    return int(np.sign(move))
