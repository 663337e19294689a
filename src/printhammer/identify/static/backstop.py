"""Fit the backstop: k from the geometry of its bodies, l/k from rebounds; equations (6) and (7).

Radii, Young's moduli and Poisson ratios give k (Hertz). Rebound speeds over impact speeds give l/k by the
exact restitution law, which holds for any mass and stiffness; both together give l.

Data: the columns ``impact speed`` and ``rebound speed``, both positive.

The restitution law of a free Hertz contact with the loss of equation (7):

  z - ln(1 + z) = -(y + ln(1 - y)),      z = (l/k) v_in,  y = (l/k) v_out

Source: divide m v dv = -(k - l v) delta^1.5 dx by (k - l v) and integrate over both directions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.least_squares import Solution
from printhammer.identify.result import Fit, FittedConstant
from printhammer.identify.static.assemble import Data, assemble, check_rows, judge, solved
from printhammer.parts.backstop._hertz import damping_from_restitution, stiffness_from_bodies
from printhammer.support.arrays import FloatArray
from printhammer.support.tables.readings import read_table

_SERIES: Final = (1.0, -2 / 3, 4 / 9, -44 / 135, 104 / 405, -40 / 189, 7648 / 42525, -2848 / 18225)
"""Coefficients of the power series of y / z in z, derived from the restitution law."""

_SMALL: Final = 0.02
"""Largest |z| at which the power series replaces the logarithms, which suffer cancellation; arbitrary."""


def rebound(z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the restitution e and de/dz of a damped Hertz contact at normalised impact speed z > -1.

    e = y / z is the coefficient of restitution; z = (l/k) v_in and y = (l/k) v_out solve
    z - ln(1 + z) = -(y + ln(1 - y)), so that dy/dz = z (1 - y) / ((1 + z) y).
    """
    small = np.abs(z) < _SMALL
    wide = np.where(small, 1.0, z)
    # With y = 1 - exp(-t) the right side is t - (1 - exp(-t)), convex, so Newton's method converges
    # monotonically.
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
    """Rebound speed as a function of impact speed [m/s], both positive, shape (m,); parameters p = [l/k]."""

    def __init__(self, speed: FloatArray) -> None:
        self.speed = speed

    def value(self, p: FloatArray) -> FloatArray:
        """Compute the rebound speeds [m/s] at the measured impact speeds."""
        return self.speed * rebound(self._z(p))[0]

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Compute the derivatives of the rebound speeds with respect to l/k."""
        return (self.speed**2 * rebound(self._z(p))[1])[:, None]

    def variance_columns(self, p: FloatArray) -> FloatArray:
        """Return the variance coefficients: absolute error of each speed, relative error of both speeds.

        An error of the impact speed acts through the slope d(v_out)/d(v_in) = e + z de/dz.
        """
        z = self._z(p)
        e, by_z = rebound(z)
        squares = (e + z * by_z) ** 2
        both = self.speed**2 * (e * e + squares)
        return np.column_stack([np.ones_like(z), squares, both])

    def _z(self, p: FloatArray) -> FloatArray:
        # Keeps an iterate within the domain of the logarithm.
        z: FloatArray = np.maximum(p[0] * self.speed, -0.9)
        return z


RATIO: Final = "backstop.damping / backstop.stiffness"
"""Key of the ratio l/k, in s/m."""

_ROWS: Final = 6  # Smallest number of rebounds for a fit with an error; arbitrary
_SPAN: Final = 1.5
"""Smallest ratio of largest to smallest impact speed at which the law can be tested; arbitrary."""

_AXES: Final = (("impact speed", "m/s"), ("rebound speed", "m/s"))


@dataclass(frozen=True)
class Stiffness:
    """Hertz stiffness k, with its standard error and origin."""

    value: float
    """Stiffness k, N/m^1.5."""
    standard_error: float = 0.0
    """Standard error of k, N/m^1.5; 0 if unknown."""
    how: str = ""
    """Source text of k; empty for a known stiffness, which is not a fit result."""

    @classmethod
    def from_bodies(
        cls,
        radii: Sequence[tuple[float, float]],
        moduli: Sequence[tuple[float, float]],
        ratios: Sequence[tuple[float, float]],
    ) -> Stiffness:
        """Compute the Hertz stiffness of two bodies, with its standard error to first order.

        Parameters
        ----------
        radii : sequence of tuple
            Radius and its standard error, m, of the armature and, unless the backstop is flat, of the
            backstop.
        moduli : sequence of tuple
            Young's moduli of both bodies and their standard errors, Pa.
        ratios : sequence of tuple
            Poisson ratios of both bodies and their standard errors.
        """
        for name, pairs, counts in (
            ("radius", radii, (1, 2)),
            ("Young's modulus", moduli, (2,)),
            ("Poisson ratio", ratios, (2,)),
        ):
            if len(pairs) not in counts:
                wanted = "1 (a flat backstop) or 2" if len(counts) > 1 else "2, of armature and backstop"
                raise InputError(f"{name}: {len(pairs)} values", key=name, expected=wanted)
            for value, _error in pairs:
                inside = -1.0 < value <= 0.5 if name.startswith("Poisson") else value > 0.0
                if not inside:
                    wanted = "more than -1 and at most 0.5" if name.startswith("Poisson") else "more than 0"
                    raise InputError(f"{name}: {value:g}", key=name, value=value, expected=wanted)
        values = np.array([value for pairs in (radii, moduli, ratios) for value, _error in pairs])
        errors = np.array([error for pairs in (radii, moduli, ratios) for _value, error in pairs])

        def stiffness(given: FloatArray) -> float:
            radius2 = float(given[1]) if len(radii) == 2 else None
            e1, e2, nu1, nu2 = (float(part) for part in given[len(radii) :])
            return stiffness_from_bodies(float(given[0]), radius2, (e1, e2), (nu1, nu2))

        squares = 0.0
        for k, error in enumerate(errors):
            step = np.zeros_like(values)
            step[k] = 1e-6 * max(abs(values[k]), 1e-3)
            slope = (stiffness(values + step) - stiffness(values - step)) / (2.0 * step[k])
            squares += (slope * error) ** 2
        return cls(stiffness(values), math.sqrt(squares), "computed from radii, moduli and Poisson ratios")


def fit_backstop(
    path: str | Path | None = None,
    *,
    stiffness: Stiffness | float | None = None,
    robust: bool = True,
    columns: str | None = None,
) -> Fit:
    """Fit the damping ratio l/k to rebounds, and compute stiffness k and damping l of the backstop.

    The table has the columns ``impact speed`` and ``rebound speed``. `stiffness` is computed from the radii
    and moduli of the two bodies in contact (`Stiffness.from_bodies`), or is a known value, N/m^1.5. Without a
    table the result contains only the stiffness, without a stiffness only the ratio l/k. For the other
    options, see `printhammer.identify.fitting.fit`.

    Raises
    ------
    InputError
        Neither a table nor a stiffness is given, the table is invalid or too small, or its rebounds are
        faster than its impacts.
    """
    k = Stiffness(float(stiffness)) if isinstance(stiffness, (int, float)) else stiffness
    if path is None:
        if k is None:
            raise InputError(
                "the backstop: expected a table of rebounds, or the geometry of its bodies", key="backstop"
            )
        return _of_bodies(k)
    table = read_table(path, {"impact speed": "m/s", "rebound speed": "m/s"}, columns=columns)
    speed, back = table.values["impact speed"], table.values["rebound speed"]
    for name, column in table.values.items():
        low = int(np.argmin(column))
        if column[low] <= 0.0:
            raise InputError(
                f"{table.path}: line {table.lines[low]}, column {name!r}: {column[low]:g} m/s",
                file=table.path,
                key=name,
                expected="a positive speed",
            )
    zeros = np.zeros(len(speed), dtype=np.int64)
    data = Data((table.path,), "backstop", speed, back, _AXES, zeros, ("rebounds",), table.lines)
    check_rows(data, _ROWS, "the damping of the backstop and its error")
    if speed.max() < _SPAN * speed.min():
        raise InputError(
            f"{table.path}: impact speeds from {speed.min():.4g} to {speed.max():.4g} m/s",
            file=table.path,
            key="impact speed",
            expected=f"a span of {_SPAN:g} times or more, to test the restitution law",
        )
    middle = float(np.median(back / speed))
    if middle >= 1.0:
        raise InputError(
            f"{table.path}: rebounds are {middle:.3g} times as fast as impacts",
            file=table.path,
            key="rebound speed",
            expected="rebounds slower than impacts",
        )
    law = RestitutionLaw(speed)
    start = np.array([damping_from_restitution(1.0, middle, float(np.median(speed)))])
    solution = solved(data, law, start, robust=robust)
    p_value, why = judge(solution, {"slow": speed, "fast": speed**3}, speed, zeros)
    fit = assemble(
        data,
        law,
        solution,
        [(RATIO, "s/m", False)],
        given={},
        remedies={RATIO: "more rebounds at higher impact speeds"},
        indistinct=[] if k else [f"speeds determine only {RATIO}: the stiffness is missing"],
        rejected=_why(solution, speed, back) if why else "",
        p_value=p_value,
    )
    return fit if k is None else _with_stiffness(fit, k)


def _why(solution: Solution, speed: FloatArray, back: FloatArray) -> str:
    """Describe how the rebound speeds deviate from the restitution law."""
    used = solution.used
    share = (back / speed)[used]
    constant = float(np.median(share))
    law_misses, flat_misses = (
        float(np.median(np.abs(misses))) for misses in ((solution.residuals / speed)[used], share - constant)
    )
    order = np.argsort(speed[used], kind="stable")
    middle = len(order) // 2
    slow, fast = (float(np.median(share[half])) for half in (order[:middle], order[middle:]))
    trend = f"the restitution is {slow:.3g} at the slower impacts and {fast:.3g} at the faster impacts"
    if flat_misses < law_misses:
        return f"{trend}, and a constant restitution of {constant:.3g} describes the rebounds better"
    return f"{trend}, which no value of l/k gives; slow rebounds would have to lose nearly nothing"


def _with_stiffness(fit: Fit, k: Stiffness) -> Fit:
    """Add the stiffness k to a fit, and the damping l computed from k and the fitted ratio l/k."""
    from dataclasses import replace

    ratio = fit[RATIO]
    constant = _constant(k)
    value = ratio.value * k.value
    error = math.hypot(ratio.standard_error * k.value, ratio.value * k.standard_error)
    half = math.hypot(
        0.5 * (ratio.interval[1] - ratio.interval[0]) * k.value,
        ratio.value * 0.5 * (constant.interval[1] - constant.interval[0]),
    )
    whence = f" ({k.how})" if k.how else ""
    how = f"fitted to {' and '.join(fit.source)} with the stiffness {k.value!r} N/m^1.5{whence}"
    damping = FittedConstant(
        "backstop.damping", value, error, (value - half, value + half), "N s/m^2.5", how=how
    )
    # The errors of k and of l/k are independent; l follows from both.
    slopes = {constant.key: (0.0, 1.0), damping.key: (k.value, ratio.value)}
    constants = {RATIO: ratio, constant.key: constant, damping.key: damping}
    given = dict(fit.given)
    if not k.how:
        del slopes[constant.key], constants[constant.key]
        given[constant.key] = f"{k.value!r} N/m^1.5"
    rows = np.array(list(slopes.values())) * (ratio.standard_error, k.standard_error)
    return replace(fit, constants=constants, keys=tuple(slopes), covariance=rows @ rows.T, given=given)


def _constant(k: Stiffness) -> FittedConstant:
    # The errors of the bodies are stated, not estimated from few data, so the distribution is normal.
    return FittedConstant.of("backstop.stiffness", k.value, k.standard_error, math.inf, "N/m^1.5", how=k.how)


def _of_bodies(k: Stiffness) -> Fit:
    """Build a fit result without data, for a stiffness computed from the two bodies alone."""
    none = np.empty(0)
    whole = np.empty(0, dtype=np.int64)
    return Fit(
        kind="backstop",
        source=(),
        constants={"backstop.stiffness": _constant(k)},
        keys=("backstop.stiffness",),
        covariance=np.array([[k.standard_error**2]]),
        abscissa=none,
        data=none,
        fitted=none,
        residuals=none,
        axes=_AXES,
        degrees_of_freedom=math.inf,
        residual_scale=0.0,
        weights=none,
        outliers=np.empty(0, dtype=bool),
        condition_number=1.0,
        series=whole,
        series_names=(),
        lines=whole,
        remarks=("the geometry gives the stiffness alone; the damping needs rebounds",),
    )
