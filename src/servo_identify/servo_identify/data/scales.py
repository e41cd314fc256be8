r"""
Units, scales and signs of a recording, held against the servo file by two equations.

The motor's torque against what turns, both at the motor's shaft,

.. math:: K_t i = J \ddot\theta + b\,\omega + c\,\mathrm{sgn}\,\omega + a_0 + a_1 \cos\theta_l
          + a_2 \sin\theta_l

where the inertia is found by least squares and held against that of the servo file; and the
current against what the drive makes of the command. Both are smoothed by one Gaussian, which
leaves linear equations as they are. A factor is named only where it is that of a known mistake.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np
from scipy.ndimage import gaussian_filter1d

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .finding import Finding
from .sensor_scales import sensor_findings

WIDTHS = (3.0, 8.0, 20.0, 50.0)
"""Standard deviations of the Gaussian that are tried, samples."""
NEAR = 0.25  # relative distance within which a factor is taken for a known one
MISFIT, FIT = 0.5, 0.1  # share of a current's square left: the drive is wrong, is right
SHARE = 0.3  # of the torque that acceleration must explain before its inertia is believed
MOST = 20_000  # samples that are looked at: the first ones

INERTIA_MISTAKES = {
    pi / 180.0: ('a factor of 57.3 on the angle closes {closed:.0f} %: the angle is in degrees?',
                 'give its unit in the header or the mapping: motor_position [deg]'),
    1e6: ('a factor of 1000 on the time closes {closed:.0f} %: the time is in milliseconds?',
          'give its unit in the header or the mapping: t [ms]'),
    1e-6: ('a factor of 0.001 on the time closes {closed:.0f} %: the time is too short by 1000?',
           'compare the duration of the recording with a clock'),
    1e3: ('a factor of 0.001 on the current or the command closes {closed:.0f} %: it is in mA '
          'or mV?', 'give its unit in the header or the mapping: current [mA]'),
    1e-3: ('a factor of 1000 on the current or the command, or 0.001 on the angle, closes '
           '{closed:.0f} %', 'compare the units of current, command and angle with the drive'),
}
"""Found over true inertia where a unit is mistaken: what is said, what to do."""

CURRENT_MISTAKES = {
    1e3: ('a factor of 0.001 on the current closes {closed:.0f} %: it is in mA?',
          'give its unit in the header or the mapping: current [mA]'),
    1e-3: ('a factor of 0.001 on the command closes {closed:.0f} %: it is in mV?',
           'give its unit in the header or the mapping: voltage [mV]'),
    -1.0: ('current and command have opposite signs',
           'turn the sign of one of them in the mapping: scale: -1'),
}
"""Recorded over expected current where a unit is mistaken."""


@dataclass(frozen=True)
class Smoothed:
    """Channels of a recording under one Gaussian, at the motor; arrays of shape (samples,)."""

    angle: np.ndarray  # rad, at the load
    speed: np.ndarray  # rad/s, at the motor
    acceleration: np.ndarray  # rad/s2, at the motor
    sign: np.ndarray
    command: np.ndarray  # V
    current: np.ndarray  # A, NaN where not measured
    pushed: np.ndarray  # N m, external, at the motor
    width: float  # samples


def smoothed(one: Recording, servo: Servo, width: float) -> Smoothed | None:
    """Return channels under a Gaussian of ``width`` samples; None without an angle."""
    ratio = servo.values['mechanism.ratio']
    name = 'motor_position' if one.has('motor_position') else 'load_position'
    if not one.has(name):
        return None
    driven = 'current' if one.has('current') else 'voltage'  # NaN while the drive is off
    known = np.isfinite(one[name][:MOST]) & np.isfinite(one[driven][:MOST])
    angle = _bridged(one[name][:MOST]) * (1.0 if name == 'motor_position' else ratio)

    def through(values: np.ndarray, order: int = 0) -> np.ndarray:
        return gaussian_filter1d(values, width, order=order) / one.period**order

    speed = through(angle, 1)
    pushed = np.nan_to_num(one['external_torque'][:MOST]) / ratio
    kept = slice(int(4 * width), max(len(angle) - int(4 * width), 0))
    whole = gaussian_filter1d(known.astype(float), width)[kept] > 0.99
    columns = (through(angle) / ratio, speed, through(angle, 2), through(np.sign(speed)),
               through(_bridged(one['voltage'][:MOST])), through(_bridged(one['current'][:MOST])),
               through(pushed))
    return Smoothed(*(column[kept][whole] for column in columns), width)


def expected_current(servo: Servo, at: Smoothed) -> np.ndarray | None:
    """Return the current (A) that the drive makes of the command, or None where none is told."""
    values, kind = servo.values, servo.drive.name
    if kind == 'current_drive':
        return values['drive.gain'] * at.command
    if kind == 'voltage_drive':
        return (values['drive.gain'] * at.command
                - values['drive.back_emf'] * at.speed) / values['drive.resistance']
    if kind == 'current_amplifier':
        limit = values['drive.current_limit']
        return np.clip(values['drive.gain'] * at.command, -limit, limit)
    return None


def inertia_of(servo: Servo) -> float:
    """Return the whole inertia at the motor's shaft, kg m2."""
    values = servo.values
    own = sum(values.get(f'mechanism.{name}_inertia', 0.0)
              for name in ('rotor', 'coupling', 'screw'))
    return own + values['mechanism.load_inertia'] / values['mechanism.ratio']**2


