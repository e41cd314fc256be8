"""Products of the columns of a Jacobian with each other, horizon by horizon, in one pass."""

from __future__ import annotations

from numba import njit
import numpy as np


@njit(cache=True, nogil=True, error_model='numpy')
def grams(first: int, last: int, rolled: np.ndarray, unit: np.ndarray, rates: np.ndarray,
          late: np.ndarray, inverse: np.ndarray, used: np.ndarray, carry: np.ndarray,
          factor: np.ndarray, edges: np.ndarray, course: np.ndarray, residual: np.ndarray,
          robust: bool) -> np.ndarray:
    """
    Return for each horizon the products of all columns, shape (last - first, n, n).

    Columns: one for each point of a difference, one for each late channel, then the residual.
    From horizon ``first`` to before ``last``. ``rolled`` (1 + points, rows, channels) the outputs,
    those without a difference first; ``unit`` (points,) what divides a difference; ``rates``
    (late, rows) what a channel of ``late`` changes with its delay; ``inverse`` (rows, channels)
    of the noise, zero where nothing is compared; ``used`` (channels,) whether anything is;
    ``carry`` and ``factor`` (courses, channels) whiten and weigh; ``edges`` (horizons + 1,) rows;
    ``course`` (horizons,) that each is of; ``residual`` (rows, channels) weighed; ``robust``:
    Huber's weights. What is not finite moves nothing.
    """
    points, delays = len(unit), len(late)
    size = points + delays + 1
    answer = np.zeros((last - first, size, size))
    raw, before, line = np.zeros(size), np.zeros(size), np.zeros(size)
    for h in range(first, last):
        gram = answer[h - first]
        for c in range(len(used)):
            if not used[c]:
                continue
            share, weight = carry[course[h], c], factor[course[h], c]
            alone = np.sqrt(1.0 - share**2)
            for r in range(edges[h], edges[h + 1]):
                here, one = rolled[0, r, c], inverse[r, c]
                for k in range(points):
                    raw[k] = (rolled[k + 1, r, c] - here) / unit[k] * one
                for k in range(delays):
                    raw[points + k] = rates[k, r] * one if late[k] == c else 0.0
                for k in range(size - 1):
                    white = raw[k] * alone if r == edges[h] else raw[k] - share * before[k]
                    before[k] = raw[k]
                    line[k] = white * weight if np.isfinite(white) else 0.0
                value = line[size - 1] = residual[r, c]
                if robust and abs(value) > 1.5:
                    line *= np.sqrt(1.5 / abs(value))
                for i in range(size):
                    for j in range(i + 1):
                        gram[i, j] += line[i] * line[j]
        for i in range(size):
            for j in range(i):
                gram[j, i] = gram[i, j]
    return answer
