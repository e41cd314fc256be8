"""
What a user would do without a diagnosis, on the recordings of the same case.

All four see what the servo file leaves of each balance (drive, motor, load, transmission), with
its tolerances fitted inside their bounds, so that none is blamed for what a tolerance explains.
They are fitted to the screen recordings and judged by the share of the leftover's rms that they
remove on the report recordings, in the balance that is off most against its own size; nothing is
simulated again.

- `richest friction`: all terms of the richest friction model at once, none of them negative, as in
  BAM (arXiv 2410.08650); what became more than nothing is the cause.
- `stepwise BIC`: terms of the whole library one by one while the Bayesian information criterion of
  samples taken as independent falls.
- `sparse regression`: the whole library by sequentially thresholded least squares, as in SINDy.
- `residual network`: two hidden layers; names nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
import warnings

import numpy as np
from scipy.optimize import lsq_linear, nnls
from scipy.signal import savgol_filter

from servo_twin.bag import read_recording
from servo_twin.description import servo_file
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

WINDOW, EVERY = 41, 10  # samples of the smoother, and of which one is kept
VISIBLE = 0.01  # share of the friction level below which a fitted friction term is nothing
THRESHOLD = 0.05  # of a balance's leftover, below which a term is dropped by sparse regression
MOST = 12  # steps of the stepwise selection

BALANCES = ('drive', 'motor', 'load', 'transmission')
_MAIN = {'drive': 'current', 'motor': 'current', 'load': 'torque', 'transmission': 'wind_up'}
Table = dict[str, np.ndarray]


def compare(servo_path: Path, bags: Mapping[str, list[Path]]) -> dict[str, Any]:
    """Return, by baseline, the causes it names, as {effect, site}, and its shrink on report."""
    servo = servo_file.load(servo_path)
    known = {split: _joined([_motion(read_recording(b), servo) for b in bags[split]])
             for split in ('screen', 'report')}
    answers = {name: {'named': [], 'shrinks': []} for name in
               ('richest friction', 'stepwise BIC', 'sparse regression', 'residual network')}
    for balance in BALANCES:
        fit, test = (_leftover(known[split], servo, balance) for split in ('screen', 'report'))
        explained = _tolerances(known['screen'], servo, balance)
        share = _bounded(explained[0], fit, explained[1])
        fit = fit - explained[0] @ share
        test = test - _tolerances(known['report'], servo, balance)[0] @ share
        size = _rms(test) / _rms(known['report'][_MAIN[balance]])
        library = _library(known['screen'], servo, balance)
        unseen = _library(known['report'], servo, balance)
        for name, choose in (('richest friction', _richest), ('stepwise BIC', _stepwise),
                             ('sparse regression', _thresholded)):
            weights = choose(library, fit, known['screen'], balance)
            after = test - sum((w * unseen[key] for key, w in weights.items()), 0.0 * test)
            answers[name]['named'] += [{'effect': effect, 'site': site}
                                       for effect, site in dict.fromkeys(
                                           (k[0], k[1]) for k in weights)]
            answers[name]['shrinks'].append((size, _shrink(test, after)))
        after = test - _network(known['screen'], fit, known['report'])
        answers['residual network']['shrinks'].append((size, _shrink(test, after)))
    for answer in answers.values():
        answer['shrink'] = max(answer.pop('shrinks'))[1]  # in the balance that is off most
    return answers


def _motion(recording: Recording, servo: Servo) -> Table:
    """Smooth a recording and take its derivatives; one of ten samples is kept."""
    def smooth(column: str, order: int = 0) -> np.ndarray:
        return savgol_filter(recording[column], WINDOW, 3, order, recording.period)

    ratio = servo.values['mechanism.ratio']
    held = np.concatenate(([0.0], recording['voltage'][:-1]))  # acts from its sample on
    table = {'motor': smooth('motor_position'), 'w_motor': smooth('motor_position', 1),
             'a_motor': smooth('motor_position', 2), 'load': smooth('load_position'),
             'w_load': smooth('load_position', 1), 'a_load': smooth('load_position', 2),
             'torque': smooth('torque'), 'current': smooth('current'),
             'current_rate': smooth('current', 1),
             'external': smooth('external_torque'), 'command': savgol_filter(held, WINDOW, 3),
             'command_rate': savgol_filter(held, WINDOW, 3, 1, recording.period)}
    table['wind_up'] = table['motor'] / ratio - table['load']
    table['wind_up'] -= table['wind_up'].mean()
    edge = WINDOW // 2
    return {name: column[edge:-edge:EVERY] for name, column in table.items()}


def _joined(tables: list[Table]) -> Table:
    return {name: np.concatenate([t[name] for t in tables]) for name in tables[0]}


def _way(table: Table, side: str) -> np.ndarray:
    speed = table[f'w_{side}']
    return np.tanh(speed / (0.01 * np.percentile(np.abs(speed), 98) + 1e-12))


def _levels(servo: Servo, effect: str, site: str) -> float:
    return sum(servo.values[f'effects.{p.name}.{name}'] for p in servo.effects
               if p.effect.name == effect and p.site == site
               for name in ('level', 'slope', 'width') if name in p.effect.parameters)


def _leftover(t: Table, servo: Servo, balance: str) -> np.ndarray:
    """What the servo file leaves of a balance, in its own unit."""
    v = servo.values
    if balance == 'drive':
        if 'drive.resistance' not in v:
            return t['current'] - v['drive.gain'] * t['command']
        return (v['drive.gain'] * t['command'] - v['drive.back_emf'] * t['w_motor']
                - v['drive.resistance'] * t['current']
                - v['drive.inductance'] * t['current_rate']) / v['drive.resistance']
    if balance == 'transmission':
        half = 0.5 * _levels(servo, 'backlash', 'mesh')
        free = half * np.tanh(t['torque'] / (0.05 * np.abs(t['torque']).max() + 1e-12))
        return t['wind_up'] - t['torque'] / v['mechanism.stiffness'] - free
    side = balance
    friction = (_levels(servo, 'coulomb_friction', side) * _way(t, side)
                + _levels(servo, 'viscous_friction', side) * t[f'w_{side}'])
    if side == 'load':
        return (t['torque'] - t['external'] - v['mechanism.load_inertia'] * t['a_load']
                - friction)
    return (v['drive.torque_constant'] * t['current'] - t['torque'] / v['mechanism.ratio']
            - v['mechanism.rotor_inertia'] * t['a_motor'] - friction)


def _tolerances(t: Table, servo: Servo, balance: str) -> tuple[np.ndarray, np.ndarray]:
    """What tolerances can move in a balance, one column each, and the bounds of each."""
    columns = []
    nominal = _leftover(t, servo, balance)
    for path, (low, high) in servo.tolerance.items():
        moved = servo.with_values({path: high})
        change = _leftover(t, moved, balance) - nominal
        if np.any(change):
            columns.append((change, (servo.values[path] - low) / (high - servo.values[path])))
    table = np.array([c for c, _ in columns]).T.reshape(len(nominal), len(columns))
    return table, np.array([down for _, down in columns])


def _bounded(table: np.ndarray, target: np.ndarray, down: np.ndarray) -> np.ndarray:
    if not table.shape[1]:
        return np.zeros(0)
    scale = np.sqrt(np.mean(table**2, axis=0))
    found = lsq_linear(table / scale, target, (-down * scale, scale))
    return found.x / scale


def _library(t: Table, servo: Servo, balance: str) -> dict[tuple[str, str, int], np.ndarray]:
    """Terms of a balance by what they would be called: effect, site, running number."""
    rows: list[tuple[str, str, np.ndarray]] = []
    if balance == 'drive':
        rows = [('current_sensor_offset', 'current', np.ones(len(t['current']))),
                ('parameter:gain', '', t['command']), ('current_lag', '', t['current_rate']),
                ('command_delay', '', t['command_rate']),
                ('drive_dead_band', '', np.tanh(t['command'] / 0.1 / np.ptp(t['command']))),
                ('drive_saturation', '', t['command']**3)]
    elif balance == 'transmission':
        rows = [('stiffness_error', '', t['torque']),
                ('backlash', 'mesh', np.tanh(t['torque'] / 0.05 / np.abs(t['torque']).max())),
                ('nonlinear_stiffness', 'mesh', t['torque']**3),
                ('sensor_delay', '', t['w_load']),
                ('hysteresis', 'mesh', _way(t, 'load')),
                *(('load_encoder_eccentricity', '', f(t['load'])) for f in (np.cos, np.sin))]
    else:
        rows = _shaft_terms(t, balance)
    return {(effect, site, i): column for i, (effect, site, column) in enumerate(rows)}


def _shaft_terms(t: Table, side: str) -> list[tuple[str, str, np.ndarray]]:
    way, speed, angle = _way(t, side), t[f'w_{side}'], t[side]
    top = np.percentile(np.abs(speed), 98) + 1e-12
    rows = [('coulomb_friction', side, way), ('viscous_friction', side, speed),
            ('quadratic_drag', side, speed * np.abs(speed)),
            ('load_dependent_friction', side, np.abs(t['torque']) * way),
            *(('stribeck_friction', side, np.exp(-(speed / (share * top))**2) * way)
              for share in (0.03, 0.1, 0.3)),
            ('asymmetric_friction', side, np.abs(way))]
    if side == 'load':
        rows += [('load_inertia', side, t['a_load']), ('spring_load', side, angle),
                 *(('gravity', side, f(angle)) for f in (np.cos, np.sin)),
                 *(('position_dependent_friction', side, f(angle) * way)
                   for f in (np.cos, np.sin)),
                 ('torque_sensor_gain', 'torque', t['torque']),
                 ('torque_sensor_offset', 'torque', np.ones(len(way)))]
    else:
        rows += [('rotor_inertia', side, t['a_motor']),
                 ('torque_constant_error', side, t['current']),
                 ('torque_saturation', side, t['current']**3),
                 ('current_sensor_offset', 'current', np.ones(len(way)))]
    return rows


_FRICTION = ('coulomb_friction', 'viscous_friction', 'quadratic_drag', 'stribeck_friction',
             'load_dependent_friction')


def _richest(library, target, table, balance) -> dict:
    terms = [key for key in library if key[0] in _FRICTION]
    if not terms:
        return {}
    columns = np.array([library[key] for key in terms]).T
    size = np.sqrt(np.mean(columns**2, axis=0)) + 1e-30
    weights = nnls(columns / size, target)[0]
    level = VISIBLE * np.sqrt(np.mean(
        (table['torque'] if balance == 'load' else table['current'])**2))
    level = min(level, np.sqrt(np.mean(target**2)))
    return {key: w / s for key, w, s in zip(terms, weights, size, strict=True) if w > level}


def _stepwise(library, target, table, balance) -> dict:
    keys, n, chosen = list(library), len(target), []

    def bic(members):
        columns = np.array([library[k] for k in members]).T.reshape(n, len(members))
        weights = np.linalg.lstsq(columns, target, rcond=None)[0]
        left = np.mean((target - columns @ weights)**2) + 1e-300
        return n * np.log(left) + len(members) * np.log(n), weights

    best = n * np.log(np.mean(target**2) + 1e-300)
    while len(chosen) < MOST:
        tried = [(bic([*chosen, key])[0], i) for i, key in enumerate(keys) if key not in chosen]
        if not tried or min(tried)[0] >= best:
            break
        best, at = min(tried)
        chosen.append(keys[at])
    return dict(zip(chosen, bic(chosen)[1], strict=True)) if chosen else {}


def _thresholded(library, target, table, balance) -> dict:
    keys = list(library)
    size = np.array([np.sqrt(np.mean(library[k]**2)) + 1e-30 for k in keys])
    columns = np.array([library[k] for k in keys]).T / size
    limit, kept = THRESHOLD * np.sqrt(np.mean(target**2)), np.ones(len(keys), bool)
    weights = np.zeros(len(keys))
    for _ in range(10):
        weights[:] = 0.0
        if kept.any():
            weights[kept] = np.linalg.lstsq(columns[:, kept], target, rcond=None)[0]
        if np.array_equal(kept, np.abs(weights) > limit):
            break
        kept = np.abs(weights) > limit
    return {k: w / s for k, w, s in zip(keys, weights, size, strict=True) if w}


def _network(fit: Table, target: np.ndarray, test: Table) -> np.ndarray:
    from sklearn.neural_network import MLPRegressor

    def features(t: Table) -> np.ndarray:
        return np.array([np.cos(t['load']), np.sin(t['load']), np.cos(t['motor']),
                         np.sin(t['motor']), t['w_load'], t['a_load'], t['torque'], t['current'],
                         t['command'], np.sign(t['w_load'])]).T

    columns, size = features(fit), np.sqrt(np.mean(target**2)) + 1e-30
    middle, spread = columns.mean(axis=0), columns.std(axis=0) + 1e-12
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # that it might have been trained for longer
        network = MLPRegressor(hidden_layer_sizes=(24, 24), early_stopping=True, max_iter=60,
                               random_state=1)
        network.fit((columns - middle) / spread, target / size)
    return size * network.predict((features(test) - middle) / spread)


def _shrink(before: np.ndarray, after: np.ndarray) -> float:
    return float(1.0 - _rms(after) / (_rms(before) + 1e-300))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