@dataclass(frozen=True)
class Balance:
    """The torque balance: found inertia over that of the file, and shares of the torque."""

    inertia: float
    share: dict[str, float]  # of the torque that is left without each term, that it explains


def torque_balance(one: Recording, servo: Servo) -> Balance | None:
    """Return the balance under the Gaussian that shows the inertia best; None without torque."""
    best = None
    for width in WIDTHS:
        at = smoothed(one, servo, width)
        if at is None or len(at.speed) < 20 * width or not np.ptp(at.speed) > 0.0:
            continue
        current = at.current if np.isfinite(at.current).all() else expected_current(servo, at)
        if current is None or not np.isfinite(current).all():
            continue
        torque = servo.values['drive.torque_constant'] * current + at.pushed
        terms = {'inertia': at.acceleration, 'viscous friction': at.speed,
                 'Coulomb friction': at.sign, 'offset': np.ones_like(at.speed)}
        if not servo.linear:
            terms |= {'cosine': np.cos(at.angle), 'sine': np.sin(at.angle)}
        matrix = np.stack(list(terms.values()), 1)
        scale = np.linalg.norm(matrix, axis=0)
        matrix, scale = matrix[:, scale > 0.0], scale[scale > 0.0]
        names = [name for name, column in terms.items() if np.any(column)]
        found = np.linalg.lstsq(matrix / scale, torque, rcond=1e-9)[0] / scale
        left = float(np.sum((torque - matrix @ found)**2))
        share = {}
        for k, name in enumerate(names[:3]):
            rest = np.delete(matrix / scale, k, 1)
            without = torque - rest @ np.linalg.lstsq(rest, torque, rcond=1e-9)[0]
            total = float(np.sum(without**2))
            share[name] = 1.0 - left / total if total > 0.0 else 0.0
        balance = Balance(float(found[0]) / max(inertia_of(servo), 1e-30), share)
        if best is None or balance.share.get('inertia', 0.0) > best.share.get('inertia', 0.0):
            best = balance
    return best


def scale_findings(recordings: Sequence[Recording], servo: Servo) -> list[Finding]:
    """
    Return what units, scales and signs look wrong; none where all is well.

    A slow recording can show the stiffness of a friction or a spring for an inertia. So what one
    says of the inertia stops nothing where another one, in which inertia explains more of the
    torque, bears the servo file out.
    """
    found = [one for recording in recordings for one in _current_findings(recording, servo)]
    if found or not inertia_of(servo) > 0.0:
        return found
    balances = [torque_balance(recording, servo) for recording in recordings]
    borne_out = max((one.share['inertia'] for one in balances
                     if one and believed(one) and 0.5 < one.inertia < 2.0), default=0.0)
    for recording, balance in zip(recordings, balances, strict=True):
        if balance is not None:
            more = _inertia_findings(recording, balance, servo)
            weak = balance.share.get('inertia', 0.0) < borne_out
            found += ([replace(one, level='amber') for one in more if one.level == 'red'] if weak
                      else more)
    if not any(one.level == 'red' for one in found):  # those would be blamed on sensors too
        found += [one for recording in recordings for one in sensor_findings(recording, servo)]
    return found


def _inertia_findings(one: Recording, balance: Balance, servo: Servo) -> list[Finding]:
    plain = believed(balance) and 0.25 < balance.inertia < 4.0
    if not plain and not one.has('current'):
        for rescaled, (sentence, action) in _rescaled(one):
            other = torque_balance(rescaled, servo)
            if other and believed(other) and 0.5 < other.inertia < 2.0:
                return [Finding('red', f'{one.name}: {sentence}', action)]
    if not believed(balance):
        return []
    if balance.inertia < 0.0:
        return [Finding('red', f'{one.name}: the motor accelerates against its torque: command or '
                        'current and the angle have opposite signs',
                        'turn the sign of one of them in the mapping: scale: -1')]
    found = _known(one.name, balance.inertia, INERTIA_MISTAKES)
    if found:
        return [found]
    if not 0.25 < balance.inertia < 4.0:
        ratio = servo.values['mechanism.ratio']
        other = ratio > 3.0 and any(abs(np.log(balance.inertia / factor)) < NEAR
                                    for factor in (ratio, 1.0 / ratio))
        return [Finding('amber', f'{one.name}: the recording shows {balance.inertia:.3g} times '
                        'the inertia of the servo file' + (
                            f', near the ratio of {ratio:g}: is the angle that of the other shaft?'
                            if other else ''),
                        'look at inertias, ratio, torque constant, and at the units of command '
                        'and angle')]
    return []


