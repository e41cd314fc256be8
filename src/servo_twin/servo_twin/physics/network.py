"""Networks of one hidden layer, with a tanh that several nodes compute side by side."""

from math import log

from numba import njit
import numpy as np

_CHUNK = 32
_PER_LN2 = 1.0 / log(2.0)
_LN2_HIGH, _LN2_LOW = 6.93145751953125e-1, 1.42860682030941723212e-6
_ROUND = 6755399441055744.0  # 1.5 * 2**52: what is added to it loses its fraction
_P0, _P1, _P2 = 1.26177193074810590878e-4, 3.02994407707441961300e-2, 9.99999999999999999910e-1
_Q0, _Q1 = 3.00198505138664455042e-6, 2.52448340349684104192e-3
_Q2, _Q3 = 2.27265548208155028766e-1, 2.0


@njit(error_model='numpy')
def tanh(x):
    r"""
    Hyperbolic tangent, without branches and calls, so that the compiler does several at once.

    With :math:`2x = k \ln 2 + r` and Cephes' :math:`e^r = 1 + 2P/(Q - P)`,

    .. math:: \tanh x = \frac{2^{k+1} P + (2^k - 1)(Q - P)}{2^{k+1} P + (2^k + 1)(Q - P)}

    Good to 1e-15 of its value everywhere. Source: Moshier, Cephes, exp.c.
    """
    y = 2.0 * min(max(x, -20.0), 20.0)
    shifted = y * _PER_LN2 + _ROUND
    k = shifted - _ROUND
    power = np.int64((np.float64(shifted).view(np.int64) + 1023) << 52).view(np.float64)
    r = (y - k * _LN2_HIGH) - k * _LN2_LOW
    square = r * r
    p = r * ((_P0 * square + _P1) * square + _P2)
    rest = ((_Q0 * square + _Q1) * square + _Q2) * square + _Q3 - p
    up = 2.0 * power * p
    return (up + (power - 1.0) * rest) / (up + (power + 1.0) * rest)


@njit(error_model='numpy')
def two_layers(w1, w2, threshold, v, x1, x2, s):
    """
    Return the sum over nodes j of ``v[j] tanh(w1[j] x1 + w2[j] x2 - threshold[j])``.

    The rows are arrays of shape (nodes,); ``s`` is room for the nodes' answers, shape (32,) or
    more. The order of summation is fixed: the same sum on every machine.
    """
    total = 0.0
    for start in range(0, len(v), _CHUNK):
        count = min(_CHUNK, len(v) - start)
        for j in range(count):
            i = start + j
            s[j] = v[i] * tanh(w1[i] * x1 + w2[i] * x2 - threshold[i])
        even, odd, third, fourth = 0.0, 0.0, 0.0, 0.0
        whole = count - count % 4
        for j in range(0, whole, 4):
            even += s[j]
            odd += s[j + 1]
            third += s[j + 2]
            fourth += s[j + 3]
        for j in range(whole, count):
            even += s[j]
        total += (even + odd) + (third + fourth)
    return total
