r"""
How long a step the springs and dampers of a machine bear.

The step is semi-implicit Euler. Of inertias M joined by springs K and dampers D it makes

.. math:: v^+ = v - h M^{-1} (K x + D v), \quad x^+ = x + h v^+

which grows without end once h is beyond 2 / (highest natural frequency), or less where dampers
pull. Before that its resonance is too fast: by 4.7 % where h times the frequency is 1, and by 57 %
at the edge. Friction takes from the speed at most what there is, so it makes no swing. Where it
rises with the speed by b, it stops a shaft of inertia J each other step if h b > J, and the shaft
creeps at a speed that the step makes.
Source: Hairer, Lubich, Wanner: Geometric Numerical Integration, 2006, sec. I.1.2 and I.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .drives import winding
from .servo import Servo, ServoError
from .servo_parts import DigitalDrive
from .slopes_at_rest import acts_at, fall, rise, slopes, values_of

_ROUNDING = 1e-6  # by which the free turning of a machine seems to grow, as its roots are found


@dataclass(frozen=True)
class Swinging:
    """
    A machine near rest, the motor first.

    ``inertias`` (n,), ``springs`` and ``dampers`` (n, n), in SI units. ``winding`` is resistance,
    ohm, inductance, H, back-EMF, V s/rad, and torque constant, N m/A; None where a drive sets the
    current whatever the motor does.
    """

    inertias: np.ndarray
    springs: np.ndarray
    dampers: np.ndarray
    winding: tuple[float, float, float, float] | None
    rising: np.ndarray
    """Slopes of friction by the speed of its shaft, N m s/rad, (n,)."""


def check_step(servo: Servo) -> None:
    """
    Raise ServoError for a servo whose step is too long for it, with the step that would do.

    Judged are the mechanism at rest with the effects of transmission and shafts, the winding of
    the drive, what its command and current lose with the motor speed, and the cycle of a drive
    with loops of its own. Not judged are errors and ripple that go with a torque or a current,
    learned effects, curves away from rest, controllers, and an FMU, which has a step of its own.
    """
    if issubclass(servo.drive, DigitalDrive):
        cycle = number(servo, 'drive.current_cycle')
        if servo.step > cycle * (1.0 + _ROUNDING):
            raise ServoError(f'step = {servo.step:g} s is longer than drive.current_cycle = '
                             f'{cycle:g} s, at which the current loops run; give at most '
                             f'{cycle:g} s')
    machine = swinging(servo)
    if machine is None:
        return
    if not (machine.inertias > 0.0).all():
        if any(placed.effect.port == 'inertia' for placed in servo.effects):
            return  # what it carries is known while it runs
        raise ServoError('mechanism.rotor_inertia and mechanism.load_inertia are both zero; give '
                         'one of them, nothing without inertia can be moved')
    if _bears(machine, servo.step):
        return
    longest = longest_step(servo)
    raise ServoError(f'step = {servo.step:g} s is too long for the springs and dampers of this '
                     f'machine: beyond {longest:.3g} s they make motion that is not there. Give '
                     f'at most {_round_below(longest / 2.0):g} s, or less stiffness and damping'
                     + doubt_of_ratio(servo))


def doubt_of_ratio(servo: Servo) -> str:
    """Ask behind a sentence whether a ratio below 1 is the other way round; '' of others."""
    ratio = number(servo, 'mechanism.ratio')
    if servo.linear or ratio >= 1.0:
        return ''
    return (f'; mechanism.ratio = {ratio:g} is turns of the motor for one of the load: is it '
            f'{1.0 / ratio:.4g}?')


def step_within(servo: Servo, usual: float) -> float:
    """Return the usual step, s, or the longest of one digit that a servo bears with a margin."""
    if issubclass(servo.drive, DigitalDrive):
        usual = min(usual, number(servo, 'drive.current_cycle'))
    longest = longest_step(servo)
    return usual if usual <= longest else _round_below(longest / 2.0)


def longest_step(servo: Servo) -> float:
    """Return the longest step, s, with which a machine left alone gains no motion; may be inf."""
    machine = swinging(servo)
    low, high = 1e-15, 1e3
    if machine is None or not (machine.inertias > 0.0).all() or _bears(machine, high):
        return np.inf
    while high > low * (1.0 + 1e-9):
        middle = float(np.sqrt(low * high))
        if _bears(machine, middle):
            low = middle
        else:
            high = middle
    return low


def swinging(servo: Servo) -> Swinging | None:
    """Return a machine near rest, or None for a mechanism that does not say what it is."""
    values = {path.partition('.')[2]: value for path, value in servo.values.items()
              if path.startswith('mechanism.')}
    at_mesh = [slopes(servo, p, 'angle', 'rate') for p in servo.effects
               if acts_at(p, 'mesh', 'mesh')]
    parts = servo.mechanism.springs(values, *(sum(one) for one in zip((0.0, 0.0), *at_mesh,
                                                                      strict=True)))
    if parts is None:
        return None
    inertias, springs, dampers = (np.array(part, dtype=float) for part in parts)
    last, rising = len(inertias) - 1, np.zeros(len(inertias))
    turns = 1.0 / number(servo, 'mechanism.ratio') if last == 0 else 1.0  # one shaft for both
    for placed in servo.effects:
        for site, shaft, lever in (('motor', 0, 1.0), ('load', last, turns)):
            if acts_at(placed, 'torque', site):
                stiffer, denser = slopes(servo, placed, 'angle', 'speed')
                springs[shaft, shaft] += max(0.0, -stiffer) * lever**2
                dampers[shaft, shaft] += max(0.0, -denser) * lever**2
            if acts_at(placed, 'friction', site):
                rising[shaft] += max(0.0, rise(servo, placed)) * lever**2
        hanging = placed.effect.hangs(values_of(servo, placed))
        if hanging is not None:
            inertias, springs, dampers = _hung(inertias, springs, dampers, turns, *hanging)
            rising = np.append(rising, 0.0)
    coil = _coil(servo, dampers)
    return Swinging(inertias, springs, dampers, coil, rising)


def _coil(servo: Servo, dampers: np.ndarray) -> tuple[float, float, float, float] | None:
    """
    Return the winding of a drive; None where the drive sets the current.

    A limit of the command or the current that falls with the motor speed damps the motor, as a
    back EMF does: it is added to the back EMF, or to ``dampers``.
    """
    values = {path: value for path, value in servo.values.items() if not isinstance(value, tuple)}
    gain, resistance = winding(values)
    constant = values.get('drive.torque_constant', 0.0)
    falls = {site: sum(fall(servo, placed) for placed in servo.effects
                       if acts_at(placed, 'drive', site)) for site in ('command', 'current')}
    dampers[0, 0] += constant * falls['current']
    by_command = max(0.0, gain) * falls['command']
    own = [values.get(f'drive.{name}') for name in ('resistance', 'inductance', 'back_emf')]
    if None in own:
        dampers[0, 0] += constant * by_command
        return None
    alone, inductance, back_emf = (float(one) for one in own if one is not None)
    return resistance if by_command else alone, inductance, back_emf + by_command, constant


def number(servo: Servo, path: str) -> float:
    """Return a value of a servo that is no row."""
    value = servo.values[path]
    assert not isinstance(value, tuple)
    return value


def _hung(inertias: np.ndarray, springs: np.ndarray, dampers: np.ndarray, turns: float,
          inertia: float, spring: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a machine with one more inertia (kg m2) that hangs on its load by a spring."""
    size = len(inertias)
    wider = np.zeros((2, size + 1, size + 1))
    wider[:, :size, :size] = springs, dampers
    hold = np.zeros(size + 1)
    hold[size - 1], hold[size] = turns, -1.0
    return np.append(inertias, inertia), wider[0] + spring * np.outer(hold, hold), wider[1]


