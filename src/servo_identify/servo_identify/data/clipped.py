"""
Readings that are clipped: a sensor, or a drive, that ends at a constant.

A clipped channel repeats its largest value, and no other one, row by row. The top of a wave that
was rounded repeats its value as well, but comes to it and leaves it within a few steps.
"""

from __future__ import annotations

from math import log

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import COLUMNS, Recording

from .finding import Finding
from .looked_over import SURE
from .mistakes import DEGREE, MISTAKE
from .signals import ANGLES

WHOLE, EXACT = 100.0, 1e-6  # what a share of the travel ends at, and how closely
SEVERAL = 3  # samples that are there
LIMITED = 0.02  # share within which a value is that of a limit which the servo file has


def clipped_findings(one: Recording, servo: Servo) -> list[Finding]:
    """Return which measured channels of a recording end at a constant that no limit explains."""
    found = []
    for name in ('current', 'torque'):
        shares = {value: share for value, share in clipped(one[name]).items()
                  if not (name == 'current' and _limited(value, servo))}
        if shares:
            at = ' and '.join(f'{value:.4g}' for value in shares)
            found.append(Finding(
                'amber', f'{one.name}: {name} stays at {at} {servo.reads(COLUMNS[name], name)} in '
                f'{100.0 * sum(shares.values()):.2g} % of the samples and never goes beyond: is '
                'it clipped?', 'take a sensor of a larger range or a smaller motion; where the '
                'drive limits its current, give the limit in the servo file', one.name))
    return found


def normalised_findings(one: Recording) -> list[Finding]:
    """Return which angles end at exactly 100, as what was brought to -100 to 100 or 0 to 100."""
    found = []
    for name in (*ANGLES, 'reference_position'):
        x = one[name][np.isfinite(one[name])]
        most = float(np.max(np.abs(x), initial=0.0))
        unit = next((unit for unit, size in (('rad', 1.0), ('deg', DEGREE))
                     if abs(most / size - WHOLE) < EXACT * WHOLE), '')
        if unit and np.sum(np.abs(np.abs(x) - most) < EXACT * most) >= SEVERAL:
            found.append(Finding(
                'amber', f'{one.name}: {name} ends at exactly {WHOLE:g} {unit}: is it a share of '
                'the travel, -100 to 100 or 0 to 100, as LeRobot stores it?',
                'give what 1 of it is in rad in the mapping, scale: (half the travel, or all of '
                'it, over 100), or record degrees', one.name))
    return found


def clipped(values: np.ndarray) -> dict[float, float]:
    """Return the largest and least value of a channel where it is clipped, with their shares."""
    x = values[np.isfinite(values)]
    steps = np.abs(np.diff(x))
    if not steps.any():
        return {}
    again, resolution, found = steps == 0.0, float(steps[steps > 0.0].min()), {}
    for extreme in (float(x.max()), float(x.min())):
        there = x == extreme
        at_end = there[1:] & there[:-1]
        usual = (np.sum(again & ~at_end) + 1.0) / (np.sum(~at_end) + 2.0)
        if extreme and -np.sum(at_end) * log(usual) > SURE + MISTAKE and (
                _sharp(x, there, resolution)):
            found[extreme] = float(np.mean(there))
    return found


def _sharp(x: np.ndarray, there: np.ndarray, resolution: float) -> bool:
    """
    Tell whether flat ends fall off sharper than the rounded top of a parabola, in the median.

    That one has a height of one step over its width w, and falls by 4 d/w (1 + d/w) of them within
    d rows beside it.
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([0], there.astype(int), [0]))))
    sharp = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        width = end - begin
        beside = (slice(max(begin - width, 0), begin), slice(end, end + width))
        falls = [np.max(np.abs(x[rows] - x[begin]))
                 / (1.0 + 4.0 * len(x[rows]) / width * (1.0 + len(x[rows]) / width))
                 for rows in beside if len(x[rows])]
        if width > 1 and falls:
            sharp.append(min(falls))
    return bool(sharp) and float(np.median(sharp)) > resolution


def _limited(value: float, servo: Servo) -> bool:
    """Tell whether a current is that at which the servo file limits it."""
    told = servo.drive.name in ('current_drive', 'current_amplifier')
    gain = servo.values['drive.gain'] if told else 0.0
    limits = [servo.values.get('drive.current_limit', 0.0),
              *(gain * servo.values.get(f'effects.{placed.name}.limit', 0.0)
                for placed in servo.effects if placed.effect.name == 'drive_saturation'),
              gain * servo.values.get('controller.limit', 0.0)]
    return any(abs(abs(value) / abs(limit) - 1.0) < LIMITED for limit in limits if limit)
