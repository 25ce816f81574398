"""Elementary functions of which a loop over cells is computed in whole vectors: no calls, no branches.

Those of the C library are called for one number at a time, and everything else in the loop with them.
"""

from __future__ import annotations

import math

import numpy as np

from solver.compiled import kernel

# The upper half of the bits of x is nearly its logarithm: for ``x^(-1/3)`` it is this number less a third.
_ROOT = np.uint64(1430194684)
_THIRD, _HALF = np.uint64(0x55555556), np.uint64(32)
# log2(e), and ln 2 in two parts of which multiples of the first are exact
_LOG2_E, _LN2_HIGH, _LN2_LOW = 1.4426950408889634, 6.93147180369123816490e-01, 1.90821492927058770002e-10
_BIAS, _MANTISSA = np.int64(1023), np.int64(52)
# bits of the root of 1/2
_ROOT_OF_HALF = np.int64(0x3FE6A09E667F3BCD)
# powers of e between which all are normal numbers
_LEAST, _MOST = -708.0, 709.0
_SMALLEST = 1e-300


@kernel(inline=True)
def inverse_cube_root(x: float) -> float:
    """Give ``x^(-1/3)`` to a few units of round-off, x above 1e-300.

    The first guess is within 4 %; a step cubes the error (the series of ``(1 - c)^(-1/3)``, c what is amiss).
    """
    x = x if x > _SMALLEST else _SMALLEST
    upper = np.float64(x).view(np.uint64) >> _HALF
    y = np.uint64((_ROOT - ((upper * _THIRD) >> _HALF)) << _HALF).view(np.float64)
    for _ in range(3):
        c = 1.0 - x * y * (y * y)
        y += y * c * (1.0 / 3.0 + c * (2.0 / 9.0))
    return y


@kernel(inline=True)
def power_of_e(x: float) -> tuple[float, float]:
    """Give ``2^n`` and ``exp(r) - 1`` of ``exp(x) = 2^n exp(r)``, to a few units of round-off.

    r is within half of ln 2, and its series to r^13 has all digits.
    """
    x = x if x > _LEAST else _LEAST
    x = x if x < _MOST else _MOST
    n = math.floor(x * _LOG2_E + 0.5)
    r = (x - n * _LN2_HIGH) - n * _LN2_LOW
    p = 1.0 / 6227020800.0
    p = p * r + 1.0 / 479001600.0
    p = p * r + 1.0 / 39916800.0
    p = p * r + 1.0 / 3628800.0
    p = p * r + 1.0 / 362880.0
    p = p * r + 1.0 / 40320.0
    p = p * r + 1.0 / 5040.0
    p = p * r + 1.0 / 720.0
    p = p * r + 1.0 / 120.0
    p = p * r + 1.0 / 24.0
    p = p * r + 1.0 / 6.0
    p = p * r + 0.5
    return np.int64((np.int64(n) + _BIAS) << _MANTISSA).view(np.float64), r + (r * r) * p


@kernel(inline=True)
def exponential(x: float) -> float:
    """Give ``exp(x)`` to a few units of round-off, x between -708 and 709."""
    power, rest = power_of_e(x)
    return float(power * rest + power)


@kernel(inline=True)
def exponential_less_1(x: float) -> float:
    """Give ``exp(x) - 1`` to a few units of round-off, x at most 709."""
    power, rest = power_of_e(x)
    return float(power * rest + (power - 1.0))


@kernel(inline=True)
def logarithm(x: float) -> float:
    """Give the natural logarithm to a few units of round-off, x above 1e-300.

    ``ln x = n ln 2 + 2 artanh f``, ``f = (m - 1)/(m + 1)``, m between the roots of 1/2 and 2.
    """
    x = x if x > _SMALLEST else _SMALLEST
    bits = np.float64(x).view(np.int64)
    n = (bits - _ROOT_OF_HALF) >> _MANTISSA
    m = np.int64(bits - (n << _MANTISSA)).view(np.float64)
    f = (m - 1.0) / (m + 1.0)
    square = f * f
    p = 1.0 / 23.0
    p = p * square + 1.0 / 21.0
    p = p * square + 1.0 / 19.0
    p = p * square + 1.0 / 17.0
    p = p * square + 1.0 / 15.0
    p = p * square + 1.0 / 13.0
    p = p * square + 1.0 / 11.0
    p = p * square + 1.0 / 9.0
    p = p * square + 1.0 / 7.0
    p = p * square + 1.0 / 5.0
    p = p * square + 1.0 / 3.0
    # the first term last, from m - 1, which is exact
    near = 2.0 * f + 2.0 * f * (square * p)
    return float(n) * _LN2_HIGH + (near + float(n) * _LN2_LOW)
