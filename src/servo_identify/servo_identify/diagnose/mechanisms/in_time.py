"""
A torque from outside that repeats in time: of the next joint, a pump, a machine on the same base.

It has a phase of its own in each recording. No effect of a twin can hold it; measured, it is a
column of the recordings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from scipy.optimize import minimize_scalar

from servo_twin.balances.equation_terms import EQUATIONS
from servo_twin.physics.servo import Servo

from ..decisions import EVEN, WORTH
from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .by_recording import apart
from .hypothesis import EXTERNAL, Hypothesis, Mechanism
from .orders import FEWEST, LARGEST_ORDER, periodogram, waves

PERIODS = 3.0  # that a recording must hold
PARTS, MOST_PARTS = 4, 256  # frequencies tried within what a recording tells apart
BAND = 0.45  # of the rate of the test function, above which it passes too little
MULTIPLES = 3  # of the lowest frequency
CAUSES = ('load_speed', 'load_acceleration', 'load_angle', 'direction')


def in_time(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """
    Yield the hypotheses of a torque at the load that repeats in time.

    ``residual`` (samples,) tells its frequency, the same in all recordings. What the motion does
    at that frequency may have made the residual too: it must be such a wave more than any part of
    the motion is.
    """
    samples = builder.samples
    equation = 'load' if 'load' in samples.present else 'torque'
    if equation not in samples.present or any(
            np.ptp(one.motion['external']) > 0.0 for one in samples.errors):  # it is measured
        return
    rows = samples.equation == EQUATIONS.index(equation)
    of, time = samples.recording[rows], samples.of_motion(equation, 'time')
    each = [np.flatnonzero(of == number) for number in np.unique(of)]
    each = [at for at in each if len(at) > FEWEST]
    if not each:
        return
    target = residual[rows]
    top = BAND / max(one.motion.test.spacing * one.measured.period for one in samples.errors)
    tone, tried = _strongest(time, target, each, top)
    if not tone:
        return
    mechanism = Mechanism(EXTERNAL, 'torque', 'load', ('time',), 'even')
    causes = [samples.of_motion(equation, name) for name in CAUSES]
    for base, multiples in ((tone, 1), (tone, MULTIPLES), (0.5 * tone, MULTIPLES)):
        tones = tuple(base * k for k in range(1, multiples + 1))
        if _left(time, target, each, tones) > EVEN * min(
                _left(time, cause, each, tones) for cause in causes):
            continue
        columns = builder.place('load_torque', partial(apart, samples.errors, partial(
            _waving, tones)))
        knots = [tone for tone in tones for _ in range(2)] * len(samples.errors)
        one = builder.hypothesis(mechanism, columns, [0] * len(knots), knots, tried=tried,
                                 detail={'told': _told})
        if one:
            yield one


def same_swing(one: Hypothesis, other: Hypothesis, duration: float) -> bool:
    """
    Tell whether a torque that repeats in time is the swing of a payload, or the other way round.

    Set off before the recording, or so far that its period grows, a payload swings on by itself.
    ``duration`` (s) of a recording tells the two frequencies apart, or not.
    """
    waves_of, swings = (next((each for each in (one, other) if each.mechanism.name == name), None)
                        for name in (EXTERNAL, 'payload_resonance'))
    if waves_of is None or swings is None or 'time' not in waves_of.mechanism.variables:
        return False
    return bool(np.min(np.abs(np.subtract(waves_of.knots, swings.knots[0]))) * duration < 1.0)


def _told(knots: Sequence[float], amplitudes: np.ndarray, servo: Servo) -> str:
    """Return the amplitude of each tone, root mean square over the recordings, and its period."""
    of, unit = np.asarray(knots), servo.reads('N m', 'load')
    several = [(tone, float(np.sqrt(2.0 * np.mean(amplitudes[of == tone] ** 2))))
               for tone in sorted(set(knots))]
    least = WORTH * max(size for _, size in several)
    return ' and '.join(f'{size:.3g} {unit} every {1.0 / tone:.4g} s'
                        for tone, size in several if size >= least)


def _waving(tones: Sequence[float], one: EquationErrors) -> np.ndarray:
    return waves(2.0 * np.pi * one.motion.time, tones)


def _strongest(time: np.ndarray, target: np.ndarray, each: Sequence[np.ndarray], top: float
               ) -> tuple[float, int]:
    """Return the frequency up to ``top``, Hz, that takes most of a target, and how many it had."""
    unit = top / LARGEST_ORDER
    span = max(float(np.ptp(time[at])) for at in each)
    parts = int(np.clip(np.ceil(PARTS * span * unit), 1, MOST_PARTS))
    lowest = int(np.ceil(PERIODS / span / unit * parts))
    if lowest >= LARGEST_ORDER * parts:
        return 0.0, 0
    power = np.sum([periodogram(2.0 * np.pi * unit * time[at], target[at] - target[at].mean(),
                                np.ones(len(at)), parts) for at in each], axis=0)
    power[:lowest] = 0.0
    best, apart = int(np.argmax(power)), unit / parts
    found = minimize_scalar(lambda tone: _left(time, target, each, (tone,)),
                            bounds=((best - 1) * apart, (best + 1) * apart), method='bounded',
                            options={'xatol': 0.01 * apart})
    return float(found.x), int(span * (top - lowest * apart))


def _left(time: np.ndarray, target: np.ndarray, each: Sequence[np.ndarray],
          tones: Sequence[float]) -> float:
    """Return the share of the squares of a target that waves leave, with a phase in each part."""
    left = whole = 0.0
    for at in each:
        around = target[at] - target[at].mean()
        table = np.column_stack((np.ones(len(at)), waves(2.0 * np.pi * time[at], tones)))
        rest = around - table @ np.linalg.lstsq(table, around, rcond=1e-9)[0]
        left, whole = left + float(rest @ rest), whole + float(around @ around)
    return left / whole if whole > 0.0 else 1.0
