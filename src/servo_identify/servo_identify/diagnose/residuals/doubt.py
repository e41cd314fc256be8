"""What a residual may be off beside noise: counts of an encoder, a sign not known, a far shaft."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import correlate1d, maximum_filter1d

from ..decisions import FORM
from .equation_errors import EquationErrors
from .loop_output import untold
from .motion import bridged
from .test_function import taps

WITHIN = 0.25  # s by which the rig may swing earlier or later
SURE = 2.0  # times a gap that a shaft must travel to be through it
TEETH = 24  # harmonics of the sawtooth of rounding that are looked at
DECIDED = 0.98  # share of a test function under which the teeth must be on one flank


def doubt_about(one: EquationErrors, equation: str) -> tuple[np.ndarray, np.ndarray]:
    """
    Return (doubt at each centre in the unit of the equation, centres that say something).

    Rounding to counts is no noise that a longer recording would reduce where a shaft creeps. With
    one encoder the other shaft is where the twin has it. A motor that answers a step of its
    voltage within a row does what no row shows, and so does a controller whose loop is quicker
    than the rows. While the teeth pass from flank to flank the torque does not tell where they
    are.
    """
    doubt = np.hypot(_rounding(one, equation), _within_row(one, equation))
    tells = np.ones(len(doubt), dtype=bool)
    if equation == 'controller':
        return one.test(equation).project(untold(
            one.servo, one.measured, one.angles(), one.integral)), tells
    if equation in ('torque', 'motor', 'load'):
        rises, silent = _before_start(one, equation)
        doubt = np.hypot(np.hypot(doubt, rises), _swing(one, equation))
        return doubt, ~(_crossing_gap(one, equation) | silent)
    if equation != 'transmission':
        return doubt, tells
    motion, test, measured = one.gear_motion, one.measured.gear, one.measured
    if one.servo.mechanism.compliant:
        flank = np.full(len(measured.recording), np.nan)
        inner = slice(motion.test.reach, motion.test.reach + len(motion.rows))
        flank[inner] = one.flank(motion)
        tells = np.abs(np.nan_to_num(test.project(flank))) > DECIDED
    return doubt, tells


def _rounding(one: EquationErrors, equation: str) -> np.ndarray:
    """
    Return what rounding to counts does to a residual at its centres.

    At speed it is noise. A shaft that creeps is off by a sawtooth, one tooth a count, whose
    harmonics pass the test function.
    """
    measured, test, motion = one.measured, one.test(equation), one.motion_of(equation)
    total = np.zeros(len(one.times(equation)))
    if equation in ('drive', 'controller'):
        return total
    at = test.centres(len(measured.recording)) - motion.test.reach
    at = np.clip(at, 0, len(motion.rows) - 1)
    spacing = test.spacing * test.period
    terms = one.terms[equation]
    for shaft in ('motor', 'load'):
        name = f'{shaft}_position'
        count = measured.counts[name]
        factors = [(t.order, t.factor) for t in terms for s in [t.signal] if s == name]
        if not count or not factors:
            continue
        rate = np.abs(motion[f'{shaft}_speed'][at]) / count
        for k in range(1, TEETH + 1):
            turn = 2.0 * np.pi * k * rate
            passed = np.sinc(k * rate * spacing) ** 6
            gain = sum(factor * turn**order for order, factor in factors if order != 1)
            total += 0.5 * (count / (np.pi * k) * gain * passed) ** 2
    return np.sqrt(total)


def _before_start(one: EquationErrors, equation: str) -> tuple[np.ndarray, np.ndarray]:
    """
    Return (by how much the torque still rises until a shaft breaks away, N m, what says nothing).

    Both at the centres. Friction at rest is what holds at the last instant; the window before it
    shows a mean, which is less. So it says something only where the shaft holds more than the file
    has. Where a command jumps, the rows beside that instant do not tell what it was; nor does a
    late reading.
    """
    measured, test = one.measured, one.test(equation)
    centres = test.centres(len(measured.recording))
    doubt, silent = np.zeros(len(centres)), np.zeros(len(centres), dtype=bool)
    if not one.motion.breakaways:
        return doubt, silent
    torque = np.zeros(len(measured.recording))
    for term in one.terms[equation]:
        if term.signal == 'current' and 'current' not in measured.channels:
            torque = torque + term.factor * one.drive_current(one.servo.theta)
        elif term.signal in ('current', 'torque'):
            torque = torque + term.factor * bridged(measured.recording[term.signal])
    torque = np.nan_to_num(torque)
    shown = correlate1d(torque, taps(test.spacing, 0), mode='nearest')
    rubs = one.of_signal('load_torque' if equation == 'load' else 'motor_torque',
                         -one.motion.direction)[equation]
    less = rubs * one.nominal[equation] >= 0.0
    for start in one.motion.breakaways:
        there = centres == start.centre
        at = start.start + 1
        last, then = torque[at - test.spacing:at], torque[at:at + test.spacing]
        rises = max(abs(some.mean() - shown[start.centre]) for some in (last, then))
        doubt[there] = rises
        silent |= there & less
    return doubt, silent


def _within_row(one: EquationErrors, equation: str) -> np.ndarray:
    r"""
    Return what rows do not show of a motor that answers within one, at the centres.

    A step of the voltage by U makes the current jump by U/R and fade as the motor speeds up. With
    x = period R^-1 K_m K_e / J the mean of a row lies from its first value by

    .. math:: U/R\,(1 - (1 - e^{-x})/x)

    and the speed at its end from the mean of its neighbours by half of U/K_e times

    .. math:: 1 - e^{-x} - x\,e^{-x}
    """
    total, values = np.zeros(len(one.times(equation))), one.servo.numbers
    parts = [values.get(f'drive.{name}', 0.0) for name in (
        'resistance', 'back_emf', 'torque_constant')]
    factor = sum(abs(term.factor) for term in one.terms.get(equation, ())
                 if term.signal == ('drive_current' if equation == 'drive' else 'current'))
    if not all(parts) or values.get('drive.proportional') or not factor:
        return total
    resistance, back_emf, constant = parts
    inertia = values.get('mechanism.rotor_inertia', 0.0)
    if not one.servo.mechanism.compliant:
        inertia += values['mechanism.load_inertia'] / values['mechanism.ratio'] ** 2
    if not inertia > 0.0:
        return total
    x = one.measured.period * constant * back_emf / (resistance * inertia)
    share = 0.5 * (1.0 - np.exp(-x) - x * np.exp(-x)) if equation == 'drive' else (
        1.0 - (1.0 - np.exp(-x)) / x)
    steps = np.diff(one.measured.column('voltage', 0.0), prepend=0.0) / resistance
    square = one.test(equation).project(np.nan_to_num(steps * share) ** 2)
    return factor * np.sqrt(np.maximum(square, 0.0))


def _crossing_gap(one: EquationErrors, equation: str) -> np.ndarray:
    """Tell at the centres where a shaft that is not measured may be in a gap of the teeth."""
    measured, test = one.measured, one.measured.shafts
    widths = [one.servo.numbers.get(f'effects.{p.name}.width', 0.0) for p in one.servo.effects
              if p.effect.port == 'clearance']
    both = {'motor_position', 'load_position'} <= measured.channels
    near = np.zeros(len(measured.recording))
    if both or not widths or equation != 'torque':
        return np.zeros(len(one.times(equation)), dtype=bool)
    inner = slice(test.reach, test.reach + len(one.motion.rows))
    near[inner] = one.motion.travel < SURE * sum(widths)
    return test.project(near) > 1.0 - DECIDED


def _swing(one: EquationErrors, equation: str) -> np.ndarray:
    """Return at the centres how far a torque may be off by a shaft that is not measured, N m."""
    measured, values = one.measured, one.servo.numbers
    test, ratio = measured.shafts, values['mechanism.ratio']
    unseen = 'load' if 'motor_position' in measured.channels else 'motor'
    if not measured.twist.any() or equation not in ('torque', unseen):
        return np.zeros(len(one.times(equation)))
    inertia = values['mechanism.load_inertia'] if unseen == 'load' else (
        values['mechanism.rotor_inertia'] * (ratio if equation == 'motor' else ratio**2))
    torque = np.abs(inertia * test.project(measured.twist, 2))
    apart = round(0.5 * WITHIN / (test.stride * test.period))
    return FORM * maximum_filter1d(torque, 1 + 2 * apart)
