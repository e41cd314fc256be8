"""What is said before a diagnosis costs a minute: recordings that cannot be judged."""

from __future__ import annotations

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ..data.finding import each_once, Finding
from ..data.recording_check import SATURATED
from ..data.survey import share_at_limit

SHORTEST = 3.0  # s


class CannotDiagnose(ValueError):
    """Recordings or a servo that allow no verdict; the message says why and what would help."""


def check(recordings: list[Recording], servo: Servo) -> list[str]:
    """Return warnings; raises CannotDiagnose when no verdict is possible."""
    warnings = []
    machines = {r.servo for r in recordings if r.servo}
    if len(machines) > 1:
        raise CannotDiagnose(f'recordings of different machines: {sorted(machines)}; '
                             'a diagnosis takes those of one')
    if machines and servo.name not in machines:
        warnings.append(f'the recordings are of {machines.pop()!r}, the servo file is of '
                        f'{servo.name!r}')
    warnings += [one.sentence for one in each_once([
        Finding('amber', f'{one.name}: {said}', recording=one.name)
        for one in recordings for said in one.warnings])]
    _same_channels(recordings, warnings)
    return warnings


def usable(recordings: list[Recording], servo: Servo) -> tuple[list[Recording], list[str]]:
    """
    Return the recordings that can be judged, and why others are left out.

    Raises CannotDiagnose when none is left.
    """
    kept, said = [], []
    driven = any(one.driven for one in recordings)
    for one in recordings:
        reason = _refused(one, servo, driven)
        if reason:
            said.append(f'{one.name}: {reason}')
        else:
            kept.append(one)
    if not kept:
        raise CannotDiagnose(said[0] if said else 'no recordings: name at least one bag')
    return kept, [f'left out: {reason}' for reason in said]


def _refused(one: Recording, servo: Servo, driven: bool) -> str:
    """
    Return why a recording cannot be judged, empty where it can.

    ``driven``: some recordings say what drives the motor. Where none does, two encoders tell the
    transmission between them.
    """
    if one.duration < SHORTEST:
        return f'lasts {one.duration:.2f} s; at least {SHORTEST:g} s are needed'
    encoders = [n for n in ('motor_position', 'load_position') if one.has(n)]
    if not encoders:
        return 'neither motor_position nor load_position holds a number'
    if not one.driven and (driven or len(encoders) < 2):
        among = ', as it does in others' if driven else ''
        more = '' if driven else '; two encoders would tell the transmission alone'
        return f'neither voltage nor current holds a number{among}, so nothing drives a twin{more}'
    moved = max(float(np.nanmax(one[n]) - np.nanmin(one[n])) for n in encoders)
    steps = np.abs(np.diff(one[encoders[0]]))
    smallest = float(np.min(steps[steps > 0.0], initial=np.inf))
    if not np.isfinite(smallest) or moved < 20.0 * smallest:
        return (f'nothing moves ({moved:.3g} rad in {one.duration:.0f} s); without excitation '
                'there is no verdict')
    limit, share = share_at_limit(one, servo)
    if share > SATURATED:
        return (f'the command is at its limit of {limit:g} V in {100 * share:.0f} % of the '
                'samples; record with a smaller reference')
    return ''


def _same_channels(recordings: list[Recording], warnings: list[str]) -> None:
    for channel in ('motor_position', 'load_position', 'torque', 'current'):
        having = [r.name for r in recordings if r.has(channel)]
        if having and len(having) < len(recordings):
            lacking = [r.name for r in recordings if not r.has(channel)]
            warnings.append(f'{channel} is missing in {", ".join(lacking)}')
