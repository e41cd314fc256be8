"""
A wave that somebody adds behind the controller, which the servo file does not know.

The command that was recorded, less what the controller makes of its references and readings, is
folded over a period. Where the folded profile says more of it than other gains of the controller
do, a wave was added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..decisions import EVEN, FORM
from .equation_errors import EquationErrors

BINS = 40  # of a period
TURNS = 3.0  # periods that a recording must hold
STEPS = 41  # periods tried about that of the strongest line


@dataclass(frozen=True)
class AddedInput:
    """
    A periodic input: ``shape``, ``period`` s, ``amplitude`` and ``offset`` in V (or A).

    ``share`` is the part of what the controller does not explain that the wave does.
    """

    shape: str
    period: float
    amplitude: float
    offset: float
    share: float

    def __str__(self) -> str:
        more = f' about {self.offset:.3g} V' if abs(self.offset) > FORM * self.amplitude else ''
        return (f'a {self.shape} of {self.amplitude:.3g} V{more}, period {self.period:.3f} s, is '
                'added behind the controller')


def added_input(several: Sequence[EquationErrors]) -> AddedInput | None:
    """Return the wave that most of the recordings hold, or None."""
    found = [wave for wave in map(_wave_of, several) if wave is not None]
    if not found or len(found) < EVEN * len(several):
        return None
    return max(found, key=lambda wave: wave.share)


def _wave_of(one: EquationErrors) -> AddedInput | None:
    recording, theta = one.measured.recording, one.servo.theta
    error = recording['voltage'] - one.controller_output(theta) + one.integral
    known = np.isfinite(error)
    time = np.flatnonzero(known) * recording.period
    error = error[known]
    if len(error) < 10 * BINS or not np.var(error) > 0.0:
        return None
    wave = _folded(time, error)
    if wave is None or wave.share < max(EVEN, _by_gains(one, error, known)):
        return None
    return None if _is_reference(one, wave.period) else wave


def _by_gains(one: EquationErrors, error: np.ndarray, known: np.ndarray) -> float:
    """Return the share of an error that other gains of the controller explain."""
    theta, columns = one.servo.theta, [np.ones(len(error))]
    base = one.controller_output(theta)
    for path, slot in one.slots.items():
        if path.startswith('controller.'):
            step = 0.1 * abs(theta[slot.start]) or 0.1
            columns.append((one.controller_output(theta, {slot.start: step}) - base)[known])
    table = np.nan_to_num(np.column_stack(columns))
    left = error - table @ np.linalg.lstsq(table, error, rcond=1e-10)[0]
    return 1.0 - float(np.var(left) / np.var(error))


def _is_reference(one: EquationErrors, period: float) -> bool:
    """Tell whether a reference has the same period: then another controller may act as a wave."""
    recording = one.measured.recording
    for name in ('reference_position', 'reference_velocity'):
        reference = recording[name]
        known = np.isfinite(reference)
        if known.sum() > 10 * BINS and np.var(reference[known]) > 0.0:
            time = np.flatnonzero(known) * recording.period
            if _share(time, reference[known], period)[0] > EVEN:
                return True
    return False


def _folded(time: np.ndarray, error: np.ndarray) -> AddedInput | None:
    length = time[-1] - time[0]
    power = np.abs(np.fft.rfft(error - error.mean())) ** 2
    lines = np.fft.rfftfreq(len(error), length / max(1, len(error) - 1))
    first = int(np.searchsorted(lines, TURNS / length))
    if first >= len(lines) - 1:
        return None
    line = lines[first + int(np.argmax(power[first:]))]
    best = (0.0, 0.0)
    for divided in (1, 2, 3):
        if line / divided < TURNS / length:
            break
        share, rate = 0.0, line / divided
        for half in (0.6, 0.03):  # of a line of the spectrum to either side
            near = rate + np.linspace(-half, half, STEPS) / length
            share, rate = max((_share(time, error, 1.0 / f)[0], float(f)) for f in near if f > 0.0)
        period = 1.0 / rate
        if share > best[0] + FORM * (1.0 - best[0]):
            best = (share, period)
    share, period = best
    if not period:
        return None
    profile = _share(time, error, period)[1]
    offset = 0.5 * float(profile.max() + profile.min())
    high = profile > offset
    levels = profile[high].mean(), profile[~high].mean()
    around = profile - profile.mean()
    turn = 2.0 * np.pi * (np.arange(BINS) + 0.5) / BINS
    sine = 2.0 / BINS * np.array([around @ np.cos(turn), around @ np.sin(turn)])
    whole = float(np.var(profile))
    square = 1.0 - float(np.var(profile - np.where(high, *levels))) / whole
    round_ = 0.5 * float(sine @ sine) / whole
    if max(square, round_) < 1.0 - FORM:
        return AddedInput('periodic wave', period, 0.5 * float(np.ptp(profile)), offset, share)
    if square > round_:
        return AddedInput('square wave', period, 0.5 * float(levels[0] - levels[1]),
                          0.5 * float(levels[0] + levels[1]), share)
    return AddedInput('sine', period, float(np.hypot(*sine)), float(profile.mean()), share)


def _share(time: np.ndarray, error: np.ndarray, period: float) -> tuple[float, np.ndarray]:
    """Return (share of the variance that the folded profile explains, profile (BINS,))."""
    at = (np.mod(time / period, 1.0) * BINS).astype(int) % BINS
    count = np.maximum(np.bincount(at, minlength=BINS), 1)
    profile = np.bincount(at, error, BINS) / count
    return 1.0 - float(np.var(error - profile[at]) / np.var(error)), profile