def believed(balance: Balance) -> bool:
    """Tell whether acceleration explains enough of the torque for its inertia to mean much."""
    return balance.share.get('inertia', 0.0) >= SHARE


def _rescaled(one: Recording) -> Iterator[tuple[Recording, tuple[str, str]]]:
    """Yield the recording in other units: back EMF needs the speed, not its factor."""
    angles = {name: one[name] * pi / 180.0 for name in ('motor_position', 'load_position')}
    yield (replace(one, columns={**one.columns, **angles}),
           ('only with an angle that is 57.3 times smaller does the inertia of the servo file '
            'fit: degrees?', 'give its unit in the header or the mapping: motor_position [deg]'))
    yield (replace(one, period=1e-3 * one.period),
           ('only with a time that is 1000 times shorter does the inertia of the servo file fit: '
            'milliseconds?', 'give its unit in the header or the mapping: t [ms]'))


def _current_findings(one: Recording, servo: Servo) -> list[Finding]:
    at = smoothed(one, servo, WIDTHS[1])
    if at is None or len(at.speed) < 100 or not np.isfinite(at.current).all():
        return []
    expected = expected_current(servo, at)
    if expected is None or not np.isfinite(expected).all():
        return []
    error = _error(at.current, expected)
    swapped = Smoothed(**{**vars(at), 'command': at.current, 'current': at.command})
    would = expected_current(servo, swapped)
    if error > MISFIT and _error(swapped.current, would) < FIT:
        return [Finding('red', f'{one.name}: voltage and current look swapped: the drive makes '
                        'the recorded "voltage" of the recorded "current"',
                        'swap the two columns in the mapping')]
    slope = float(expected @ at.current / max(expected @ expected, 1e-300))
    if abs(np.corrcoef(expected, at.current)[0, 1]) > 0.9 if np.ptp(expected) else False:
        found = _known(one.name, slope, CURRENT_MISTAKES)
        if found:
            return [found]
        if not 0.4 < slope < 2.5:
            return [Finding('amber', f'{one.name}: the current is {slope:.3g} times what the '
                            'drive of the servo file makes of the command',
                            'look at the gain of the drive, its resistance and the units')]
    if servo.drive.name == 'voltage_drive' and error > MISFIT:
        return _speed_findings(one.name, servo, at, error)
    return []


def _speed_findings(name: str, servo: Servo, at: Smoothed, error: float) -> list[Finding]:
    """Try known factors on the speed in the voltage balance, where it does not close."""
    ratio = servo.values['mechanism.ratio']
    shaft = ('the angle is that of the other shaft?',
             'map it to load_position or motor_position, the shaft that its encoder sits on')
    known = {pi / 180.0: ('a factor of 57.3 on the angle', 'the angle is in degrees?',
                          'give its unit in the header or the mapping: motor_position [deg]')}
    if ratio > 3.0:
        known |= {ratio: (f'the ratio of {ratio:g} on the angle', *shaft),
                  1.0 / ratio: (f'a factor of 1/{ratio:g} on the angle', *shaft)}
    left = {factor: _error(at.current, expected_current(servo, replace(
        at, speed=factor * at.speed))) for factor in known}
    best = min(left, key=lambda factor: left[factor])
    if left[best] >= FIT:
        return []
    what, question, action = known[best]
    return [Finding('red', f'{name}: {what} closes {100 - 100 * left[best] / error:.0f} % of the '
                    f'voltage balance: {question}', action)]


def _error(seen: np.ndarray, told: np.ndarray) -> float:
    """Return the squared error over the square of what is seen."""
    return float(np.sum((seen - told)**2) / max(float(np.sum(seen**2)), 1e-300))


def _known(name: str, factor: float, mistakes: dict[float, tuple[str, str]]) -> Finding | None:
    for known, (sentence, action) in mistakes.items():
        if factor / known > 0.0 and abs(np.log(factor / known)) < NEAR:
            closed = 100.0 * (1.0 - abs(factor / known - 1.0) / max(abs(factor - 1.0), 1e-9))
            return Finding('red', f'{name}: {sentence.format(closed=closed)}', action)
    return None


def _bridged(values: np.ndarray) -> np.ndarray:
    """Return a channel with straight lines over what is missing; NaN where nothing is known."""
    known = np.isfinite(values)
    if known.all() or not known.any():
        return values
    rows = np.arange(len(values))
    return np.interp(rows, rows[known], values[known])
