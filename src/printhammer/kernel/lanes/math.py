"""Elementary functions without branches or calls, for loops that the compiler vectorises.

For lanes, the laws of the parts are compiled with this module in place of :mod:`math`, and each function is
inlined. The arguments are reduced as in Cody and Waite, Software Manual for the Elementary Functions
(1980); the polynomials are Taylor and atanh series, long enough for the reduced range. Relative errors:
exp and log 2e-16, pow 2e-16 (1 + |y ln x|); sin and cos: that of rounding the argument. Arguments
outside the domain, for which `math` raises, give NaN or an infinity.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

if TYPE_CHECKING:
    from collections.abc import Callable

    Code = tuple[Any, Callable[..., Any]]

    def bits(value: float) -> int:
        """Reinterpret the 64 bits of a floating-point number as an integer."""
        raise NotImplementedError

    def from_bits(value: int) -> float:
        """Reinterpret the 64 bits of an integer as a floating-point number."""
        raise NotImplementedError


nan = math.nan
inf = math.inf
pi = math.pi

_LOG2_E = 1.4426950408889634
_LN2_HIGH = 6.93147180369123816490e-01
_LN2_LOW = 1.90821492927058770002e-10
# Adding and subtracting 1.5 * 2^52 rounds to the nearest integer.
_ROUND = 6755399441055744.0


def _bits(_context: Any, _value: Any) -> Code:
    def code(_ctx: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), code


def _from_bits(_context: Any, _value: Any) -> Code:
    def code(_ctx: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), code


if not TYPE_CHECKING:
    bits = intrinsic(_bits)
    from_bits = intrinsic(_from_bits)


def sqrt(x: float) -> float:
    """Return the square root of `x`; NaN for negative `x`."""
    return math.sqrt(x)


def isnan(x: float) -> bool:
    """Whether `x` is NaN (not a number)."""
    return x != x  # noqa: PLR0124


def exp(x: float) -> float:
    """Return the exponential of `x`; 0 for `x` below -708, infinity above 709."""
    y = min(max(x, -708.0), 709.0)
    n = (y * _LOG2_E + _ROUND) - _ROUND
    r = (y - n * _LN2_HIGH) - n * _LN2_LOW
    # Taylor series to r^13 for |r| <= ln(2)/2: remainder below 5e-18.
    p = 1.6059043836821613e-10
    p = p * r + 2.08767569878681e-09
    p = p * r + 2.505210838544172e-08
    p = p * r + 2.755731922398589e-07
    p = p * r + 2.7557319223985893e-06
    p = p * r + 2.48015873015873e-05
    p = p * r + 0.0001984126984126984
    p = p * r + 0.001388888888888889
    p = p * r + 0.008333333333333333
    p = p * r + 0.041666666666666664
    p = p * r + 0.16666666666666666
    p = p * r + 0.5
    result = 1.0 + (r + r * r * p)
    scaled = from_bits(bits(result) + (int(n) << 52))
    scaled = 0.0 if x < -708.0 else scaled
    scaled = inf if x > 709.0 else scaled
    return scaled if x == x else x  # noqa: PLR0124


def log(x: float) -> float:
    """Return the natural logarithm of a normal number `x`; NaN below 0, minus infinity at 0."""
    b = bits(x)
    # Choose the exponent such that the mantissa lies between sqrt(1/2) and sqrt(2).
    k = (b - 0x3FE6A09E667F3BCD) >> 52
    m = from_bits(b - (k << 52))
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    # log((1 + s)/(1 - s)) is twice the atanh series, here to s^23 for |s| <= 0.1716.
    p = 0.08695652173913043
    p = p * z + 0.09523809523809523
    p = p * z + 0.10526315789473684
    p = p * z + 0.11764705882352941
    p = p * z + 0.13333333333333333
    p = p * z + 0.15384615384615385
    p = p * z + 0.18181818181818182
    p = p * z + 0.2222222222222222
    p = p * z + 0.2857142857142857
    p = p * z + 0.4
    p = p * z + 0.6666666666666666
    half = 0.5 * f * f
    # log(1 + f) = f - f^2/2 + s (f^2/2 + z p), where the last term is small compared with f.
    tail = s * (half + z * p)
    n = float(k)
    result = n * _LN2_HIGH - ((half - (tail + n * _LN2_LOW)) - f)
    result = -inf if x == 0.0 else result
    return result if x >= 0.0 else nan


def pow(x: float, y: float) -> float:
    """Return `x` to the power `y`, for x >= 0; `x` must be a normal number unless y > 0."""
    result = exp(y * log(x))
    return result if x > 0.0 else (0.0 if (x == 0.0 and y > 0.0) else nan)


def sin(x: float) -> float:
    """Return the sine of `x` [rad], for arguments up to several thousand."""
    n = (x * 0.3183098861837907 + _ROUND) - _ROUND
    r = (x - n * 3.1415926218032837) - n * 3.178650954705639e-08
    z = r * r
    # Taylor series to r^21 for |r| <= pi/2: remainder below 2e-18.
    p = 1.9572941063391263e-20
    p = p * z - 8.22063524662433e-18
    p = p * z + 2.8114572543455206e-15
    p = p * z - 7.647163731819816e-13
    p = p * z + 1.6059043836821613e-10
    p = p * z - 2.505210838544172e-08
    p = p * z + 2.7557319223985893e-06
    p = p * z - 0.0001984126984126984
    p = p * z + 0.008333333333333333
    p = p * z - 0.16666666666666666
    result = r + r * z * p
    return from_bits(bits(result) ^ ((int(n) & 1) << 63))


def cos(x: float) -> float:
    """Return the cosine of `x` [rad], for arguments up to several thousand."""
    return sin(x + 0.5 * pi)
