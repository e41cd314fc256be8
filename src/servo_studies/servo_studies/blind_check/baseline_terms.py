"""What a servo file leaves of each balance, and the terms that could explain it."""

from __future__ import annotations

import numpy as np
from scipy.signal import savgol_filter

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

WINDOW, EVERY = 41, 10  # samples of the smoother, and of which one is kept
BALANCES = ('drive', 'motor', 'load', 'transmission')
Table = dict[str, np.ndarray]


def motion_of(recording: Recording, servo: Servo) -> Table:
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


def joined(tables: list[Table]) -> Table:
    """Return the tables of several recordings as one."""
    return {name: np.concatenate([t[name] for t in tables]) for name in tables[0]}


def _way(table: Table, side: str) -> np.ndarray:
    speed = table[f'w_{side}']
    return np.tanh(speed / (0.01 * np.percentile(np.abs(speed), 98) + 1e-12))


def _levels(servo: Servo, effect: str, site: str) -> float:
    return sum(servo.values[f'effects.{p.name}.{name}'] for p in servo.effects
               if p.effect.name == effect and p.site == site
               for name in ('level', 'slope', 'width') if name in p.effect.parameters)


def leftover(t: Table, servo: Servo, balance: str) -> np.ndarray:
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


def tolerances(t: Table, servo: Servo, balance: str) -> tuple[np.ndarray, np.ndarray]:
    """What tolerances can move in a balance, one column each, and the bounds of each."""
    columns = []
    nominal = leftover(t, servo, balance)
    for path, (low, high) in servo.tolerance.items():
        moved = servo.with_values({path: high})
        change = leftover(t, moved, balance) - nominal
        if np.any(change):
            columns.append((change, (servo.values[path] - low) / (high - servo.values[path])))
    table = np.array([c for c, _ in columns]).T.reshape(len(nominal), len(columns))
    return table, np.array([down for _, down in columns])


def library_of(t: Table, servo: Servo, balance: str) -> dict[tuple[str, str, int], np.ndarray]:
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
