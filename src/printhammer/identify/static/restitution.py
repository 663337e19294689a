"""The exact restitution of a free Hertz contact with the loss of equation (7), as a law to be fitted.

    z - ln(1 + z) = -(y + ln(1 - y)),      z = (l/k) v_in,  y = (l/k) v_out

Source: divide m v dv = -(k - l v) delta^1.5 dx by (k - l v) and integrate both ways; it holds at any mass and
stiffness.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from printhammer.support.arrays import FloatArray

_SERIES: Final = (1.0, -2 / 3, 4 / 9, -44 / 135, 104 / 405, -40 / 189, 7648 / 42525, -2848 / 18225)
"""y / z in powers of z, from the law by comparing coefficients."""

_SMALL: Final = 0.02
"""Below this the series is exact to rounding, while the logarithms cancel."""


def rebound(z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the restitution of the law and its derivative.

    Parameters
    ----------
    z : array
        (l/k) v_in, more than -1.

    Returns
    -------
    e : array
        Restitution y / z.
    slope : array
        de/dz; from dy/dz = z (1 - y) / ((1 + z) y).
    """
    small = np.abs(z) < _SMALL
    wide = np.where(small, 1.0, z)
    # With y = 1 - exp(-t) the right side is t - (1 - exp(-t)), convex: Newton's steps stay on one side.
    wanted = wide - np.log1p(wide)
    t = np.sign(wide) * np.sqrt(2.0 * wanted) + np.maximum(np.sign(wide), 0.0) * wanted
    for _ in range(50):
        step = (t + np.expm1(-t) - wanted) / -np.expm1(-t)
        t = t - step
        if np.all(np.abs(step) <= 1e-15 * np.abs(t)):
            break
    e = -np.expm1(-t) / wide
    slope = (np.exp(-t) / ((1.0 + wide) * e) - e) / wide
    near = np.where(small, z, 0.0)
    series = np.polynomial.Polynomial(_SERIES)
    return np.where(small, series(near), e), np.where(small, series.deriv()(near), slope)


class RestitutionLaw:
    """Rebound speed against impact speed; p = [l/k].

    Parameters
    ----------
    speed : array, shape (m,)
        Impact speeds, m/s, positive.
    """

    def __init__(self, speed: FloatArray) -> None:
        self.speed = speed

    def value(self, p: FloatArray) -> FloatArray:
        """Return the rebound speeds, m/s."""
        return self.speed * rebound(self._z(p))[0]

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Return the derivatives by l/k."""
        return (self.speed**2 * rebound(self._z(p))[1])[:, None]

    def spread(self, p: FloatArray) -> FloatArray:
        """Return the components of the variance, absolute and in proportion, with the effect of both speeds.

        An error of the impact speed acts through the slope d(v_out)/d(v_in) = e + z de/dz.
        """
        z = self._z(p)
        e, by_z = rebound(z)
        squares = (e + z * by_z) ** 2
        both = self.speed**2 * (e * e + squares)
        return np.column_stack([np.ones_like(z), squares, both])

    def _z(self, p: FloatArray) -> FloatArray:
        # A step of the fit may not leave the values for which the law has a logarithm.
        z: FloatArray = np.maximum(p[0] * self.speed, -0.9)
        return z