def _bears(machine: Swinging, h: float) -> bool:
    """Whether a step of h makes neither swing nor creep."""
    return bool((h * machine.rising <= machine.inertias).all()
                and _growth(machine, h) <= 1.0 + _ROUNDING)


def _growth(machine: Swinging, h: float) -> float:
    """Return by how much a step of h multiplies the swing that it multiplies most."""
    root = np.sqrt(machine.inertias)
    size, scale = len(root), np.outer(root, root)
    pull, drag = machine.springs / scale, machine.dampers / scale  # by coordinates of inertia 1
    step = np.zeros((2 * size + 1, 2 * size + 1))  # of x, h v and the current
    x, v, i = slice(0, size), slice(size, 2 * size), 2 * size
    step[v, x], step[v, v] = -h * h * pull, np.eye(size) - h * drag
    if machine.winding is not None:
        resistance, inductance, back_emf, constant = machine.winding
        stiff = inductance + h * resistance
        step[i, i], step[i, size] = inductance / stiff, -back_emf / (stiff * root[0])
        step[size] += h * h * constant / root[0] * step[i]
    step[x] = step[v]
    step[x, x] += np.eye(size)
    if not np.isfinite(step).all():
        return np.inf
    return float(np.abs(np.linalg.eigvals(step)).max())


def _round_below(value: float) -> float:
    """Return the largest number of one digit that is not above a value."""
    unit = 10.0 ** np.floor(np.log10(value))
    return float(f'{np.floor(value / unit * (1.0 + 1e-12)) * unit:.0e}')
