"""A signal that arrives late, out of a ring of its past values."""

from math import ceil

from numba import njit

_LENGTH = 256
ROOM = _LENGTH + 3
"""Numbers that :func:`delayed` remembers."""

_FILLED, _NEWEST, _WAITED = _LENGTH, _LENGTH + 1, _LENGTH + 2


@njit(error_model='numpy')
def delayed(s, value, delay, h):
    """
    Return what ``value`` was ``delay`` seconds ago; call it once every ``h`` seconds.

    ``s`` is the memory, shape (ROOM,), zero at the start; before the first call the signal is
    taken to have stood at its first value. Values are kept at every call, or, where the delay is
    longer than the ring, at every second, third ... call; between two of them lies a straight
    line. A delay of zero returns the value itself and remembers nothing.
    """
    if delay <= 0.0 or h <= 0.0:
        return value
    if s[_FILLED] == 0.0:
        s[_FILLED] = 1.0
        for i in range(_LENGTH):
            s[i] = value
    stride = 1 if delay <= h * (_LENGTH - 2) else ceil(delay / (h * (_LENGTH - 2)))
    newest = int(s[_NEWEST])
    s[_WAITED] += 1.0
    if s[_WAITED] >= stride:
        s[_WAITED] = 0.0
        newest = newest + 1 if newest + 1 < _LENGTH else 0
        s[newest] = value
        s[_NEWEST] = newest

    # how far back from the newest that is kept, in places of the ring
    back = (delay / h - s[_WAITED]) / stride
    if back <= 0.0:
        return value
    whole = int(back)
    share = back - whole
    late = newest - whole
    later = s[late] if late >= 0 else s[late + _LENGTH]
    earlier = s[late - 1] if late >= 1 else s[late - 1 + _LENGTH]
    return later + share * (earlier - later)
