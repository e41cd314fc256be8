"""
Refit and comparison by simulation: what is handed over is judged as a user would use it.

The twin runs over stretches of the recordings. Their starts are estimated, so that a twin that
matches the rig comes down to the noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ...fit.estimate import Estimate
from ...fit.fit_problem import Problem
from ...fit.output_error import fit
from ...fit.segments import CHANNELS
from ...fit.shooting import Shooting, Unknowns
from ...fit.start_search import best_starts
from .cut import Cut
from .gap import Gap
from .starts import of_starts, soon, stepped

TURNS = 3  # of estimating the starts: a shaft that sticks may give way in the last
BLOCK = 1.0  # s of a simulation that count as independent of their neighbours
STEPS = 8  # of a refit from values that the equations found already


QUICK = ('torque', 'current')
"""Channels that jump with the command, so that the instant of a reading within its row counts."""

TORSION = 'torsion'
"""Name of the angle between load and motor, at the load, among the channels compared."""


class Diverged(ValueError):
    """A twin whose simulation leaves the finite numbers."""


@dataclass(frozen=True)
class Simulated:
    """A twin over recordings: its gap, and its outputs by recording and channel."""

    gap: Gap
    outputs: list[dict[str, np.ndarray]]


def mode_of(recordings: Sequence[Recording]) -> str:
    """Return what drives the twin: the recorded command, the current, or the motor's encoder."""
    if all(one.has('voltage') for one in recordings):
        return 'measured_input'
    return 'forced_current' if any(one.driven for one in recordings) else 'forced_motion'


def simulated(servo: Servo, recordings: Sequence[Recording], cut: Cut | None = None) -> Simulated:
    """
    Run a twin over recordings from estimated starts; raises Diverged.

    ``cut`` has those that are cut into horizons already.
    """
    mode = mode_of(recordings)
    shooting = Shooting(servo, (cut or Cut()).courses(servo, recordings, mode), mode)
    try:
        problem, both = of_starts(shooting)
        unknowns = shooting.beginning(servo.theta)
        with np.errstate(over='ignore', invalid='ignore'):
            cost = problem.evaluate(unknowns)[1]
            if not np.isfinite(cost):
                raise Diverged(f'{servo.name}: the simulation leaves the finite numbers; its '
                               f'step of {servo.step:g} s may be too long')
            unknowns, _ = best_starts(problem, [soon(shooting, unknowns), unknowns])
            for _ in range(TURNS):
                unknowns = stepped(problem, unknowns, 1)
                unknowns = _centred(problem, unknowns, both)
            y = shooting.simulate([unknowns])[0]
        return _collected(problem, y)
    finally:
        shooting.close()


def _centred(problem: Problem, unknowns: Unknowns, both: np.ndarray) -> Unknowns:
    """
    Return the unknowns with the zero between the encoders where the torsion has no mean error.

    ``both`` are the numbers of the recordings that have both encoders. The zero is a set-up
    value, as the starts are. Errors of the angles cannot tell it: there it would take up what both
    shafts have drifted.
    """
    if not len(both):
        return unknowns
    y = problem.shooting.simulate([unknowns])[0]
    error, of = _compared(problem, y)[TORSION][1], problem.course
    zeros = unknowns.zeros.copy()
    for number in both:
        mine = error[(of == number) & np.isfinite(error)]
        zeros[number] += mine.mean() if len(mine) else 0.0
    return replace(unknowns, zeros=zeros)


def _collected(problem: Problem, y: list[np.ndarray]) -> Simulated:
    shooting = problem.shooting
    squares, floor, signal = {}, {}, {}
    block, of = _blocks(problem)
    count = int(block.max()) + 1
    for name, (rig, error, noise) in _compared(problem, y).items():
        rows = np.isfinite(rig) & np.isfinite(error)
        if not rows.any():
            continue
        squares[name] = np.column_stack((np.bincount(block[rows], error[rows]**2, count),
                                         np.bincount(block[rows], minlength=count)))
        floor[name] = float(np.sqrt(np.mean(noise[rows]**2)))
        signal[name] = _moved(problem, name, rig, rows)
    outputs, at = [], 0
    stacked = shooting.stacked(y)
    for course in shooting.courses:
        lengths = course.stops - course.starts
        own = {name: np.full(len(course.recording), np.nan) for name in CHANNELS}
        for start, length in zip(course.starts, lengths, strict=True):
            for c, name in enumerate(CHANNELS):
                own[name][start:start + length] = stacked[at:at + length, c]
            at += length
        outputs.append(own)
    return Simulated(Gap(squares, floor, signal, of), outputs)


