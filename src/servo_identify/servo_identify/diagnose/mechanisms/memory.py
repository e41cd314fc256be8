"""Operators with memory: what follows a motion after each reversal, and what swings behind it."""

from __future__ import annotations

from numba import njit
import numpy as np
from scipy.signal import lfilter

from servo_twin.physics.dahl_state import built_up

LOOPS = (0.05, 0.12, 0.3, 0.7)
"""Shares of the largest torque over which a loop may close: one that never does is elastic."""


def stop_operator(x: np.ndarray, width: float) -> np.ndarray:
    """
    Return the elastoplastic (Maxwell-slip) answer to ``x``, between -1 and 1, shape of ``x``.

    It follows ``x`` over ``width`` after each reversal and then slips. Source: Al-Bender,
    Lampaert, Swevers: IEEE TAC 50(11), 2005.
    """
    return _stop(np.ascontiguousarray(x), width)


def dahl_operator(x: np.ndarray, travel: float) -> np.ndarray:
    """
    Return Dahl's answer to ``x``, between -1 and 1, shape of ``x``.

    It is 1 where ``x`` has risen by many times ``travel``.
    """
    return _dahl(np.ascontiguousarray(x), travel)


def resonator(acceleration: np.ndarray, period: float, frequency: float,
              damping: float) -> np.ndarray:
    r"""
    Return the acceleration of a mass that hangs on a spring, rad/s2, shape of ``acceleration``.

    .. math:: \ddot v + 2\zeta\omega\dot v + \omega^2 v = 2\zeta\omega\dot a + \omega^2 a

    ``frequency`` Hz, ``damping`` a share of critical. Bilinear transform, warped at its frequency.
    """
    natural = 2.0 * np.pi * frequency
    c = natural / np.tan(0.5 * natural * period)
    top = np.array([natural**2 + 2.0 * damping * natural * c, 2.0 * natural**2,
                    natural**2 - 2.0 * damping * natural * c])
    bottom = top + np.array([c**2, -2.0 * c**2, c**2])
    return lfilter(top / bottom[0], bottom / bottom[0], acceleration)


def relaxation(angle: np.ndarray, period: float, time: float) -> np.ndarray:
    """
    Return what is left of the stretch of a spring that fades, rad, shape of ``angle``.

    It fades to 37 % in ``time`` (s), from no stretch at the start. Exact where the angle goes on
    straight from sample to sample (Maxwell element).
    """
    keep = float(np.exp(-period / time))
    gain = (1.0 - keep) * time / period
    return lfilter([gain, -gain], [1.0, -keep], angle - angle[0])


def lagged(x: np.ndarray, time: float, period: float) -> np.ndarray:
    """Return ``x`` behind a lag of first order that begins settled, shape of ``x``."""
    keep = float(np.exp(-period / time))
    return lfilter([1.0 - keep], [1.0, -keep], x, zi=[keep * x[0]])[0]


def hurried(x: np.ndarray, time: float, period: float) -> np.ndarray:
    """Return what came before a lag of first order that made ``x`` of it, shape of ``x``."""
    return x + time * np.gradient(x, period)


def within_rate(x: np.ndarray, most: float) -> np.ndarray:
    """Return what follows ``x`` by no more than ``most`` a sample, shape of ``x``."""
    return _within_rate(np.ascontiguousarray(x), most)


@njit(cache=True, nogil=True)
def _within_rate(x: np.ndarray, most: float) -> np.ndarray:
    out = x.copy()
    for k in range(1, len(x)):
        out[k] = out[k - 1] + min(max(x[k] - out[k - 1], -most), most)
    return out


@njit(cache=True, nogil=True)
def _dahl(x: np.ndarray, travel: float) -> np.ndarray:
    out = np.zeros(len(x))
    for k in range(1, len(x)):
        out[k] = built_up(out[k - 1], x[k] - x[k - 1], travel)
    return out


@njit(cache=True, nogil=True)
def _stop(x: np.ndarray, width: float) -> np.ndarray:
    out = np.zeros(len(x))
    z = 0.0
    for k in range(1, len(x)):
        z = min(max(z + (x[k] - x[k - 1]) / width, -1.0), 1.0)
        out[k] = z
    return out
