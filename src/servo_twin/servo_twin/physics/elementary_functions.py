"""
Elementary functions that the compiler can put in place of their call.

A call of the C library costs a step more than the function itself, cannot be done for several
numbers at once, and rounds as the library of that machine does. These give the same bits on every
machine.
"""

from decimal import Decimal, localcontext
from math import factorial

from numba import njit, types
from numba.extending import intrinsic
import numpy as np

_ROUND = 6755399441055744.0  # 1.5 * 2**52: what is added to it loses its fraction
_PER_LN2 = 1.4426950408889634
_LN2_HIGH, _LN2_LOW = 0.6931471805599453, 2.3190468138462996e-17  # their sum is ln 2
_E2, _E3, _E4 = 0.5000000000000001, 0.16666666666666669, 0.041666666666624164
_E5, _E6, _E7 = 0.008333333333330065, 0.0013888888917196719, 0.00019841269863040545
_E8, _E9 = 2.4801521322368692e-05, 2.7557268480310024e-06
_E10, _E11 = 2.7620075879983367e-07, 2.5100375832561234e-08

_PARTS = 512  # of a turn, that the table of cosines and sines has
_PER_PART = 81.48733086305042
_PART_HIGH, _PART_LOW = 0.01227184630308513, 4.783776559169348e-19  # their sum is a part, rad


@intrinsic
def fused(typing_context, a, b, c):
    """
    Return ``a b + c``, rounded once: one instruction, and the same bits wherever it runs.

    Source: IEEE 754-2008, 5.4.1, fusedMultiplyAdd.
    """

    def code(context, builder, signature, arguments):
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), code


@njit(error_model='numpy')
def limited(x, limit):
    """Return x, or what of it lies within a limit to either side; NaN stays NaN."""
    if x > limit:
        return limit
    return max(x, -limit)


@njit(error_model='numpy')
def whole(x):
    """Return the largest whole number that is not above x, as a float: NaN stays NaN."""
    return np.floor(x)


@njit(error_model='numpy')
def _power_and_growth(y):
    """
    Return (2^k, e^r - 1) with e^y = 2^k e^r and abs(r) at most half of ln 2; abs(y) below 708.

    The growth is the polynomial that is right at the Chebyshev nodes of that interval, off by
    2e-17 at most between them. Its terms are taken in groups, so that few wait for one another.
    """
    shifted = fused(y, _PER_LN2, _ROUND)
    k = shifted - _ROUND
    power = np.int64((np.float64(shifted).view(np.int64) + 1023) << 52).view(np.float64)
    r = fused(-k, _LN2_LOW, fused(-k, _LN2_HIGH, y))
    r2 = r * r
    r4 = r2 * r2
    low = fused(r2, fused(r, _E3, _E2), r)
    middle = fused(r2, fused(r, _E7, _E6), fused(r, _E5, _E4))
    high = fused(r2, fused(r, _E11, _E10), fused(r, _E9, _E8))
    return power, fused(r4, fused(r4, high, middle), low)


@njit(error_model='numpy')
def exp(x):
    """Exponential, good to 1e-15 of its value; beyond 700 either way it stands still."""
    power, growth = _power_and_growth(min(max(x, -700.0), 700.0))
    return fused(power, growth, power)


@njit(error_model='numpy')
def tanh(x):
    r"""
    Hyperbolic tangent, good to 1e-15 of its value.

    With :math:`e^{2x} = 2^k (1 + g)`, so that nothing cancels where x is small,

    .. math:: \tanh x = \frac{2^k g + 2^k - 1}{2^k g + 2^k + 1}
    """
    power, growth = _power_and_growth(2.0 * min(max(x, -20.0), 20.0))
    return fused(power, growth, power - 1.0) / fused(power, growth, power + 1.0)


def _turn(parts):
    """
    Return the cosines and the sines of all parts of a turn, shape (parts,) each.

    In decimals, for the same bits on every machine: one part by its series, the rest by adding
    angles.
    """
    with localcontext(prec=40):
        part = Decimal('6.283185307179586476925286766559005768394') / parts
        once = [part**n / factorial(n) for n in range(20)]
        once_cos, once_sin = (sum(once[n::4]) - sum(once[n + 2::4]) for n in (0, 1))
        c, s, rows = Decimal(1), Decimal(0), []
        for _ in range(parts):
            rows.append((float(c), float(s)))
            c, s = c * once_cos - s * once_sin, s * once_cos + c * once_sin
    return np.array(rows).T.copy()


_COSINES, _SINES = _turn(_PARTS)


@njit(error_model='numpy')
def cos_sin(x):
    """
    Return (cosine, sine) of x in rad, both to 1e-15 while abs(x) is below a million.

    Those of the nearest part of a turn stand in a table; the rest of the angle is so small that
    a few terms of its series do, and is added.
    """
    shifted = fused(x, _PER_PART, _ROUND)
    count = shifted - _ROUND
    nearest = np.float64(shifted).view(np.int64) & (_PARTS - 1)
    c, s = _COSINES[nearest], _SINES[nearest]
    r = fused(-count, _PART_LOW, fused(-count, _PART_HIGH, x))
    z = r * r
    sine = fused(r * z, fused(z, 1.0 / 120.0, -1.0 / 6.0), r)
    less = z * fused(z, -1.0 / 24.0, 0.5)  # 1 - cosine
    return fused(-c, less, fused(-s, sine, c)), fused(-s, less, fused(c, sine, s))
