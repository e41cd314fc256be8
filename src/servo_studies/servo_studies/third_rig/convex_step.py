r"""
The speeds of two shafts at the end of a step, with Coulomb friction as a set-valued force.

They solve one strictly convex problem of two unknowns,

.. math:: \min_{v^+} \tfrac12 v^{+T} A v^+ - r^T v^+ + \sum_i F_i |v_i^+|

Friction is therefore exact at rest and no event has to be located. Source: Jean, CMAME 177 (1999);
Acary, Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, Springer 2008, ch. 10.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True, error_model='numpy')
def solve(a, b, c, r, s, up_1, down_1, up_2, down_2, way_1, way_2):
    """
    Return the speeds that minimise the step's convex problem with matrix [[a, b], [b, c]].

    ``up`` and ``down`` are what each shaft resists with forward and in reverse; the signs of the
    speeds are tried as they were (``way``) before all others.
    """
    guess_1, guess_2 = 0.0, 0.0
    for n in range(-1, 9):
        i, j = (way_1, way_2) if n < 0 else (n // 3 - 1, n % 3 - 1)
        r_1 = r - (up_1 if i > 0 else -down_1 if i < 0 else 0.0)
        s_2 = s - (up_2 if j > 0 else -down_2 if j < 0 else 0.0)
        if i != 0 and j != 0:
            whole = a * c - b * b
            v, w = (c * r_1 - b * s_2) / whole, (a * s_2 - b * r_1) / whole
        else:
            v, w = (r_1 / a if i != 0 else 0.0), (s_2 / c if j != 0 else 0.0)
        left_1, left_2 = r - b * w, s - b * v
        if n <= 0 or abs(v) + abs(w) > abs(guess_1) + abs(guess_2):
            guess_1, guess_2 = v, w
        if ((v * i > 0.0 if i != 0 else -down_1 <= left_1 <= up_1)
                and (w * j > 0.0 if j != 0 else -down_2 <= left_2 <= up_2)):
            return v, w
    return guess_1, guess_2
