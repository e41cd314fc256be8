"""
Elementary functions that the compiler can put in place of their call.

A call of the C library costs a step more than the function itself, cannot be done for several
numbers at once, and rounds as the library of that machine does. These give the same bits on every
machine.
"""

from numba import njit, types
from numba.extending import intrinsic
import numpy as np

_ROUND = 6755399441055744.0  # 1.5 * 2**52: what is added to it loses its fraction
_PER_LN2 = 1.4426950408889634
_LN2_HIGH, _LN2_LOW = 6.93145751953125e-1, 1.42860682030941723212e-6
_P0, _P1, _P2 = 1.26177193074810590878e-4, 3.02994407707441961300e-2, 9.99999999999999999910e-1
_Q0, _Q1 = 3.00198505138664455042e-6, 2.52448340349684104192e-3
_Q2, _Q3 = 2.27265548208155028766e-1, 2.0

_PER_QUARTER = 6.36619772367581382433e-1  # 2 / pi
_QUARTER_HIGH, _QUARTER_LOW = 1.57079632673412561417, 6.07710050630396597660e-11
_QUARTER_LEFT = 2.02226624879595063154e-21
_S1, _S2, _S3 = -1.66666666666666324348e-1, 8.33333333332248946124e-3, -1.98412698298579493134e-4
_S4, _S5, _S6 = 2.75573137070700676789e-6, -2.50507602534068634195e-8, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-2, -1.38888888888741095749e-3, 2.48015872894767294178e-5
_C4, _C5, _C6 = -2.75573143513906633035e-7, 2.08757232129817482790e-9, -1.13596475577881948265e-11


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
def _parts(y):
    """Return (2^k, P, Q - P) with exp(y) = 2^k (1 + 2P / (Q - P)), |y| below 708."""
    shifted = fused(y, _PER_LN2, _ROUND)
    k = shifted - _ROUND
    power = np.int64((np.float64(shifted).view(np.int64) + 1023) << 52).view(np.float64)
    r = fused(-k, _LN2_LOW, fused(-k, _LN2_HIGH, y))
    square = r * r
    p = r * fused(fused(_P0, square, _P1), square, _P2)
    return power, p, fused(fused(fused(_Q0, square, _Q1), square, _Q2), square, _Q3) - p


@njit(error_model='numpy')
def exp(x):
    """
    Exponential, good to 1e-15 of its value; beyond 700 either way it stands still.

    Source: Moshier, Cephes, exp.c.
    """
    power, p, rest = _parts(min(max(x, -700.0), 700.0))
    return power * (1.0 + 2.0 * p / rest)


@njit(error_model='numpy')
def tanh(x):
    r"""
    Hyperbolic tangent, good to 1e-15 of its value.

    With the parts of :math:`e^{2x}`, so that nothing cancels where x is small,

    .. math:: \tanh x = \frac{2^{k+1} P + (2^k - 1)(Q - P)}{2^{k+1} P + (2^k + 1)(Q - P)}
    """
    power, p, rest = _parts(2.0 * min(max(x, -20.0), 20.0))
    up = 2.0 * power * p
    return (up + (power - 1.0) * rest) / (up + (power + 1.0) * rest)


@njit(error_model='numpy')
def cos_sin(x):
    """
    Return (cosine, sine) of x in rad, both to 1e-15 while abs(x) is below a million.

    The terms of each series are taken in pairs, so that few of them wait for one another.
    Source: Sun, fdlibm, k_sin.c and k_cos.c.
    """
    shifted = fused(x, _PER_QUARTER, _ROUND)
    quarters = shifted - _ROUND
    r = fused(-quarters, _QUARTER_HIGH, x)
    r = fused(-quarters, _QUARTER_LOW, r)
    r = fused(-quarters, _QUARTER_LEFT, r)
    z = r * r
    z2 = z * z
    z4 = z2 * z2
    s = fused(z4, fused(z, _S6, _S5), fused(z2, fused(z, _S4, _S3), fused(z, _S2, _S1)))
    c = fused(z4, fused(z, _C6, _C5), fused(z2, fused(z, _C4, _C3), fused(z, _C2, _C1)))
    s = fused(r * z, s, r)
    c = fused(z2, c, fused(-0.5, z, 1.0))
    quadrant = np.float64(shifted).view(np.int64) & 3
    if quadrant & 1:
        c, s = s, c
    cosine = -c if quadrant == 1 or quadrant == 2 else c
    sine = -s if quadrant >= 2 else s
    return cosine, sine
