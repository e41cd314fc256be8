r"""
The factor by which a reference is off, whatever it is, by two equations without an unknown.

.. math:: r = f \int \dot r \, dt + z, \qquad \theta_l = g\,r + z, \quad \dot\theta_l = g\,\dot r

Two columns of one log tell f, which is 1. A loop makes g near 1, and may follow badly. Both
are looked at only where the two sides differ by less than a tenth in their form: a loop that
lags, an axis that sticks and a reference that hardly moves say nothing. Where the command was
recorded, the law of the controller tells the factor however well the loop follows
(:mod:`.control_law`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, log, sqrt

import numpy as np
from scipy.integrate import cumulative_trapezoid

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .control_law import factors_by_law
from .finding import Finding, said_once
from .likelihood import SAMPLES, WEAK
from .mistakes import MISTAKE, mistakes, REFERENCES, unread
from .plausibility import FURTHEST
from .rough_balances import SAME
from .shown_ratio import FORM
from .signals import ANGLES, bridged, Signals

Seen = Sequence[tuple[Recording, Signals]]


@dataclass(frozen=True)
class Off:
    """
    A reference of one recording that is ``factor`` times what the angle does.

    ``beside`` is its factor to the other reference, 1 where there is none or both agree. ``sure``
    says that nothing but a wrong unit or scale explains it. ``by_law``: the law of the controller
    tells the factor.
    """

    recording: str
    channel: str
    factor: float
    beside: float
    sure: bool
    by_law: bool = False


def off_references(usable: Seen, servo: Servo, sure: float) -> list[Off]:
    """
    Return the references that are off by a factor, of each recording with its channels.

    ``sure``, nats, is by how much such a factor must beat a factor of 1, its rarity counted.
    References that the controller of the servo does not read are left out.
    """
    skipped = unread(servo)
    return [off for one, at in usable for off in _of_one(one, at, servo, sure)
            if off.channel not in skipped]


def reference_findings(off: Sequence[Off]) -> list[Finding]:
    """Return a sentence for each reference that is off, with the factor nearest to 1."""
    found = []
    for channel in dict.fromkeys(one.channel for one in off):
        several = [one for one in off if one.channel == channel]
        least = min(several, key=lambda one: abs(log(one.factor)))
        said = f'{channel} is {least.factor:.3g} times what ' + (
            'the controller of the servo file makes the command of' if least.by_law else
            'the angle follows')
        if least.beside != 1.0:
            other, = set(REFERENCES) - {channel}
            said += (f', and {least.beside:.3g} times what {other} says'
                     if channel == 'reference_position' else
                     f', and {least.beside:.3g} times the rate of {other}')
        fits = 1.0 / (least.factor if least.beside == 1.0 else least.beside)
        level = 'red' if all(one.sure for one in several) else 'amber'
        doubt = '' if level == 'red' else ': is it in another unit?'
        sentence, = said_once((one.recording, said + (doubt or '.')) for one in several)
        found.append(Finding(level, sentence, 'correct its unit or its scale in the mapping: '
                             f'{fits:.3g} times these numbers would fit',
                             several[0].recording if len(several) == 1 else ''))
    return found


def unnamed(off: Sequence[Off], servo: Servo) -> bool:
    """
    Tell whether a factor is surely shown which is that of no mistake with a name.

    By two columns, or by the law of the controller, where the angle may be off instead.
    """
    named = [(name, abs(factor)) for one in mistakes((*ANGLES, *REFERENCES), servo)
             for name, factor in one.factors.items()]
    return any(one.sure and (
        one.by_law and not any(abs(log(one.factor * (
            factor if name == one.channel else 1.0 / factor))) < SAME
            for name, factor in named if name in (one.channel, *ANGLES))
        or one.beside != 1.0 and not any(
            name == one.channel and abs(log(one.beside * factor)) < SAME / 3.0
            for name, factor in named)) for one in off)


def _of_one(one: Recording, at: Signals, servo: Servo, sure: float) -> list[Off]:
    moved = _moved(at, servo)
    follows = {name: factor for name, (factor, open_) in moved.items() if open_ < FORM**2}
    apart, open_ = _beside(one)
    nats = 0.5 * log(apart)**2 / ((SAME / 3.0)**2 + open_ / SAMPLES)
    if open_ > FORM**2 or nats < sure + MISTAKE or not moved:
        by_law = [Off(one.name, name, told.factor, 1.0, True, True)
                  for name, told in factors_by_law(one, servo).items()
                  if 0.5 * log(told.factor)**2 / ((SAME / 3.0)**2 + told.variance)
                  > sure + MISTAKE]
        if open_ < FORM**2 and len(by_law) == 1:
            by_law = []  # the other reference says the same: a gain of the controller is off
        furthest = exp(SAME * sqrt(2.0 * (sure + MISTAKE))) if _integrates(servo) else FURTHEST
        return by_law or [
            Off(one.name, name, 1.0 / value, 1.0, _doubt(value) > sure + MISTAKE)
            for name, value in follows.items() if not 1.0 / furthest < value < furthest]
    # of a reference that is not followed in form, its share is that of the other and their factor
    known, value = next(iter((follows or {name: factor for name, (factor, _) in moved.items()}
                              ).items()))
    step = apart if known == 'reference_position' else 1.0 / apart
    other, = set(REFERENCES) - {known}
    shares = {known: value, other: value * step}
    worst = max(shares, key=lambda name: _doubt(shares[name]))
    best, = set(shares) - {worst}
    return [Off(one.name, worst, 1.0 / shares[worst],
                apart if worst == 'reference_position' else 1.0 / apart,
                bool(follows) and _doubt(shares[worst]) - _doubt(shares[best]) > sure)]


def _integrates(servo: Servo) -> bool:
    """Tell whether the loop leaves no error that stays: one that lags is not alike in form."""
    return bool(servo.values.get('controller.ki', 0.0))


def _doubt(followed: float) -> float:
    """Return the nats that a loop costs which goes so many times as far as its reference."""
    return 0.5 * (log(followed) / WEAK)**2


def _moved(at: Signals, servo: Servo) -> Mapping[str, tuple[float, float]]:
    """Return how far, and how fast, the angle goes of each reference; what that leaves of it."""
    found = {name: shared_form(motion, at.plain[name])
             for name, motion in motions(at, servo).items()
             if name in at.plain and name not in at.silent}
    return {name: told for name, told in found.items() if told[1] < 1.0}


def motions(at: Signals, servo: Servo) -> dict[str, np.ndarray]:
    """Return angle and speed at the load by the reference that each follows; {} without angle."""
    side = 'load_position' if 'load_position' in at.plain else 'motor_position'
    if side not in at.plain:
        return {}
    per = 1.0 if side == 'load_position' else 1.0 / servo.values['mechanism.ratio']
    return dict(zip(REFERENCES, (per * at.plain[side], per * at.speed[side]), strict=True))


def _beside(one: Recording) -> tuple[float, float]:
    """Return how many times as far the reference goes as its speed says; what that leaves."""
    if not all(one.has(name) for name in REFERENCES):
        return 1.0, 1.0
    place, speed = (bridged(one[name]) for name in REFERENCES)
    return shared_form(place, cumulative_trapezoid(speed, dx=one.period, initial=0.0))


def shared_form(seen: np.ndarray, of: np.ndarray) -> tuple[float, float]:
    """Return the factor between two motions, and the share of squares that they differ by."""
    seen, of = seen - seen.mean(), of - of.mean()
    sizes = float(np.linalg.norm(seen)), float(np.linalg.norm(of))
    if not min(sizes) > 0.0:
        return 1.0, 1.0
    alike = float(seen @ of) / (sizes[0] * sizes[1])
    return (sizes[0] / sizes[1], 1.0 - alike**2) if alike > 0.0 else (1.0, 1.0)
