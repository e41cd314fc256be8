r"""
Play from one recording that goes both ways, and its curve over what it is set by.

What is lost between the shafts, :math:`\theta_m / N - \theta_l`, is averaged in cells of the angle
of the load, forward and reverse apart. Forward less reverse is the backlash and what the teeth
wind up by the friction of the load, :math:`2 \tau_f / K`, which the servo file tells and which is
taken off. What the shape of the teeth loses is the same both ways. Holds where the motion is slow:
a load that its own inertia carries through the gap bears on neither flank.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from servo_twin.physics.servo import Provenance, Servo, ServoError
from servo_twin.recording.recording import Recording

from ...fit.segments import smoothed

CELLS, FEWEST = 40, 5  # of the angle that was passed; those that must be passed both ways
MOVING = 0.3  # share of the largest speed, below which teeth may be anywhere in the gap
LEAST = 20  # samples a cell and direction
SHY = 1e-4  # of the prior that holds the variation over the turn small, against one cell


@dataclass(frozen=True)
class Play:
    """
    The backlash in one recording, rad at the load.

    ``width`` its mean over the cells that were passed both ways, ``std`` the standard error of
    that mean, ``varies`` its standard deviation from cell to cell, ``wound`` what the teeth wind
    up between the two directions (not part of ``width``). ``angles`` and ``widths`` of shape
    (cells,): the middle of each cell, rad at the load, and the backlash there.
    """

    width: float
    std: float
    varies: float
    wound: float
    angles: np.ndarray
    widths: np.ndarray


def measured_play(servo: Servo, recording: Recording, cells: int = CELLS) -> Play:
    """
    Measure the backlash of a recording that moved both ways over the same angles.

    ``cells`` is how many there are at most: a short move has fewer and wider ones.
    Raises ValueError where an encoder is missing, or too little was passed both ways.
    """
    for column in ('motor_position', 'load_position'):
        if not recording.has(column):
            raise ValueError(f'{recording.name}: play needs both encoders, and {column} is '
                             'missing')
    value, load = servo.values, recording['load_position']
    lost = recording['motor_position'] / value['mechanism.ratio'] - load
    speed = np.gradient(smoothed(load, recording.period, 10.0), recording.period)
    most = np.nanpercentile(np.abs(speed), 98.0)
    way = np.where(speed > MOVING * most, 1, np.where(speed < -MOVING * most, -1, 0))
    # a shaft that just set off has not bedded in: the first tenth of a second is left out
    margin = 2 * round(0.1 / recording.period) + 1
    moved = np.convolve(way == 0, np.ones(margin), 'same') < 0.5
    low, high = np.nanmin(load), np.nanmax(load)
    while True:
        cell = np.minimum(((load - low) / max(high - low, 1e-12) * cells).astype(int), cells - 1)
        means = [_means(lost, cell, moved & (way == direction), cells) for direction in (1, -1)]
        widths = means[0] - means[1]
        both = int(np.isfinite(widths).sum())
        if both >= FEWEST:
            break
        if cells < 2 * FEWEST:
            raise ValueError(f'{recording.name}: {both} of {cells} cells of the load angle were '
                             f'passed both ways, with {LEAST} samples each; {FEWEST} are needed')
        cells //= 2
    passed = np.isfinite(widths)
    friction = _friction(servo, MOVING * float(most), float(most))
    wound = 2.0 * friction / value['mechanism.stiffness'] if servo.mechanism.compliant else 0.0
    widths = widths[passed] - wound
    angles = (low + (np.arange(cells) + 0.5) * (high - low) / cells)[passed]
    varies = float(widths.std(ddof=1))
    return Play(float(widths.mean()), varies / np.sqrt(len(widths)), varies, wound, angles, widths)


def _means(values: np.ndarray, cell: np.ndarray, at: np.ndarray, cells: int) -> np.ndarray:
    """Return the mean of values by cell, over some rows; NaN where they are too few."""
    count = np.bincount(cell[at], minlength=cells)
    with np.errstate(invalid='ignore', divide='ignore'):
        return np.where(count >= LEAST, np.bincount(cell[at], values[at], cells) / count, np.nan)


def _friction(servo: Servo, slow: float, fast: float) -> float:
    """Return the steady friction at the load, N m, that the servo file knows of."""
    total = 0.0
    for placed in servo.effects:
        if placed.site == 'load' and placed.effect.name == 'coulomb_friction':
            total += servo.values[f'effects.{placed.name}.level']
        elif placed.site == 'load' and placed.effect.name == 'viscous_friction':
            total += servo.values[f'effects.{placed.name}.slope'] * 0.5 * (slow + fast)
    return total


def with_curve(servo: Servo, plays: Mapping[float, Play], bags: Sequence[str]) -> Servo:
    """
    Return the servo with the backlash over the setting of its slide, m, as measured in bags.

    Raises ServoError where the servo has no effect carrier_backlash, or fewer than two settings
    were measured.
    """
    placed = [p.name for p in servo.effects if p.effect.name == 'carrier_backlash']
    if not placed:
        raise ServoError(f'{servo.name} has no effect carrier_backlash; it has '
                         f'{[p.effect.name for p in servo.effects]}')
    if len(plays) < 2:
        raise ServoError(f'{servo.name}: a curve needs play at two settings, not at {len(plays)}')
    settings = tuple(sorted(plays))
    path = f'effects.{placed[0]}'
    constant, cosine, sine = _over_the_turn([plays[s] for s in settings])
    widths = tuple(max(0.0, plays[s].width * constant) for s in settings)
    worst = max(plays[s].std for s in settings)
    said = Provenance('play of recordings that go both ways', worst, tuple(bags))
    shape = Provenance('play of recordings that go both ways', None, tuple(bags))
    return replace(servo, values={**servo.values, f'{path}.settings': settings,
                                  f'{path}.widths': widths, f'{path}.cosine': cosine,
                                  f'{path}.sine': sine},
                   provenance={**servo.provenance, f'{path}.widths': said,
                               f'{path}.settings': Provenance('settings of the bench'),
                               f'{path}.cosine': shape, f'{path}.sine': shape})


def _over_the_turn(plays: Sequence[Play]) -> tuple[float, float, float]:
    """
    Return how play varies over the turn: a factor of the mean, and relative cosine and sine.

    One shape for all settings, each counting as its backlash is wide. On a small arc a cosine is
    hardly different from a constant: it is held small by a weak prior.
    """
    size = np.concatenate([np.full(len(p.widths), abs(p.width)) for p in plays])
    angle = np.concatenate([p.angles for p in plays])
    ratio = np.concatenate([p.widths for p in plays]) / np.maximum(size, 1e-12)
    weight = size / size.max()
    design = np.column_stack([np.ones(len(angle)), np.cos(angle), np.sin(angle)])
    prior = np.diag([0.0, SHY, SHY]) * len(angle)
    normal = design.T @ (weight[:, None] * design) + prior
    constant, cosine, sine = np.linalg.solve(normal, design.T @ (weight * ratio))
    return float(constant), float(cosine / constant), float(sine / constant)
