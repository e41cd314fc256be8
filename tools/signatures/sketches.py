"""
Small sketches of signatures: what a rig with the effect shows (red) over a twin without it (grey).

Each sketch is a formula over a variable, without scale: it shows the shape to look for.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

RIG, TWIN = '#d1495b', '#8a8f98'
X = np.linspace(-1.0, 1.0, 121)
TURN = np.linspace(0.0, 2.0 * np.pi, 161)
TIME = np.linspace(0.0, 1.0, 161)
UP = np.linspace(0.0, 1.0, 81)
Curve = tuple[np.ndarray, np.ndarray]


def _sign(x: np.ndarray) -> np.ndarray:
    return np.where(np.abs(x) < 1e-9, np.nan, np.sign(x))


def _loop(width: float) -> Curve:
    """Return a hysteresis loop over -1 to 1: up on the lower branch, down on the upper one."""
    rise = np.concatenate([X, X[::-1]])
    way = np.concatenate([np.ones(len(X)), -np.ones(len(X))])
    since = np.concatenate([X + 1.0, 1.0 - X[::-1]])
    return rise, rise - way * width * (1.0 - 2.0 * np.exp(-6.0 * since))


def _resonance(at: float, damping: float) -> np.ndarray:
    f = np.linspace(0.05, 1.0, 161)
    return np.log(1.0 / np.hypot(1.0 - (f / at)**2, 2.0 * damping * f / at))


F = np.linspace(0.05, 1.0, 161)
TWO_LOADS = np.concatenate([TURN, [np.nan], TURN])

# Name of the sketch: label of x, label of y, curve of the rig, curve of the twin.
SKETCHES: dict[str, tuple[str, str, Callable[[], Curve], Callable[[], Curve]]] = {
    'coulomb_friction': ('speed', 'torque', lambda: (X, 0.8 * _sign(X)), lambda: (X, 0.0 * X)),
    'viscous_friction': ('speed', 'torque', lambda: (X, 0.4 * _sign(X) + 0.6 * X),
                         lambda: (X, 0.4 * _sign(X))),
    'stribeck_friction': (
        'speed', 'torque',
        lambda: (X, _sign(X) * (0.5 + 0.5 * np.exp(-(X / 0.15)**2) + 0.2 * abs(X))),
        lambda: (X, _sign(X) * (0.5 + 0.2 * abs(X)))),
    'presliding_friction': ('angle since the reversal', 'friction', lambda: _loop(0.0)[:1] + (
        np.concatenate([1.0 - 2.0 * np.exp(-4.0 * (X + 1.0)),
                        -1.0 + 2.0 * np.exp(-4.0 * (1.0 - X[::-1]))]),),
        lambda: (np.array([-1.0, -1.0, 1.0, 1.0, -1.0]), np.array([-1.0, 1.0, 1.0, -1.0, -1.0]))),
    'asymmetric_friction': ('speed', 'torque', lambda: (X, np.where(X > 0, 0.9, -0.5)),
                            lambda: (X, 0.7 * _sign(X))),
    'load_dependent_friction': (
        'transmitted torque', 'motor torque',
        lambda: (np.concatenate([X, [np.nan], X]),
                 np.concatenate([X + 0.15 + 0.3 * abs(X), [np.nan], X - 0.15 - 0.3 * abs(X)])),
        lambda: (np.concatenate([X, [np.nan], X]),
                 np.concatenate([X + 0.15, [np.nan], X - 0.15]))),
    'position_dependent_friction': (
        'angle, both ways', 'torque',
        lambda: (TWO_LOADS, np.concatenate([0.6 + 0.25 * np.sin(TURN), [np.nan],
                                            -0.6 - 0.25 * np.sin(TURN)])),
        lambda: (TWO_LOADS, np.concatenate([0.6 + 0 * TURN, [np.nan], -0.6 + 0 * TURN]))),
    'quadratic_drag': ('speed', 'torque', lambda: (X, 0.2 * X + 0.8 * X * abs(X)),
                       lambda: (X, 0.2 * X)),
    'friction_drift': ('time, minutes', 'friction', lambda: (UP, 0.5 + 0.5 * np.exp(-3.0 * UP)),
                       lambda: (UP, 0.5 + 0.0 * UP)),
    'side_of_friction': ('speed', 'torsion', lambda: (X, 0.8 * _sign(X)), lambda: (X, 0.0 * X)),
    'cogging': ('motor angle, both ways', 'torque', lambda: (
        TWO_LOADS, np.concatenate([0.4 + 0.25 * np.sin(6 * TURN), [np.nan],
                                   -0.4 + 0.25 * np.sin(6 * TURN)])),
        lambda: (TWO_LOADS, np.concatenate([0.4 + 0 * TURN, [np.nan], -0.4 + 0 * TURN]))),
    'torque_ripple': ('motor angle, two currents', 'torque', lambda: (
        TWO_LOADS, np.concatenate([0.9 + 0.18 * np.sin(6 * TURN), [np.nan],
                                   0.3 + 0.06 * np.sin(6 * TURN)])),
        lambda: (TWO_LOADS, np.concatenate([0.9 + 0 * TURN, [np.nan], 0.3 + 0 * TURN]))),
    'torque_constant_error': ('current', 'torque', lambda: (X, 0.75 * X), lambda: (X, X)),
    'torque_saturation': ('current', 'torque', lambda: (X, X / (1.0 + 0.5 * X**2)),
                          lambda: (X, X)),
    'current_sensor_offset': ('current', 'reading', lambda: (X, X + 0.25), lambda: (X, X)),
    'current_sensor_gain': ('current', 'reading', lambda: (X, 1.25 * X), lambda: (X, X)),
    'constant_torque': ('speed', 'torque', lambda: (X, 0.5 + 0.0 * X), lambda: (X, 0.0 * X)),
    'gravity': ('load angle', 'torque', lambda: (TURN, np.cos(TURN - 0.6)),
                lambda: (TURN, 0.0 * TURN)),
    'spring_load': ('load angle', 'torque', lambda: (X, -0.9 * X), lambda: (X, 0.0 * X)),
    'inertia': ('acceleration', 'torque', lambda: (X, X), lambda: (X, 0.7 * X)),
    'current_lag': ('frequency', 'current / command', lambda: (F, 1.0 / np.hypot(1.0, 2.5 * F)),
                    lambda: (F, 1.0 + 0.0 * F)),
    'command_delay': ('frequency', 'phase', lambda: (F, -F), lambda: (F, -0.15 * F)),
    'drive_dead_band': ('command', 'current',
                        lambda: (X, np.sign(X) * np.maximum(abs(X) - 0.25, 0.0)), lambda: (X, X)),
    'drive_saturation': ('command', 'current', lambda: (X, np.clip(X, -0.6, 0.6)),
                         lambda: (X, X)),
    'stiffness_error': ('torque', 'torsion', lambda: (X, X), lambda: (X, 0.65 * X)),
    'nonlinear_stiffness': ('torque', 'torsion',
                            lambda: (X, 0.6 * X + 0.3 * np.tanh(5.0 * X)), lambda: (X, 0.75 * X)),
    'backlash': ('torque', 'torsion', lambda: (X, 0.5 * X + 0.4 * _sign(X)), lambda: (X, 0.5 * X)),
    'load_dependent_backlash': (
        'torque', 'lost motion', lambda: (UP, 0.3 + 0.6 * UP / (0.4 + UP)),
        lambda: (UP, 0.3 + 0.0 * UP)),
    'position_dependent_backlash': ('load angle', 'lost motion',
                                    lambda: (TURN, 0.5 + 0.3 * np.sin(TURN)),
                                    lambda: (TURN, 0.5 + 0.0 * TURN)),
    'hysteresis': ('torque', 'torsion', lambda: _loop(0.22), lambda: (X, X)),
    'viscoelasticity': ('time', 'torsion', lambda: (
        TIME, np.where(TIME < 0.2, 0.0, 0.8 - 0.3 * np.exp(-6.0 * (TIME - 0.2)))),
        lambda: (TIME, 0.8 * (TIME >= 0.2))),
    'slip': ('turns under a load', 'torsion', lambda: (TIME, 0.2 + 0.7 * TIME),
             lambda: (TIME, 0.2 + 0.0 * TIME)),
    'transmission_error': ('load angle', 'torsion', lambda: (
        TURN, 0.4 * np.sin(TURN) + 0.25 * np.sin(9 * TURN)), lambda: (TURN, 0.0 * TURN)),
    'load_encoder_eccentricity': ('load angle', 'torsion', lambda: (TURN, 0.7 * np.sin(TURN)),
                                  lambda: (TURN, 0.0 * TURN)),
    'sensor_delay': ('speed', 'torsion', lambda: (X, 0.8 * X), lambda: (X, 0.0 * X)),
    'torque_sensor_gain': ('transmitted torque', 'reading', lambda: (X, 1.25 * X),
                           lambda: (X, X)),
    'torque_sensor_offset': ('transmitted torque', 'reading', lambda: (X, X + 0.25),
                             lambda: (X, X)),
    'torque_sensor_inertia': ('acceleration', 'reading', lambda: (X, 0.65 * X), lambda: (X, X)),
    'torque_sensor_hysteresis': ('transmitted torque', 'reading', lambda: _loop(0.22),
                                 lambda: (X, X)),
    'motor_encoder_eccentricity': ('motor angle', 'torsion', lambda: (
        TURN, 0.6 * np.sin(TURN) + 0.2 * np.sin(2 * TURN)), lambda: (TURN, 0.0 * TURN)),
    'payload_resonance': ('frequency', 'gain', lambda: (
        F, _resonance(0.75, 0.1) + 0.4 * _resonance(0.35, 0.06)),
        lambda: (F, _resonance(0.75, 0.1))),
    'relaxing_spring': ('time', 'torque', lambda: (
        TIME, np.where(TIME < 0.3, TIME / 0.3, np.exp(-5.0 * (TIME - 0.3)))),
        lambda: (TIME, 0.0 * TIME)),
    'command_rate_limit': ('time', 'current', lambda: (
        TIME, np.clip(1.6 * (TIME - 0.2), 0.0, 1.0)), lambda: (TIME, 1.0 * (TIME > 0.2))),
    'torque_speed_limit': ('speed', 'current', lambda: (
        X, np.minimum(1.0, 1.3 - 1.2 * X)), lambda: (X, 1.0 + 0.0 * X)),
    'braking_power_limit': ('speed', 'current of braking', lambda: (
        X, np.minimum(1.0, 0.4 / np.maximum(X, 0.4))), lambda: (X, 1.0 + 0.0 * X)),
    'sensor_lag': ('time', 'reading', lambda: (
        TIME, (TIME > 0.2) * (1.0 - np.exp(-8.0 * np.maximum(TIME - 0.2, 0.0)))),
        lambda: (TIME, 1.0 * (TIME > 0.2))),
    'external_torque': ('time', 'torque', lambda: (
        TIME, 0.5 * np.sin(16 * TIME) + 0.2 * np.sin(32 * TIME)), lambda: (TIME, 0.0 * TIME)),
    'controller_mismatch': ('time', 'command', lambda: (
        TIME, 1.0 - np.exp(-4 * TIME) * np.cos(16 * TIME)),
        lambda: (TIME, 1.0 - np.exp(-7 * TIME))),
}


def draw(folder: Path) -> None:
    """Write one SVG for each sketch; the same code writes the same bytes."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    folder.mkdir(parents=True, exist_ok=True)
    style = {'svg.hashsalt': 'signatures', 'svg.fonttype': 'none', 'font.size': 8,
             'font.family': 'sans-serif', 'text.color': TWIN, 'axes.labelcolor': TWIN,
             'axes.edgecolor': TWIN, 'path.simplify_threshold': 0.5}
    with rc_context(style):
        for name, (x, y, rig, twin) in SKETCHES.items():
            figure = Figure(figsize=(1.9, 1.25), layout='constrained')
            axes = figure.subplots()
            axes.plot(*twin(), color=TWIN, linewidth=1.4, linestyle='--')
            axes.plot(*rig(), color=RIG, linewidth=1.8)
            axes.set(xlabel=x, ylabel=y, xticks=[], yticks=[])
            axes.spines[['top', 'right']].set_visible(False)
            figure.savefig(folder / f'{name}.svg', transparent=True, metadata={'Date': None})
