"""Hertz backstop constants from measurable quantities: two bodies, and the restitution at one speed."""

from __future__ import annotations

import math


def stiffness_from_bodies(
    radius1: float,
    radius2: float | None,
    youngs_moduli: tuple[float, float],
    poisson_ratios: tuple[float, float],
) -> float:
    """Return the stiffness k [N/m^1.5] of a Hertz contact of two spheres, or of a sphere on a flat.

    Equation: k = (4/3) E* sqrt(R), 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2, 1/R = 1/R1 + 1/R2; K. L. Johnson,
    Contact Mechanics (1985), section 4.2. Radii are in m, Young's moduli in Pa; `radius2` is None for a flat.
    """
    flat = math.nan if radius2 is None else radius2
    return hertz_stiffness(radius1, flat, *youngs_moduli, *poisson_ratios)


def hertz_stiffness(
    radius1: float, radius2: float, modulus1: float, modulus2: float, ratio1: float, ratio2: float
) -> float:
    """Return the Hertz stiffness [N/m^1.5] of two bodies from radii, Young's moduli and Poisson ratios.

    Radii are in m, moduli in Pa; `radius2` is NaN if the second body is flat.
    """
    compliance = (1.0 - ratio1 * ratio1) / modulus1 + (1.0 - ratio2 * ratio2) / modulus2
    curvature = 1.0 / radius1 + (0.0 if math.isnan(radius2) else 1.0 / radius2)
    return 4.0 / (3.0 * compliance * math.sqrt(curvature))


def damping_from_restitution(k: float, restitution: float, speed: float) -> float:
    """Return the damping l [N s/m^2.5] of equation (7), for the restitution coefficient of a free rebound.

    With z = (l/k) v_in and y = (l/k) v_out a free contact obeys z - ln(1 + z) = -(y + ln(1 - y)), at any mass
    and stiffness: divide m v dv = -(k - l v) delta^1.5 d(x) by (k - l v), and integrate the compression and
    the rebound. With y = e z, bisection solves the equation for z; both sides are divided by z^2, which
    removes the cancellation at small z. The Hertz stiffness `k` is in N/m^1.5, `restitution` is
    e = v_out / v_in in (0, 1], and `speed` is v_in, positive, m/s.
    """
    e = restitution
    if e == 1.0:
        return 0.0
    low, high = 0.0, 1.0 / e
    while True:
        z = 0.5 * (low + high)
        if not low < z < high:
            return k * z / speed
        if e * z >= 1.0 or _defect(z) < e * e * _defect(-e * z):
            high = z
        else:
            low = z


def _defect(u: float) -> float:
    """Return (u - ln(1 + u)) / u^2 without cancellation, for u > -1."""
    if abs(u) > 0.3:
        return (u - math.log1p(u)) / (u * u)
    total, term, n = 0.0, 1.0, 2
    while abs(term) > 1e-18:
        total += term / n
        term *= -u
        n += 1
    return total
