"""Networks of one hidden layer."""

from numba import njit

from .elementary import tanh

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
