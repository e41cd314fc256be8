"""Networks of one hidden layer."""

from numba import njit

from .elementary_functions import tanh

_CHUNK = 32


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
            s[j] = w1[i] * x1 + w2[i] * x2 - threshold[i]
        for j in range(_CHUNK):  # those behind the last too: a loop of fixed length has no rest
            s[j] = tanh(s[j])
        even, odd, third, fourth = 0.0, 0.0, 0.0, 0.0
        whole = count - count % 4
        for j in range(0, whole, 4):
            even += v[start + j] * s[j]
            odd += v[start + j + 1] * s[j + 1]
            third += v[start + j + 2] * s[j + 2]
            fourth += v[start + j + 3] * s[j + 3]
        for j in range(whole, count):
            even += v[start + j] * s[j]
        total += (even + odd) + (third + fourth)
    return total


@njit(error_model='numpy')
def sigmoids(w1, w2, threshold, v, level, x1, x2):
    r"""
    Return the answer of a network of sigmoids, whose rows are arrays of shape (nodes,).

    .. math:: y = \sum_{j=1}^l v_j\,\sigma(w_{1j} x_1 + w_{2j} x_2 - a_j) - b, \quad
              \sigma(z) = \frac{1}{1 + e^{-z}}
    """
    total = -level
    for j in range(len(v)):
        inside = w1[j] * x1 + w2[j] * x2 - threshold[j]
        total += v[j] * (0.5 + 0.5 * tanh(0.5 * inside))
    return total
