r"""
Play from one recording that goes both ways, and its curve over what it is set by.

What is lost between the shafts, :math:`\theta_m / N - \theta_l`, is averaged in cells of the angle
of the load, forward and reverse apart. Forward less reverse is the backlash and what the teeth
wind up by the friction of the load, :math:`2 \tau_f / K`, which the servo file tells and which is
taken off. What the shape of the teeth loses is the same both ways. Holds where the motion is slow:
a load that its own inertia carries through the gap bears on neither flank.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Provenance, Servo, ServoError
from servo_twin.recording.parts import LongRecording, parts_of

from ...fit.segments import smoothed

CELLS, FEWEST = 40, 5  # of the angle that was passed; those that must be passed both ways
MOVING = 0.3  # share of the largest speed, below which teeth may be anywhere in the gap
LEAST = 20  # samples a cell and direction
AROUND, FILTERED = 1.0, 100  # s and samples around a part by which its speed is that of the whole
FASTEST = 300_000  # samples whose speeds tell which is the largest
ENCODERS = ('motor_position', 'load_position')
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


def measured_play(servo: Servo, recording: LongRecording) -> Play:
    """
    Measure the backlash of a recording that moved both ways over the same angles.

    The recording may be of any length: it is gone through twice, part by part. A short move has
    fewer and wider cells. Raises ValueError where an encoder is missing, or too little was passed
    both ways.
    """
    low, high, most = _travel(recording)
    counts, sums = np.zeros((2, CELLS)), np.zeros((2, CELLS))
    for load, motor, speed, kept in _moves(recording):
        lost = motor / servo.values['mechanism.ratio'] - load
        # a shaft that just set off has not bedded in: the first tenth of a second is left out
        still = ~(np.abs(speed) > MOVING * most)  # or unknown
        margin = 2 * round(0.1 / recording.period) + 1
        moved = np.isfinite(lost) & (np.convolve(still, np.ones(margin), 'same') < 0.5)
        for k, way in enumerate((1.0, -1.0)):
            at = np.flatnonzero(moved[kept] & (way * speed[kept] > MOVING * most)) + kept.start
            place = (load[at] - low) / max(high - low, 1e-12) * CELLS
            cell = np.minimum(place.astype(int), CELLS - 1)
            counts[k] += np.bincount(cell, minlength=CELLS)
            sums[k] += np.bincount(cell, lost[at], CELLS)
    widths = _widths(recording.name, counts, sums)
    passed, cells = np.isfinite(widths), len(widths)
    friction = _friction(servo, MOVING * most, most)
    wound = (2.0 * friction / servo.values['mechanism.stiffness']
             if servo.mechanism.compliant else 0.0)
    widths = widths[passed] - wound
    angles = (low + (np.arange(cells) + 0.5) * (high - low) / cells)[passed]
    varies = float(widths.std(ddof=1))
    return Play(float(widths.mean()), varies / np.sqrt(len(widths)), varies, wound, angles, widths)


def _moves(recording: LongRecording
           ) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, slice]]:
    """Yield load, motor (rad), speed of the load (rad/s) part by part, and which are its own."""
    around = round(AROUND / recording.period) + FILTERED
    for part in parts_of(recording):
        wide = recording.part(part.sequence - around, part.sequence + len(part) + around)
        first = part.sequence - wide.sequence
        load = wide['load_position']
        speed = np.gradient(smoothed(load, recording.period, 10.0), recording.period)
        yield load, wide['motor_position'], speed, slice(first, first + len(part))


def _travel(recording: LongRecording) -> tuple[float, float, float]:
    """
    Return the least and the largest angle of the load, rad, and its largest speed but for 2 %.

    Speeds, rad/s, are those of some FASTEST samples. Raises ValueError without both encoders.
    """
    low, high, speeds, known = np.inf, -np.inf, [], dict.fromkeys(ENCODERS, False)
    stride = -(-len(recording) // FASTEST)
    for load, motor, speed, kept in _moves(recording):
        for name, angle in zip(ENCODERS, (motor, load), strict=True):
            known[name] = known[name] or bool(np.isfinite(angle[kept]).any())
        low = float(np.fmin.reduce(load[kept], initial=low))
        high = float(np.fmax.reduce(load[kept], initial=high))
        speeds.append(np.abs(speed[kept])[::stride])
    for name in ENCODERS:
        if not known[name]:
            raise ValueError(f'{recording.name}: play needs both encoders, and {name} is missing')
    return low, high, float(np.nanpercentile(np.concatenate(speeds), 98.0))


def _widths(name: str, counts: np.ndarray, sums: np.ndarray) -> np.ndarray:
    """
    Return forward less reverse by cell, NaN where too few samples; shape (cells,).

    ``counts`` and ``sums`` of what is lost between the shafts, shape (2, CELLS). Cells are joined
    by two until enough were passed both ways; raises ValueError where that does not help.
    """
    while True:
        with np.errstate(invalid='ignore', divide='ignore'):
            forward, reverse = np.where(counts >= LEAST, sums / counts, np.nan)
        both = int(np.isfinite(forward - reverse).sum())
        cells = counts.shape[1]
        if both >= FEWEST:
            return np.asarray(forward - reverse)
        if cells < 2 * FEWEST:
            raise ValueError(f'{name}: {both} of {cells} cells of the load angle were passed both '
                             f'ways, with {LEAST} samples each; {FEWEST} are needed')
        counts, sums = (one.reshape(2, -1, 2).sum(2) for one in (counts, sums))


def _friction(servo: Servo, slow: float, fast: float) -> float:
    """Return the steady friction at the load, N m, that the servo file knows of."""
    total = 0.0
    for placed in servo.effects:
        if placed.site == 'load' and placed.effect.name == 'coulomb_friction':
            total += servo.values[f'effects.{placed.name}.level']
        elif placed.site == 'load' and placed.effect.name == 'viscous_friction':
            total += servo.values[f'effects.{placed.name}.slope'] * 0.5 * (slow + fast)
    return total


def slide_of(servo: Servo, *settings: float) -> str:
    """
    Return the name of the effect carrier_backlash of a servo.

    Raises ServoError that says how the file gets one, with the first of the ``settings``, m.
    """
    placed = [p.name for p in servo.effects if p.effect.name == 'carrier_backlash']
    if placed:
        return placed[0]
    others = [p.name for p in servo.effects if p.effect.port == 'clearance']
    instead = f', in place of {", ".join(others)}' if others else ''
    setting = settings[0] if settings else find('carrier_backlash').parameters['setting'].default
    raise ServoError(
        f'{servo.name} has no effect carrier_backlash to hold the curve; add the next line to the '
        f'section effects of its file{instead}, with the setting of your slide:\n'
        f'  slide: {{effect: carrier_backlash, at: mesh, setting: {{value: {setting:g}, unit: m, '
        "source: 'read off the slide'}, widths: {value: [0.0, 0.0], unit: rad, source: 'to be "
        "measured'}}")


def with_curve(servo: Servo, plays: Mapping[float, Play], bags: Sequence[str]) -> Servo:
    """
    Return the servo with the backlash over the setting of its slide, m, as measured in bags.

    Raises ServoError as slide_of() does, and where fewer than two settings were measured.
    """
    slide = slide_of(servo, *plays)
    if len(plays) < 2:
        raise ServoError(f'{servo.name}: a curve needs play at two settings, not at {len(plays)}')
    settings = tuple(sorted(plays))
    path = f'effects.{slide}'
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
