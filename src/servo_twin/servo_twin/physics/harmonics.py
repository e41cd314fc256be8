"""Sums of harmonics over an angle, for laws that repeat with a turn."""

from numba import njit

from .elementary_functions import cos_sin


@njit(error_model='numpy')
def wave(cosine, sine, phase):
    """
    Return the sum of ``cosine[i] cos((i+1) phase) + sine[i] sin((i+1) phase)``.

    The rows are arrays of shape (n,), ``phase`` in rad. One cosine and one sine are computed, the
    multiples follow by adding angles.
    """
    once_cos, once_sin = cos_sin(phase)
    c, z, total = once_cos, once_sin, 0.0
    for i in range(len(cosine)):
        total += cosine[i] * c + sine[i] * z
        c, z = c * once_cos - z * once_sin, z * once_cos + c * once_sin
    return total


@njit(error_model='numpy')
def wave_slope(cosine, sine, phase):
    """Return the derivative of :func:`wave` by its phase."""
    once_cos, once_sin = cos_sin(phase)
    c, z, total = once_cos, once_sin, 0.0
    for i in range(len(cosine)):
        total += (i + 1) * (sine[i] * c - cosine[i] * z)
        c, z = c * once_cos - z * once_sin, z * once_cos + c * once_sin
    return total
