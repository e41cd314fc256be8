"""
Output-error least squares: simulate, compare, adjust.

Closed-loop data. The command that was applied is recorded without error, so simulating with it
(``measured_input``) is unbiased by encoder noise that the controller feeds back: a residual is
correlated with later commands only, and no simulated value depends on those. Disturbances that the
model lacks do come back through the controller; ``closed_loop`` simulates the controller with the
same reference instead, which no disturbance of the plant has touched, and is the answer there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import time

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .estimate import bag_name, Estimate, servo_with
from .fit_choices import WEIGHTS
from .fit_problem import COARSE, FINE, FINEST, Normal, Problem
from .free_values import Freedom, freedom_of, NOTHING_FREE, tolerated
from .levenberg_marquardt import SHARES, solved
from .segments import CHANNELS, courses_of
from .shooting import Shooting, Unknowns
from .standard_errors import cautious, spread
from .start_search import best_starts, searched
from .told_apart import alike, PART, still, unseen, UNSURE

RELATIVE_MARGIN = 1e-3
MOST_ROUNDS, STEPS_A_ROUND, COARSE_ROUNDS, SEARCHES = 12, 2, 2, 3
WORTH = 1e-3  # share of the cost that a step must take from values that are near
ROUGH = 5.0  # residual over noise floor of the worst channel, above which slopes are taken coarse


@dataclass(frozen=True)
class Progress:
    """Where a fit is: its stage, steps taken, cost, warnings known so far."""

    stage: str
    iteration: int
    cost: float
    warnings: tuple[str, ...] = ()


def fit(servo: Servo, recordings: Sequence[Recording], free: Sequence[str], *,
        mode: str = 'measured_input', horizon: float | None = None,
        bounds: Mapping[str, tuple[float, float]] | None = None, tolerance: bool = True,
        channels: Sequence[str] | None = None, delays: bool = False, robust: bool = False,
        weights: str = 'residual', iterations: int = 40, precision: float = 0.1,
        near: bool = False, nearest: bool = True, on: np.ndarray | None = None,
        progress: Callable[[Progress], None] | None = None) -> Estimate:
    """
    Fit free parameters of a servo to recordings.

    ``free`` paths of parameters (a row is freed element by element, or ``path[i]``); ``mode``
    measured_input, closed_loop, forced_current or, of two encoders alone, forced_motion: the
    motor's encoder leads the twin; ``horizon`` s between restarts (None: by the data); ``bounds``
    by path, cut by declaration and (unless ``tolerance`` is false) by the servo file's tolerance;
    ``channels`` to compare (None: all measured); ``delays``: estimate how late each channel is, so
    that lateness does not become inertia; ``robust``: Huber's loss; ``weights``: 'noise' divides a
    channel by its noise floor, 'residual' by what the best fit leaves where that is larger.
    'whitened' does so after taking out what each residual shares with the one before. Errors that
    drift then no longer mask those that swing. ``near``: the values to start from are nearly the
    answer, as those of the equations are, so that neither valleys nor starts are searched for,
    which takes most of the time. ``nearest``: of values that cannot be told apart those nearest to
    the given ones, by their scales; else any of them. ``on``: switches of the effects.
    ``progress`` is told before the first step (with the warnings) and after each, and may raise to
    stop.
    Raises ValueError (ServoError) for what cannot be fitted.
    """
    if weights not in WEIGHTS:
        raise ValueError(f'weights = {weights!r}; there are {list(WEIGHTS)}')
    begun = time.perf_counter()
    freedom = freedom_of(servo, free, bounds, tolerance)
    courses = courses_of(servo, recordings, mode, horizon, channels)
    shooting = Shooting(servo, courses, mode, on)
    try:
        problem = Problem(shooting, freedom, delays, robust)
        unknowns = shooting.beginning(_inside(servo.theta, freedom))
        return _fitted(servo, problem, unknowns, mode, weights, iterations, precision, near,
                       nearest, progress or (lambda told: None), begun)
    finally:
        shooting.close()


def misfit(servo: Servo, recordings: Sequence[Recording], *, mode: str = 'measured_input',
           horizon: float | None = None,
           channels: Sequence[str] | None = None) -> dict[str, float]:
    """
    Return what a servo leaves of each channel, root mean square in its unit; nothing is fitted.

    Restarts from measured states every ``horizon`` s, as :func:`fit` does. NaN: it diverges.
    """
    shooting = Shooting(servo, courses_of(servo, recordings, mode, horizon, channels), mode)
    try:
        problem = Problem(shooting, NOTHING_FREE, False, False)
        raw = problem.raw_of(shooting.beginning(servo.theta))
        return _rms(problem, np.where(np.isfinite(raw), raw, np.nan))
    finally:
        shooting.close()


@dataclass(frozen=True)
class _Untold:
    """What recordings do not tell: numbers ``held`` (p,), ``changes`` (values, d), sentences."""

    held: np.ndarray
    changes: np.ndarray
    sentences: tuple[str, ...]


def _checked(problem: Problem, unknowns: Unknowns, nearest: bool = True
             ) -> tuple[Unknowns, _Untold, float]:
    """Correct the starts, and say what these recordings will not tell."""
    problem.be_modest()
    problem.step = FINE
    normal = problem.linearised(unknowns)
    if not np.isfinite(normal.cost):
        raise ValueError('the simulation diverges at the values to start from; '
                         'look at the step of the servo file and at its values')
    nowhere = np.zeros(problem.size)
    unknowns, cost = best_starts(problem, [problem.stepped(unknowns, normal, nowhere, share)
                                           for share in SHARES])
    freedom, count = problem.freedom, len(problem.freedom)
    held = still(problem.linearised(unknowns).hessian, count)
    said = [f'{freedom.names[i]} is not excited: these recordings do not show a change of it'
            for i in np.flatnonzero(held[:count])]
    if not nearest:
        return unknowns, _Untold(held, np.zeros((count, 0)), tuple(said)), cost
    problem.step = FINEST
    hessian = problem.linearised(unknowns).hessian
    changes = unseen(hessian, held, count)
    value = np.abs(unknowns.theta[freedom.index])
    said += alike(changes, np.sqrt(np.diag(hessian)[:count]),
                  freedom.scale / np.where(value > 0.0, value, freedom.scale), freedom.names)
    return unknowns, _Untold(held, changes, tuple(said)), cost


def _inside(theta: np.ndarray, freedom: Freedom) -> np.ndarray:
    theta = theta.copy()
    theta[freedom.index] = np.clip(theta[freedom.index], freedom.low, freedom.high)
    return theta


def _reweigh(problem: Problem, raw: np.ndarray, whiten: bool = False) -> float:
    """Weigh each channel of each recording by what is left of it; return the largest change."""
    before = problem.factor.copy()
    if whiten:
        for i in range(len(before)):
            rows = raw[problem.course == i]
            energy = np.maximum(np.sum(rows[:-1] ** 2, axis=0), 1e-300)
            problem.carry[i] = np.clip(np.sum(rows[1:] * rows[:-1], axis=0) / energy, 0.0, 0.999)
    raw = problem.whitened(raw)
    for i in range(len(before)):
        rows = raw[problem.course == i]
        used = rows.any(axis=0)
        rms = np.sqrt(np.mean(rows**2, axis=0))
        floor = np.sqrt(1.0 + problem.carry[i] ** 2)
        problem.factor[i, used] = 1.0 / np.maximum(floor, rms)[used]
    return float(np.abs(np.log(problem.factor / before)).max())


def _fitted(servo: Servo, problem: Problem, unknowns: Unknowns, mode: str, weights: str,
            iterations: int, precision: float, near: bool, nearest: bool,
            progress: Callable[[Progress], None], begun: float) -> Estimate:
    freedom, worth = problem.freedom, WORTH if near else 0.0
    first = problem.raw_of(unknowns)
    unknowns, untold, cost = _checked(problem, unknowns, nearest)
    progress(Progress('check', 0, cost, untold.sentences))
    held, changes = untold.held, untold.changes
    taken = 0

    def told(iteration: int, cost: float) -> None:
        progress(Progress('fit', taken + iteration, cost))

    # far from the answer one channel would drown the others: weights follow the fit down
    for turn in range(MOST_ROUNDS):
        if _reweigh(problem, problem.raw_of(unknowns), weights == 'whitened') < 0.2 and taken:
            break
        problem.step = COARSE if turn < COARSE_ROUNDS else FINE
        unknowns, done = solved(problem, unknowns, STEPS_A_ROUND, precision, held, told, worth,
                                changes)
        taken += done
        if turn and not near:
            unknowns, _ = searched(problem, unknowns)
    if weights == 'noise':
        problem.factor[:] = 1.0
    problem.step = FINE
    for search in range(1 if near else SEARCHES):
        better = False
        if not near:
            unknowns, better = searched(problem, unknowns)
        if search and not better:
            break
        unknowns, done = solved(problem, unknowns, iterations, precision, held, told, worth,
                                changes)
        taken += done
    normal = problem.linearised(unknowns)
    ends = [(normal, True)]  # the normal equations at the end, and whether it was settled there
    if not near and _misfit(problem, unknowns) > ROUGH:
        ends = []
        for problem.step in (COARSE, FINE):
            unknowns, done = solved(problem, unknowns, iterations, precision, held, told,
                                    unseen=changes)
            taken += done
            normal = problem.linearised(unknowns)
            ends.append((normal, problem.step == FINE))
    problem.step = FINEST
    ends.append((problem.linearised(unknowns), True))
    covariance = _covariance(ends, problem.owner, held, np.zeros(len(held)))

    count = len(freedom)
    std = np.sqrt(np.diag(covariance)[:count])
    known = np.append(tolerated(servo, freedom), np.zeros(len(held) - count))
    told_std = np.sqrt(np.diag(_covariance(ends, problem.owner, held, known))[:count])
    warned = [*untold.sentences, *_afterwards(freedom, unknowns, std, held[:count], changes)]
    deviation = np.outer(std, std)
    with np.errstate(invalid='ignore'):
        correlation = covariance[:count, :count] / deviation
    std = np.where(held[:count], np.nan, std * freedom.scale)
    late_std = np.sqrt(np.diag(covariance)[count:count + len(problem.late)]) * problem.late_scale
    names = freedom.names
    values = {n: float(unknowns.theta[i]) for n, i in zip(names, freedom.index, strict=True)}
    errors = {n: float(s) for n, s in zip(names, std, strict=True)}
    within = np.where(held[:count], np.nan, told_std * freedom.scale)
    bags = tuple(bag_name(c.recording) for c in problem.shooting.courses)
    left = problem.raw_of(unknowns)
    scaled = problem.weighed(first)
    return Estimate(
        servo_with(servo, names, values, errors, bags, f'fit, output error, {mode}'), names,
        values, errors, {n: servo.unit(n.partition('[')[0]) for n in names}, correlation,
        tuple(dict.fromkeys(warned)),
        _rms(problem, left), _rms(problem, first),
        _floors(problem), float(0.5 * np.vdot(normal.residual, normal.residual)),
        float(0.5 * np.vdot(scaled, scaled)),
        {CHANNELS[c]: float(unknowns.delays[c]) for c in problem.late},
        {CHANNELS[c]: float(s) for c, s in zip(problem.late, late_std, strict=True)},
        mode, _horizon(problem), taken, time.perf_counter() - begun, bags,
        {n: float(s) for n, s in zip(names, within, strict=True)})


def _covariance(ends: Sequence[tuple[Normal, bool]], owner: np.ndarray, held: np.ndarray,
                known: np.ndarray) -> np.ndarray:
    """Return the widest of the covariances at the ends of a fit, in units of the scales."""
    covariance = None
    for normal, settled in ends:
        fine = spread(normal, owner, held, known, settled)
        covariance = fine if covariance is None else cautious(fine, covariance)
    assert covariance is not None
    return covariance


def _afterwards(freedom: Freedom, unknowns: Unknowns, std: np.ndarray,
                held: np.ndarray, changes: np.ndarray) -> list[str]:
    said, known = [], np.einsum('ij,ij->i', changes, changes) < PART**2
    value = unknowns.theta[freedom.index]
    edge = RELATIVE_MARGIN * np.minimum(freedom.scale, freedom.high - freedom.low)
    for k, name in enumerate(freedom.names):
        if held[k]:
            continue
        for bound, beyond in ((freedom.low[k], value[k] < freedom.low[k] + edge[k]),
                              (freedom.high[k], value[k] > freedom.high[k] - edge[k])):
            if beyond:
                said.append(f'{name} = {value[k]:.6g} is at its bound {bound:g}: not identified; '
                            f'widen the tolerance or look for an effect that is missing')
        size = max(freedom.scale[k], abs(value[k]))
        if known[k] and std[k] * freedom.scale[k] > UNSURE * size:
            said.append(f'{name} is not identified: its standard error is '
                        f'{100 * std[k] * freedom.scale[k] / size:.0f} % of {size:.3g}')
    return said


def _misfit(problem: Problem, unknowns: Unknowns) -> float:
    left, floor = _rms(problem, problem.raw_of(unknowns)), _floors(problem)
    return max(left[c] / floor[c] for c in left)


def _rms(problem: Problem, residual: np.ndarray) -> dict[str, float]:
    error = residual * problem.noise
    seen = np.isfinite(problem.measured)
    return {name: float(np.sqrt(np.mean(error[seen[:, c], c] ** 2)))
            for c, name in enumerate(CHANNELS) if seen[:, c].any()}


def _floors(problem: Problem) -> dict[str, float]:
    seen = np.isfinite(problem.measured).any(axis=0)
    return {name: float(np.sqrt(np.nanmean(problem.noise[:, c] ** 2)))
            for c, name in enumerate(CHANNELS) if seen[c]}


def _horizon(problem: Problem) -> float:
    lengths = [(c.stops - c.starts) * c.period for c in problem.shooting.courses]
    return float(np.median(np.concatenate(lengths)))
