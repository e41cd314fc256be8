r"""
How far model and bench are apart, as paper 002 counts it.

.. math:: MSE = \frac{1}{n} \sum (X_i - Y_i)^2, \quad SE = \sqrt{\frac{MSE}{n - 1}}

X the bench, Y the model. The paper gives its standard error in per cent of "the signal"; here that
is the root mean square of the bench's signal about its mean, the smallest thing one could mean by
it. The standard error falls with the number of samples whatever the model does, so the root mean
square error stands beside it, in the same per cent, and its floor: what two recordings of the same
bench at the same settings differ by, over the square root of two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import time

import numpy as np

from servo_identify.learn.free_run import EDGE, speed_of
from servo_identify.learn.sinusoid import recovered
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .ema_model import Conditions
from .ema_recordings import Case

SIGNALS = {'position': 'rad', 'speed': 'rad/s', 'current': 'A'}
"""Position and speed of the load (its encoder closes the loop), current of the motor."""

LEFT = 3e-3  # rad, by which the load has left its plateau
TIMINGS = 25  # runs that are timed


@dataclass(frozen=True)
class Apart:
    """One signal of a case: ``n`` samples, errors and signal in its unit, floor in per cent."""

    n: int
    mse: float
    signal: float
    floor: float

    @property
    def se(self) -> float:
        """Standard error as the paper defines it, % of the signal."""
        return 100.0 * np.sqrt(self.mse / (self.n - 1)) / self.signal

    @property
    def rmse(self) -> float:
        """Root mean square error, % of the signal."""
        return 100.0 * np.sqrt(self.mse) / self.signal


@dataclass(frozen=True)
class Judged:
    """
    One case.

    ``ratio``: processor time of the model for a second of the bench, median of several runs;
    ``wall`` the least that passed on the clock. ``late``: how far apart, s, model and bench leave
    a plateau at worst. ``command_error``: recovered less played, Hz and rad; ``response_error``:
    frequency by the answer of the load alone less what was played, Hz.
    """

    case: Case
    signals: dict[str, Apart]
    ratio: float
    wall: float
    late: float
    time: np.ndarray
    bench: dict[str, np.ndarray]
    model: dict[str, np.ndarray]
    command_error: tuple[float, float]
    response_error: float


def judged(servo: Servo, case: Case, recording: Recording, again: Sequence[Recording]) -> Judged:
    """Run the model under the conditions of a recording; ``again`` are its replicates."""
    conditions = Conditions(case, recording)
    variant = case.of(servo)
    conditions.seat(variant)
    conditions.seat(variant)
    spent = []
    for _ in range(TIMINGS):
        begun, busy = time.perf_counter(), time.thread_time()
        y = conditions.rolled(variant)
        spent.append((time.perf_counter() - begun, time.thread_time() - busy))
    wall, processor = np.array(spent).T / recording.duration
    period, inner = recording.period, slice(EDGE, -EDGE)
    bench, *repeated = (_signals(r['load_position'], r['current'], period)
                        for r in (recording, *again))
    model = _signals(y[:, 1], y[:, 3], period)
    signals = {}
    for name in SIGNALS:
        seen, said = bench[name][inner], model[name][inner]
        differ = [np.mean((seen - r[name][inner]) ** 2) for r in repeated]
        signals[name] = Apart(len(seen), float(np.mean((seen - said) ** 2)), float(seen.std()),
                              100.0 * float(np.sqrt(0.5 * np.mean(differ)) / seen.std()))
    answered = _of_response(recording)
    return Judged(case, signals, float(np.median(processor)), float(wall.min()),
                  _late(conditions, bench['position'], model['position']), recording.time, bench,
                  model, (conditions.command.frequency - case.frequency,
                          conditions.command.phase - case.phase), answered - case.frequency)


def _signals(position: np.ndarray, current: np.ndarray, period: float) -> dict[str, np.ndarray]:
    return {'position': position, 'speed': speed_of(position, period), 'current': current}


def _of_response(recording: Recording) -> float:
    """Return the frequency that the answer of the load alone tells, Hz."""
    return recovered(recording['load_position'], recording.period).frequency


def _late(conditions: Conditions, bench: np.ndarray, model: np.ndarray) -> float:
    """Return by how much model and bench leave a plateau apart, s, at worst."""
    sine, t = conditions.command, conditions.recording.time
    turn = (0.25 - sine.phase / (2.0 * np.pi)) / sine.frequency
    worst = 0.0
    for extreme in np.arange(turn, t[-1], 0.5 / sine.frequency):
        window = (t >= extreme) & (t < extreme + 0.25 / sine.frequency)
        if extreme < 0.0 or window.sum() < 0.24 / sine.frequency / conditions.recording.period:
            continue
        left = []
        for angle in (bench, model):
            part = angle[window]
            top = part.max() if sine(extreme) > sine.offset else part.min()
            last = np.flatnonzero(np.abs(part - top) < LEFT)[-1]
            left.append(t[window][last])
        worst = max(worst, abs(left[1] - left[0]))
    return worst
