"""What is another in each recording: friction of a machine that warms up, a zero that drifts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from functools import partial

import numpy as np

from servo_twin.physics.servo import Servo

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import BY_RECORDING, Hypothesis, Mechanism, Series


def by_recording(builder: Builder, sides: Collection[str]) -> Iterator[Hypothesis]:
    """
    Yield the hypotheses of what differs from recording to recording.

    Only where a motion was recorded more than once: otherwise the motions may be what differs.
    ``sides`` are the shafts whose friction can be told apart.
    """
    errors = builder.samples.errors
    if not repeated(builder):
        return
    for site in sides:
        for changes in (False, True):
            yield from filter(None, (_friction(builder, site, changes),))
    has = frozenset.intersection(*(one.measured.channels for one in errors))
    for channel in ('torque', 'current'):
        if channel in has:
            yield from filter(None, (_offset(builder, channel),))


def repeated(builder: Builder) -> bool:
    """Tell whether a motion was recorded more than once."""
    families = Counter(one.measured.recording.family for one in builder.samples.errors)
    return max(families.values()) > 1


def apart(errors: Sequence[EquationErrors], of: Series, one: EquationErrors) -> np.ndarray:
    """Return the columns of a series, (samples, n), in those of this recording alone."""
    table = of(one)
    width = table.shape[1]
    number = next(k for k, other in enumerate(errors)
                  if other.measured.recording is one.measured.recording)
    whole = np.zeros((len(table), width * len(errors)))
    whole[:, number * width:(number + 1) * width] = table
    return whole


def _friction(builder: Builder, site: str, changes: bool) -> Hypothesis | None:
    """
    Friction that is more or less of what the file has in each recording, and ``changes`` in it.

    Warm grease makes less of all of it. Where the file has none, it is a level.
    """
    errors = builder.samples.errors
    own = any(np.any(one.of_file[f'{site}_resistance']) for one in errors)

    def more(one: EquationErrors) -> np.ndarray:
        size = np.abs(one.of_file[f'{site}_resistance']) if own else np.ones(len(one.motion.rows))
        time = one.motion.time - one.motion.time.mean()
        shapes = [size, size * time / max(np.ptp(time), 1e-9)][:1 + changes]
        return np.column_stack(shapes)

    mechanism = Mechanism('friction_drift', 'friction', site, (BY_RECORDING,), 'odd')
    knots = [k for k in range(len(errors)) for _ in range(1 + changes)]
    low = np.tile([-1.0 if own else 0.0, -np.inf][:1 + changes], len(errors))
    return builder.hypothesis(
        mechanism, builder.resisting(site, partial(apart, errors, more)), [0] * len(knots), knots,
        room=(low, np.inf), detail={'told': _rubs if own else partial(_lies, 'N m', site)})


def _offset(builder: Builder, channel: str) -> Hypothesis | None:
    """A reading whose zero is another in each recording."""
    errors, unit = builder.samples.errors, 'A' if channel == 'current' else 'N m'

    def ones(one: EquationErrors) -> np.ndarray:
        return np.ones((len(one.measured.recording), 1))

    mechanism = Mechanism(f'{channel}_sensor_offset', 'sensor', channel, (BY_RECORDING,), 'even')
    knots = list(range(len(errors)))
    return builder.hypothesis(mechanism, builder.place(channel, partial(apart, errors, ones),
                                                       -1.0), [0] * len(knots), knots,
                              detail={'told': partial(_lies, unit, channel)})


def _rubs(knots: Sequence[int], amplitudes: np.ndarray, servo: Servo) -> str:
    """Return how many times the friction of the file there is, in words."""
    low, high = _between(knots, amplitudes)
    return f'{1.0 + low:.3g} to {1.0 + high:.3g} times that of the file, by recording'


def _lies(unit: str, place: str, knots: Sequence[int], amplitudes: np.ndarray,
          servo: Servo) -> str:
    """Return between what a level lies, in words."""
    low, high = _between(knots, amplitudes)
    return f'{low:.3g} to {high:.3g} {servo.reads(unit, place)}, by recording'


def _between(knots: Sequence[int], amplitudes: np.ndarray) -> tuple[float, float]:
    """Return the least and the largest of the first amplitudes of each recording."""
    first = amplitudes[np.unique(knots, return_index=True)[1]]
    return float(first.min()), float(first.max())
