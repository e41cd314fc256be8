"""Coulomb-viscous, Stribeck, Dahl and LuGre, fitted to the same samples as the networks."""

from __future__ import annotations

from collections.abc import Callable

from numba import njit
import numpy as np
from scipy.optimize import least_squares

from ..friction_dataset import Dataset
from .friction_learner import Model, Told

SUBSTEPS = 20  # of the bristle between two samples


@njit(cache=True)
def coulomb_viscous(p, speed, period):
    """Return sgn(v) (F_c + b |v|)."""
    return np.sign(speed) * p[0] + p[1] * speed


@njit(cache=True)
def stribeck(p, speed, period):
    """Return sgn(v) (F_c + F_s exp(-(v/v_s)^2)) + b v."""
    return np.sign(speed) * (p[0] + p[2] * np.exp(-((speed / p[3]) ** 2))) + p[1] * speed


@njit(cache=True)
def dahl(p, speed, period):
    """Return Dahl's friction by its closed form over the travel of each sample, plus b v."""
    out = np.empty(len(speed))
    z = 0.0
    for k in range(len(speed)):
        way = 1.0 if speed[k] > 0.0 else -1.0
        z = way + (z - way) * np.exp(-period * abs(speed[k]) / p[2])
        out[k] = p[0] * z + p[1] * speed[k]
    return out


@njit(cache=True)
def lugre(p, speed, period):
    """Return LuGre friction: level, viscous, excess, fade, breakaway and lag of the presliding."""
    out = np.empty(len(speed))
    z = 0.0
    h = period / SUBSTEPS
    most = p[0] + p[2]
    for k in range(len(speed)):
        v = speed[k]
        slipping = (p[0] + p[2] * np.exp(-((v / p[3]) ** 2))) / max(most, 1e-12) * p[4]
        before = z
        for _ in range(SUBSTEPS):
            before = z
            z = (z + h * v) / (1.0 + h * abs(v) / max(slipping, 1e-12))
        out[k] = most / p[4] * (z + p[5] * (z - before) / h) + p[1] * v
    return out


def _fitter(name: str, law, said: Callable[[np.ndarray], str], shapes: tuple[float, ...],
            memory: bool):
    """Return a learner: parameters are level, viscous, then shapes in units of their typical."""

    def fitted(data: Dataset, seed: int, seconds: float, told: Told | None) -> Model:
        speed = data.features[:, 0]
        level = float(np.mean(np.abs(data.target[data.train])))
        top = float(np.max(np.abs(speed[data.train])))
        start = np.array([level, 0.1 * level / top, *shapes])

        def predict(p: np.ndarray, rows: np.ndarray) -> np.ndarray:
            if not memory:
                return law(p, speed[rows], data.period)
            out = np.empty(len(speed))
            for run in np.unique(data.run):
                mine = data.run == run
                out[mine] = law(p, speed[mine], data.period)
            return out[rows]

        def residual(q: np.ndarray) -> np.ndarray:
            return (predict(np.abs(q) * start, data.train) - data.target[data.train]) / level

        found = least_squares(residual, np.ones(len(start)), loss='soft_l1', f_scale=0.1,
                              max_nfev=60)
        p = np.abs(found.x) * start
        if told:
            told(0, float(2 * found.cost / len(data.train)), float(np.mean(
                (predict(p, data.validation) - data.target[data.validation]) ** 2)))
        one = np.array([0.1])
        law(p, one, data.period)
        return Model(name, lambda d, rows: predict(p, rows), len(p),
                     lambda: law(p, one, data.period)[0], said(p))

    return fitted


LEARNERS = {
    'coulomb_viscous': _fitter(
        'coulomb_viscous', coulomb_viscous,
        lambda p: f'sgn(w) {p[0]:.4g} + {p[1]:.4g} w', (), False),
    'stribeck': _fitter(
        'stribeck', stribeck,
        lambda p: f'sgn(w) ({p[0]:.4g} + {p[2]:.4g} exp(-(w/{p[3]:.3g})^2)) + {p[1]:.4g} w',
        (1.0, 0.05), False),
    'dahl': _fitter(
        'dahl', dahl,
        lambda p: f'Dahl: level {p[0]:.4g}, travel {p[2]:.3g} rad, {p[1]:.4g} w', (1e-3,), True),
    'lugre': _fitter(
        'lugre', lugre,
        lambda p: f'LuGre: level {p[0]:.4g}, excess {p[2]:.4g}, fade {p[3]:.3g} rad/s, breakaway '
                  f'{p[4]:.3g} rad, {p[1]:.4g} w', (1.0, 0.05, 1e-3, 1e-3), True),
}
