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

import numpy as np

from .drive_reach import Reach
from .servo import Servo, ServoError
from .servo_parts import DigitalDrive
from .swinging import Swinging, swinging

_ROUNDING = 1e-6  # by which the free turning of a machine seems to grow, as its roots are found


def check_step(servo: Servo) -> None:
    """
    Raise ServoError for a servo whose step is too long for it, with the step that would do.

    Judged are the mechanism with the effects of transmission and shafts, the winding of the drive,
    and what its command and current lose with the motor speed. So is the cycle of a drive with
    loops of its own. Each law is judged where it is steepest up to the torque, current and speed
    that the limits of drive and controller leave. Where nothing limits them, it is judged at rest
    and along its curve. Not judged are learned effects, jumps of a law, errors of the teeth of a
    ball screw, controllers, and an FMU, which has a step of its own.
    """
    if issubclass(servo.drive, DigitalDrive):
        cycle = servo.number('drive.current_cycle')
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
    most = Reach(servo).current
    pushed = (f' at up to {most:.3g} A, which the limits of drive and controller allow'
              if longest < 0.99 * longest_step(servo, pushed=False) else '')
    raise ServoError(f'step = {servo.step:g} s is too long for the springs and dampers of this '
                     f'machine{pushed}: beyond {longest:.3g} s they make motion that is not '
                     f'there. Give at most {_round_below(longest / 2.0):g} s, or less stiffness '
                     f'and damping' + doubt_of_ratio(servo))


def doubt_of_ratio(servo: Servo) -> str:
    """Ask behind a sentence whether a ratio below 1 is the other way round; '' of others."""
    ratio = servo.number('mechanism.ratio')
    if servo.linear or ratio >= 1.0:
        return ''
    return (f'; mechanism.ratio = {ratio:g} is turns of the motor for one of the load: is it '
            f'{1.0 / ratio:.4g}?')


def step_within(servo: Servo, usual: float) -> float:
    """Return the usual step, s, or the longest of one digit that a servo bears with a margin."""
    if issubclass(servo.drive, DigitalDrive):
        usual = min(usual, servo.number('drive.current_cycle'))
    longest = longest_step(servo)
    return usual if usual <= longest else _round_below(longest / 2.0)


def longest_step(servo: Servo, pushed: bool = True) -> float:
    """
    Return the longest step, s, with which a machine left alone gains no motion; may be inf.

    Not ``pushed``: as if nothing limited the drive, so that it is judged at rest.
    """
    machine = swinging(servo, pushed)
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
