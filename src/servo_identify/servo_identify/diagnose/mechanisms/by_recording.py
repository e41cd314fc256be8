"""What differs by recording: friction of a warm machine, a zero that drifts, a part held."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from functools import partial

import numpy as np

from servo_twin.physics.servo import Servo

from ..decisions import SOLVED
from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import Motion
from ..splitting import whole_of
from .builder import Builder
from .hypothesis import BY_RECORDING, Hypothesis, Mechanism, Series
from .orders import waves


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
            yield from filter(None, (_friction(builder, site, changes),
                                     _viscous(builder, site, changes)))
    if 'load' in sides:
        turns = builder.turns('load_angle')
        yield from filter(None, (_weight(builder, hangs) for hangs in (False, True)[:1 + turns]))
    if 'transmission' in builder.samples.present:
        yield from filter(None, (_clearance(builder),))
    has = frozenset.intersection(*(one.measured.channels for one in errors))
    for channel in ('torque', 'current'):
        if channel in has:
            yield from filter(None, (_offset(builder, channel),))


def repeated(builder: Builder) -> bool:
    """Tell whether a motion was recorded more than once; parts of one recording are one."""
    whole = {(one.family, whole_of(one)) for one in (
        errors.measured.recording for errors in builder.samples.errors)}
    return max(Counter(family for family, _ in whole).values()) > 1


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
        return with_changes(one.motion, size, changes)

    mechanism = Mechanism('friction_drift', 'friction', site, (BY_RECORDING,), 'odd')
    knots = [k for k in range(len(errors)) for _ in range(1 + changes)]
    low = np.tile([-1.0 if own else 0.0, -np.inf][:1 + changes], len(errors))
    return builder.hypothesis(
        mechanism, builder.resisting(site, partial(apart, errors, more)), [0] * len(knots), knots,
        room=(low, np.inf), detail={'told': partial(_rubs, names_of(builder)) if own else
                                    partial(_lies, names_of(builder), 'N m', site)})


def _viscous(builder: Builder, site: str, changes: bool) -> Hypothesis | None:
    """Friction in proportion to speed that is another in each recording: cold oil resists so."""
    errors, unit = builder.samples.errors, 'N m s/rad'

    def more(one: EquationErrors) -> np.ndarray:
        return with_changes(one.motion, np.abs(one.motion[f'{site}_speed']), changes)

    mechanism = Mechanism('friction_drift', 'friction', site, (BY_RECORDING, 'speed'), 'odd')
    knots = [k for k in range(len(errors)) for _ in range(1 + changes)]
    return builder.hypothesis(
        mechanism, builder.resisting(site, partial(apart, errors, more)), [0] * len(knots), knots,
        detail={'told': partial(_beside, names_of(builder), unit, site)})


def with_changes(motion: Motion, size: np.ndarray, changes: bool) -> np.ndarray:
    """Return a size (samples,), and where it ``changes`` over time that as well, (samples, n)."""
    time = motion.time - motion.time.mean()
    return np.column_stack([size, size * time / max(np.ptp(time), 1e-9)][:1 + changes])


def _weight(builder: Builder, hangs: bool) -> Hypothesis | None:
    """A part that is held in some recordings and ``hangs``, or a steady push as that of wind."""
    errors = builder.samples.errors

    def pull(one: EquationErrors) -> np.ndarray:
        return waves(one.motion['load_angle'], (1.0,)) if hangs else np.ones(
            (len(one.motion.rows), 1))

    mechanism = Mechanism('gravity' if hangs else 'constant_torque', 'torque', 'load',
                          (BY_RECORDING,), 'even')
    knots = [k for k in range(len(errors)) for _ in range(1 + hangs)]
    return builder.hypothesis(mechanism, builder.place(
        'load_torque', partial(apart, errors, pull)), [0] * len(knots), knots,
        detail={'told': partial(_pulls, names_of(builder)) if hangs else
                partial(_lies, names_of(builder), 'N m', 'load')})


def _clearance(builder: Builder) -> Hypothesis | None:
    """A clearance that is another in each recording, as that of teeth that wear."""
    errors = builder.samples.errors

    def half(one: EquationErrors) -> np.ndarray:
        return 0.5 * one.flank(one.motion)[:, None]

    mechanism = Mechanism('backlash', 'clearance', 'mesh', (BY_RECORDING, 'load'), 'odd')
    knots = list(range(len(errors)))
    return builder.hypothesis(
        mechanism, builder.place('torsion', partial(apart, errors, half)), [1] * len(knots),
        knots, detail={'told': partial(_beside, names_of(builder), 'rad', 'load')})


def names_of(builder: Builder) -> list[str]:
    """Return the names of the recordings, as the columns of each stand."""
    return [one.measured.recording.name for one in builder.samples.errors]


def _offset(builder: Builder, channel: str) -> Hypothesis | None:
    """A reading whose zero is another in each recording."""
    errors, unit = builder.samples.errors, 'A' if channel == 'current' else 'N m'

    def ones(one: EquationErrors) -> np.ndarray:
        return np.ones((len(one.measured.recording), 1))

    mechanism = Mechanism(f'{channel}_sensor_offset', 'sensor', channel, (BY_RECORDING,), 'even')
    knots = list(range(len(errors)))
    return builder.hypothesis(
        mechanism, builder.place(channel, partial(apart, errors, ones), -1.0), [0] * len(knots),
        knots, detail={'told': partial(_lies, names_of(builder), unit, channel)})


def _rubs(names: Sequence[str], knots: Sequence[int], amplitudes: np.ndarray,
          servo: Servo) -> str:
    """Return how many times the friction of the file there is, in words."""
    said = between(names, knots, 1.0 + amplitudes, 'times that of the file')
    return said + within_one(knots, amplitudes, '')


def _lies(names: Sequence[str], unit: str, place: str, knots: Sequence[int],
          amplitudes: np.ndarray, servo: Servo) -> str:
    """Return between what a level lies, in words."""
    unit = servo.reads(unit, place)
    return between(names, knots, amplitudes, unit) + within_one(knots, amplitudes, unit)


def _beside(names: Sequence[str], unit: str, place: str, knots: Sequence[int],
            amplitudes: np.ndarray, servo: Servo) -> str:
    """Return between what lies what comes beside that of the file, in words."""
    unit = servo.reads(unit, place)
    return between(names, knots, amplitudes, f'{unit} beside the file') + within_one(
        knots, amplitudes, unit)


def _pulls(names: Sequence[str], knots: Sequence[int], amplitudes: np.ndarray,
           servo: Servo) -> str:
    """Return by how much a weight differs from that of the file, in words."""
    squares = np.bincount(knots, amplitudes**2)[np.asarray(knots)]
    unit = servo.reads('N m', 'load')
    return between(names, knots, np.sqrt(squares), f'{unit} beside that of the file')


def within_one(knots: Sequence[int], amplitudes: np.ndarray, unit: str) -> str:
    """
    Return how much a value changes within a recording, in words; '' where that is not asked.

    It is the second of the ``amplitudes`` of each recording, see :func:`with_changes`.
    """
    if len(set(knots)) == len(knots):
        return ''
    return f', and by {max(amplitudes[1::2], key=abs):.3g} {unit}'.rstrip() + ' within one'


def between(names: Sequence[str], knots: Sequence[int], values: np.ndarray, unit: str) -> str:
    """
    Return what is how large in which recordings, in words.

    The two values, where the recordings have one of two; else the least and the largest. ``names``
    are those of the recordings, ``knots`` (n,) the recording of each of the ``values`` (n,), of
    which the first of each recording counts.
    """
    of, first = np.unique(knots, return_index=True)
    order = np.argsort(values[first], kind='stable')
    sizes, several = values[first][order], [names[of[place]] for place in order]
    steps = np.diff(sizes)
    if len(sizes) > 2 and steps.max() >= SOLVED * (sizes[-1] - sizes[0]):
        cut = int(np.argmax(steps)) + 1
        groups = [(sizes[:cut], several[:cut]), (sizes[cut:], several[cut:])]
        (few, where), (many, _) = sorted(groups, key=lambda group: len(group[1]))
        return (f'in {", ".join(where)} {few.mean():.3g} {unit}'.rstrip()
                + f', in the others {many.mean():.3g}, by recording')
    span = ' to '.join(f'{sizes[k]:.3g} ({several[k]})' for k in (0, -1))
    return f'{span} {unit}'.rstrip() + ', by recording'