def _compared(problem: Problem, y: list[np.ndarray]) -> dict[str, tuple[np.ndarray, ...]]:
    """
    Return (measured, twin minus rig, noise), each (rows,), of what a twin is judged by.

    These are the channels and, with both encoders, the torsion: load minus motor over ratio. In
    it an error of the transmission shows that the drift of both shafts would drown. Where the
    motor is led by its encoder, the torsion stands for the angle of the load as well.
    """
    error = problem.raw(y) * problem.noise
    for name in QUICK:
        column = CHANNELS.index(name)
        error[:, column] = _as_read(problem, error[:, column], problem.measured[:, column])
    found: dict[str, tuple[np.ndarray, ...]] = {
        name: (problem.measured[:, c], error[:, c], problem.noise[:, c])
        for c, name in enumerate(CHANNELS)}
    shooting = problem.shooting
    ratio = shooting.servo.numbers['mechanism.ratio']
    (motor, motor_error, motor_noise), (load, load_error, load_noise) = (
        found[name] for name in ('motor_position', 'load_position'))
    if shooting.mode == 'forced_motion':
        del found['load_position']
        motor_error = np.zeros(len(load_error))
        motor = shooting.stacked([one.recording['motor_position'][:, None]
                                  for one in shooting.courses])[:, 0]
    found[TORSION] = (load - motor / ratio, load_error - motor_error / ratio,
                      np.hypot(load_noise, motor_noise / ratio))
    return found


def _as_read(problem: Problem, error: np.ndarray, rig: np.ndarray) -> np.ndarray:
    """
    Return the errors of a channel that is read up to a row before or after the twin's reading.

    A twin is read as a row begins, before its command acts. Which of the instants of its row a
    logger took is a matter of set-up, as a zero is: the one that leaves least.
    """
    twin, best = error + rig, error
    last = np.zeros(len(error), dtype=bool)
    last[problem.firsts[1:] - 1] = last[-1] = True
    step = np.where(last, 0.0, np.diff(twin, append=twin[-1:]))
    for one in (step, np.roll(step, 1)):  # up to the next row, since the row before
        rows = np.isfinite(one) & np.isfinite(error)
        square = float(one[rows] @ one[rows])
        if square > 0.0:
            share = float(np.clip(one[rows] @ error[rows] / square, -1.0, 1.0))
            best = min(best, error - share * one, key=lambda e: float(np.nansum(e**2)))
    return best


def _blocks(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Return (block of each row, recording of each block)."""
    inside = np.concatenate([np.arange(n) for n in problem.lengths]) * problem.period
    horizon = np.repeat(np.arange(len(problem.lengths)), problem.lengths)
    key = horizon * 10**6 + (inside / BLOCK).astype(int)
    known, block = np.unique(key, return_inverse=True)
    return block, problem.owner[known // 10**6]


def _moved(problem: Problem, name: str, rig: np.ndarray, rows: np.ndarray) -> float:
    """How much a channel moves within a horizon: what its error is measured against."""
    x = np.where(rows, rig, 0.0)
    if name in ('torque', 'current'):
        return float(np.sqrt(np.mean(x[rows]**2))) or 1.0
    count = np.maximum(1, np.add.reduceat(rows, problem.firsts, dtype=int))
    mean = np.add.reduceat(x, problem.firsts) / count
    around = x - np.repeat(mean, problem.lengths)
    return float(np.sqrt(np.mean(around[rows]**2))) or 1.0


def refitted(servo: Servo, recordings: Sequence[Recording], free: Sequence[str],
             near: bool = True, bounds: Mapping[str, tuple[float, float]] | None = None
             ) -> Estimate | None:
    """
    Return the values of a servo fitted to recordings by simulation; None where it cannot.

    ``near``: the equations found the values to start from. A servo that lacks an effect is not
    near anything, and where it sticks its starts have to be searched. ``bounds`` by path. Asked
    is how little the tolerances can leave, so values that cannot be told apart are all free.
    """
    if not free:
        return None
    mode = mode_of(recordings)
    weights = 'residual' if mode == 'forced_motion' else 'whitened'  # a led motor does not drift
    try:
        return fit(servo, list(recordings), free, mode=mode, iterations=STEPS, weights=weights,
                   tolerance=True, near=near, nearest=False, bounds=bounds)
    except (ValueError, np.linalg.LinAlgError):
        return None
