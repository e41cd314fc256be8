"""
The models of a harmonic drive, fitted to one rig and ranked by the gap that each leaves.

The models are those of paper 004 and the linear one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
import time

import numpy as np

from servo_twin.physics.element_names import split_name
from servo_twin.physics.fixed_inertia import with_fixed_inertia
from servo_twin.physics.harmonic_drive_models import HARMONIC_DRIVES, NAMES, with_harmonic_drive
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ..diagnose.handover.gap import Gap, shrink, shrink_interval
from ..diagnose.handover.simulated_gap import Diverged, simulated
from ..fit.output_error import fit

LINEAR = 'linear'
ITERATIONS = 10
HORIZON = 0.4  # s of free run between two starts
WORKERS = 2  # processes that fit side by side
FIXED = ('order', 'lag', 'exponent')
"""
What is not fitted of a model: an order is counted, the lag of presliding is not seen, and the
exponent of Stribeck friction is that of its author.
"""

Told = Callable[[str, float], None]


@dataclass(frozen=True)
class Ranked:
    """
    One model after its fit, over recordings that it was not fitted to.

    ``gap`` is the root mean square error over channels, each as a share of its signal; ``shrink``
    what of the linear model's gap above the noise is gone, ``interval`` (90 %) by recordings drawn
    again; ``errors`` by channel in its unit; ``free`` how many numbers were fitted.
    """

    name: str
    title: str
    servo: Servo
    gap: float
    shrink: float
    interval: tuple[float, float]
    errors: Mapping[str, float]
    free: int
    seconds: float


def models() -> dict[str, str]:
    """Return names and titles of all that is ranked."""
    return {LINEAR: 'linear (section II E)',
            **{name: one.title for name, one in HARMONIC_DRIVES.items()}}


def freed(servo: Servo) -> tuple[str, ...]:
    """Return what is fitted: what has a tolerance, and what the model of the drive says."""
    own = tuple(path for path in servo.values if path.startswith('effects.')
                and path.split('.')[1] in NAMES and path.split('.')[2] not in FIXED)
    told = {split_name(name)[0] for name in servo.tolerance}
    return tuple(servo.tolerance) + tuple(path for path in own if path not in told)


def coupled_angle(recordings: Sequence[Recording]) -> float:
    """
    Return where the other axis stands in recordings, rad; 0 where none is recorded.

    Raises ValueError where it moves: friction and mesh are judged with one inertia.
    """
    seen = [r['coupled_position'] for r in recordings if r.has('coupled_position')]
    if not seen:
        return 0.0
    angles = np.concatenate(seen)
    if np.nanmax(angles) - np.nanmin(angles) > 0.02:
        raise ValueError(f'the other axis moves over {np.nanmax(angles) - np.nanmin(angles):.3g} '
                         'rad in these recordings; models are compared with it at rest')
    return float(np.nanmean(angles))


def ranked(servo: Servo, training: Sequence[Recording], held_out: Sequence[Recording],
           told: Told = lambda what, share: None, names: Sequence[str] = ()) -> list[Ranked]:
    """
    Fit every model to ``training`` and rank them over ``held_out``, the best first.

    ``names``: which, all when empty; the linear one is always among them. Raises ValueError for
    recordings that cannot be fitted or names that are none.
    """
    names = tuple(dict.fromkeys((LINEAR, *(names or models()))))
    unknown = [name for name in names if name not in models()]
    if unknown:
        raise ValueError(f'there is no model {unknown[0]!r}; there are {list(models())}')
    servo = with_fixed_inertia(servo, coupled_angle([*training, *held_out]))
    fitted: dict[str, tuple[Servo, int, float]] = {}
    with ProcessPoolExecutor(WORKERS, get_context('spawn')) as pool:
        jobs = {name: pool.submit(_fitted, with_harmonic_drive(
            servo, None if name == LINEAR else name), list(training)) for name in names}
        for k, (name, job) in enumerate(jobs.items()):
            told(models()[name], k / len(names))
            fitted[name] = job.result()
    return judged(fitted, held_out)


def judged(fitted: Mapping[str, tuple[Servo, int, float]], held_out: Sequence[Recording]
           ) -> list[Ranked]:
    """
    Rank servos over recordings, the best first.

    ``fitted``: by name the servo, how many numbers were fitted and the seconds it took; the linear
    one is what the others are measured against. Raises ValueError where that one cannot be run.
    """
    linear = fitted[LINEAR][0]
    reference = _gap(linear, held_out)
    if reference is None:
        raise ValueError(f'{linear.name}: the linear model leaves the finite numbers on the held '
                         'out recordings; there is nothing to compare with')
    answers = []
    for name, (found, free, seconds) in fitted.items():
        gap = reference if name == LINEAR else _gap(found, held_out)
        if gap is None:
            left, gone, interval, errors = np.inf, -np.inf, (-np.inf, -np.inf), {}
        else:
            left, gone = gap.total(excess=False), shrink(reference, gap)
            interval = shrink_interval(reference, gap)
            errors = {channel: gap.rms(channel) for channel in gap.squares}
        answers.append(Ranked(name, models()[name], found, left, gone, interval, errors, free,
                              seconds))
    return sorted(answers, key=lambda one: one.gap)


def _fitted(start: Servo, training: Sequence[Recording]) -> tuple[Servo, int, float]:
    """Return a model after its fit, how many numbers were free, and the seconds it took."""
    begun = time.perf_counter()
    free = freed(start)
    found = fit(start, training, free, horizon=HORIZON, iterations=ITERATIONS).servo
    return found, len(free), time.perf_counter() - begun


def _gap(servo: Servo, recordings: Sequence[Recording]) -> Gap | None:
    """Return the gaps of a servo as it is; None where it leaves the finite numbers."""
    try:
        return simulated(servo, recordings).gap
    except Diverged:
        return None
