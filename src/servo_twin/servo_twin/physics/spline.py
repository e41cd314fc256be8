"""Curves of any form for flexible effects: uniform cubic B-splines, open or over a turn."""

from math import floor, pi

from numba import njit


@njit(error_model='numpy')
def spline(row, x, low, high):
    """
    Return the cubic B-spline with coefficients ``row`` at ``x``; beyond low and high it stays.

    ``row`` (n,) with n of at least 4 holds over n - 3 even intervals from ``low`` to ``high``; one
    of fewer coefficients is constant, the first. Source: de Boor: A Practical Guide to Splines.
    """
    intervals = len(row) - 3
    if intervals < 1:
        return row[0]
    at = (x - low) / (high - low) * intervals
    at = min(max(at, 0.0), float(intervals))
    k = min(int(at), intervals - 1)
    return _cubic(row[k], row[k + 1], row[k + 2], row[k + 3], at - k)


@njit(error_model='numpy')
def turning(row, angle):
    """Return the cubic B-spline that repeats each turn: ``row`` (n,) over 2 pi, angle in rad."""
    size = len(row)
    at = angle * (size / (2.0 * pi))
    whole = floor(at)
    k = int(whole) % size
    return _cubic(row[k], row[(k + 1) % size], row[(k + 2) % size], row[(k + 3) % size],
                  at - whole)


@njit(error_model='numpy')
def over_angle(row, angle, low, high):
    """Return the B-spline between two angles, rad; over a turn where ``high`` is not above."""
    if high > low:
        return spline(row, angle, low, high)
    return turning(row, angle)


@njit(error_model='numpy')
def _cubic(a, b, c, d, u):
    v = 1.0 - u
    return (a * v * v * v + b * (3.0 * u * u * (u - 2.0) + 4.0)
            + c * (3.0 * v * v * (v - 2.0) + 4.0) + d * u * u * u) / 6.0
