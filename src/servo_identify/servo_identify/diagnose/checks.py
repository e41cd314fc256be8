"""What is said before a diagnosis costs a minute: recordings that cannot be judged."""

from __future__ import annotations

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

SHORTEST = 3.0  # s
SATURATED = 0.6  # share of samples at the largest command


class CannotDiagnose(ValueError):
    """Recordings or a servo that allow no verdict; the message says why and what would help."""


def check(recordings: list[Recording], servo: Servo) -> list[str]:
    """Return warnings; raises CannotDiagnose when no verdict is possible."""
    if not recordings:
        raise CannotDiagnose('no recordings: name at least one bag')
    warnings = []
    machines = {r.servo for r in recordings if r.servo}
    if len(machines) > 1:
        raise CannotDiagnose(f'recordings of different machines: {sorted(machines)}; '
                             'a diagnosis takes those of one')
    if machines and servo.name not in machines:
        warnings.append(f'the recordings are of {machines.pop()!r}, the servo file is of '
                        f'{servo.name!r}')
    for one in recordings:
        _check_one(one, servo, warnings)
    _same_channels(recordings, warnings)
    return warnings


def _check_one(one: Recording, servo: Servo, warnings: list[str]) -> None:
    if one.duration < SHORTEST:
        raise CannotDiagnose(f'{one.name} lasts {one.duration:.2f} s; at least {SHORTEST:g} s '
                             'are needed')
    encoders = [n for n in ('motor_position', 'load_position') if one.has(n)]
    if not encoders:
        raise CannotDiagnose(f'{one.name}: neither motor_position nor load_position holds a '
                             'number')
    if not (one.has('voltage') or one.has('current')):
        more = ('; what two encoders tell alone, the lost motion, `servo-identify play` measures'
                if len(encoders) > 1 else '')
        raise CannotDiagnose(f'{one.name}: neither voltage nor current holds a number, so nothing '
                             f'drives a twin{more}')
    moved = max(float(np.nanmax(one[n]) - np.nanmin(one[n])) for n in encoders)
    steps = np.abs(np.diff(one[encoders[0]]))
    smallest = float(np.min(steps[steps > 0.0], initial=np.inf))
    if not np.isfinite(smallest) or moved < 20.0 * smallest:
        raise CannotDiagnose(f'{one.name}: nothing moves ({moved:.3g} rad in {one.duration:.0f} '
                             's); without excitation there is no verdict')
    warnings += [f'{one.name}: {w}' for w in one.warnings]


def _same_channels(recordings: list[Recording], warnings: list[str]) -> None:
    for channel in ('motor_position', 'load_position', 'torque', 'current'):
        having = [r.name for r in recordings if r.has(channel)]
        if having and len(having) < len(recordings):
            lacking = [r.name for r in recordings if not r.has(channel)]
            warnings.append(f'{channel} is missing in {", ".join(lacking)}')


def unsaturated(recordings: list[Recording], servo: Servo) -> tuple[list[Recording], list[str]]:
    """
    Return the recordings whose command is not at its limit throughout, and why others are not.

    Raises CannotDiagnose when none is left.
    """
    limit = servo.values.get('controller.limit') or np.inf
    kept, said = [], []
    for one in recordings:
        command = np.abs(one['voltage'][np.isfinite(one['voltage'])])
        share = float(np.mean(command >= 0.999 * limit)) if len(command) else 0.0
        if share <= SATURATED:
            kept.append(one)
            continue
        said.append(f'{one.name}: the command is at its limit of {limit:g} V in '
                    f'{100 * share:.0f} % of the samples; record with a smaller reference')
    if said and not kept:
        raise CannotDiagnose(said[0])
    return kept, [f'left out: {reason}' for reason in said]
