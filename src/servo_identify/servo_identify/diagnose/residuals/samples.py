"""The residuals of several recordings as one regression: whitened, in blocks, with columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ..decisions import OPEN, PRACTICAL
from .doubt import doubt_about
from .equation_errors import EquationErrors
from .measured import measure
from .motion import Motion
from .residual_noise import propagated_noise, signal_of
from .sampling_instants import Columns, sampling_columns
from .shown_current import drive_current
from .test_function import TestFunction

LARGEST = 1e5  # a model that runs away moves a residual by no more than this
JITTER = 0.15  # sample periods by which instants of sampling scatter unseen
UNEVEN = 0.5  # likewise, where uneven rows were brought onto an even grid
ROUGH = 0.6745  # median size of a normal deviate

@dataclass
class ResidualSamples:
    """
    Residuals of several recordings, divided by their noise and the practical margin.

    A sample is one instant of one equation of one recording. ``base`` (samples,) is the residual
    of the servo as given; ``block`` numbers stretches of time that count as independent;
    ``equation`` indexes EQUATIONS, ``recording`` the recordings; ``scale`` is what ``base`` was
    divided by, ``noise`` the noise alone and ``declared`` the most that the noise of the servo
    file may be, in the unit of the equation. Samples where nothing
    can be said (rest, gaps) are left out.
    """

    servo: Servo
    errors: list[EquationErrors]
    base: np.ndarray = field(init=False)
    equation: np.ndarray = field(init=False)
    recording: np.ndarray = field(init=False)
    block: np.ndarray = field(init=False)
    scale: np.ndarray = field(init=False)
    noise: np.ndarray = field(init=False)
    declared: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        theta = self.servo.theta
        self._keep: dict[tuple[int, str], np.ndarray] = {}
        self._part: dict[tuple[int, str], slice] = {}
        table: dict[str, list[np.ndarray]] = {
            name: [] for name in ('base', 'equation', 'recording', 'block', 'scale', 'noise',
                                  'declared')}
        first = size = 0
        for number, one in enumerate(self.errors):
            measured = one.measured
            for name, values in one.nominal.items():
                keep = np.isfinite(values) & one.moving(name) & one.covered(name)
                doubt, tells = doubt_about(one, name)
                keep &= tells
                self._keep[number, name] = keep
                count = int(keep.sum())
                self._part[number, name] = slice(size, size + count)
                size += count
                doubt = doubt[keep]
                noise, declared = self._noise(one, name, theta, values[keep])
                margin = PRACTICAL * signal_of(one, name, theta, keep)
                table['base'].append(values[keep])
                table['noise'].append(np.hypot(noise, doubt))
                table['declared'].append(np.hypot(declared, doubt))
                table['scale'].append(np.hypot(np.hypot(noise, margin), doubt))
                times = one.times(name)[keep]
                table['block'].append(first + (times / measured.block).astype(int))
                table['equation'].append(np.full(count, EQUATIONS.index(name)))
                table['recording'].append(np.full(count, number))
            first += int(measured.recording.duration / measured.block) + 1
        for name, parts in table.items():
            kind = int if name in ('equation', 'recording', 'block') else float
            setattr(self, name, np.concatenate(parts) if parts else np.zeros(0, kind))
        self.block = np.unique(self.block, return_inverse=True)[1]
        # where a signal jumps within a sample, its instant decides: such samples weigh less
        late = self.place(sampling_columns(self.errors, steep=True))
        scatter = np.array([UNEVEN if one.measured.recording.resampled else JITTER
                            for one in self.errors])[self.recording, None]
        self.scale = self.scale * np.sqrt(1.0 + ((scatter * late) ** 2).sum(axis=1))
        self.base = self.at(theta)

    def at(self, theta: np.ndarray, settings: Mapping[int, Mapping[int, float]] | None = None,
           only: tuple[str, ...] | None = None) -> np.ndarray:
        """Return all residuals at some values, in units of their scale."""
        answer = np.zeros(len(self.scale)) if only is None else self.base.copy()
        with np.errstate(over='ignore', invalid='ignore'):
            for number, one in enumerate(self.errors):
                changes = (settings or {}).get(number)
                for name, values in one.residuals(theta, only, changes).items():
                    part = self._part[number, name]
                    kept = np.nan_to_num(values[self._keep[number, name]]) / self.scale[part]
                    answer[part] = np.clip(kept, -LARGEST, LARGEST)
        return answer

    def place(self, columns: Columns, width: int | None = None) -> np.ndarray:
        """
        Return columns at all samples, in units of their scale, shape (samples, n).

        ``width`` is n where no equation may have the columns.
        """
        if width is None:
            width = max((1 if values.ndim == 1 else values.shape[1]
                         for some in columns.values() for values in some.values()), default=0)
        table = np.zeros((len(self.scale), width))
        for number, some in columns.items():
            for name, values in some.items():
                part = self._part.get((number, name))
                if part is None:
                    continue
                kept = np.nan_to_num(values[self._keep[number, name]])
                table[part] = (kept[:, None] if kept.ndim == 1 else kept) / self.scale[part, None]
        return table

    def rows(self, equation: str) -> np.ndarray:
        """Which samples are of an equation, bool."""
        return self.equation == EQUATIONS.index(equation)

    @property
    def present(self) -> tuple[str, ...]:
        """Equations that have samples."""
        return tuple(EQUATIONS[i] for i in np.unique(self.equation))

    def kept(self, number: int, equation: str) -> np.ndarray:
        """Which centres of an equation of a recording are samples, bool."""
        return self._keep[number, equation]

    def part(self, number: int, equation: str) -> slice:
        """Where the samples of an equation of a recording stand."""
        return self._part[number, equation]

    def of_motion(self, equation: str, name: str) -> np.ndarray:
        """Return a column of the motion at the samples of an equation, in order."""
        return self.along(equation, lambda one, motion: motion[name])

    def along(self, equation: str, of: Callable[[EquationErrors, Motion], np.ndarray]
              ) -> np.ndarray:
        """Return a series of inner samples of a motion at the samples of an equation, in order."""
        parts = []
        for number, one in enumerate(self.errors):
            if (number, equation) not in self._keep:
                continue
            motion = one.motion_of(equation)
            series = motion.at_centres(of(one, motion), one.test(equation))
            parts.append(series[self._keep[number, equation]])
        return np.concatenate(parts) if parts else np.zeros(0)

    def open_from(self, equation: str) -> float:
        """
        Return the mean square from which an equation is certainly off.

        Beyond OPEN, and beyond what noise of the size that the servo file says may do.
        """
        rows = self.rows(equation)
        said = (self.declared[rows] / self.scale[rows]) ** 2
        return float(max(OPEN**2, np.mean(said) if len(said) else 0.0))

    def _noise(self, one: EquationErrors, name: str, theta: np.ndarray,
               values: np.ndarray) -> tuple[float, float]:
        """
        Return the standard deviation of a residual by the noise of the readings, and at most.

        It is propagated from the readings. It cannot be more than the rough part of the residual
        itself shows, which counts where that is less.
        """
        propagated, alike, declared = propagated_noise(one, name, theta)
        if len(values) < 30:
            return propagated, declared
        step = values[:-2] - 2.0 * values[1:-1] + values[2:]
        rough = np.median(np.abs(step)) / ROUGH / np.sqrt(6.0 - 8.0 * alike[0] + 2.0 * alike[1])
        return float(min(propagated, rough)), declared


def residual_samples(recordings: Sequence[Recording], servo: Servo) -> ResidualSamples:
    """Return the residuals of recordings of one machine against its servo file."""
    def drive(recording: Recording) -> np.ndarray | None:
        if not (recording.has('voltage') and recording.has('current')):
            return None
        ratio = servo.numbers['mechanism.ratio']
        angle = recording['motor_position'] if recording.has('motor_position') else (
            recording['load_position'] * ratio)
        test = TestFunction(2, recording.period, 4)
        known = np.nan_to_num(angle)
        speed = np.pad(test.smooth(known, 1), test.reach, mode='edge')
        command = np.nan_to_num(recording['voltage'])
        return drive_current(servo, servo.theta, command, speed, recording)

    return ResidualSamples(servo, [EquationErrors(servo, one)
                                   for one in measure(recordings, servo, drive)])
