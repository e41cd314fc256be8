"""
The job that judges a new servo file against the old: `... live.compare_job OLD NEW BAG`.

Both run over the same recording under its measured input. Each balance counts by its root mean
square, in noise floors of the old one and at least one; all together by the geometric mean, so
that a balance that either misses by far does not hide the others.

What is lost between the shafts hangs on where the load stands to a fraction of a tooth, and a twin
that runs freely is soon elsewhere. The balances of the transmission and of the load encoder are
therefore taken from twins that an observer keeps at the rig's angles. They compare angles of both
shafts with the torque between them, which the observer's correction does not enter. The zeros of
the encoders are arbitrary, so the mean of the transmission's balance does not count.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
import sys

import numpy as np

from servo_twin.bag import read_recording
from servo_twin.description import servo_file
from servo_twin.lockstep.lockstep import Settings
from servo_twin.lockstep.whole_recording import answer
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import BALANCES, Recording

from .job_process import refused, report

_BY_ANGLE = ('transmission', 'sensor')


@dataclass(frozen=True)
class Judgement:
    """Root mean squares in noise floors, old and new: geometric mean, and that of each."""

    old: float
    new: float
    balances: dict[str, tuple[float, float]]


def judge(old: Servo, new: Servo, recording: Recording) -> Judgement:
    """
    Compare two servos on a recording.

    Raises ValueError when they share no balance that the recording can say something about.
    """
    free = [answer(recording, servo) for servo in (old, new)]
    held = free
    if np.isfinite([_rms(a.residual['transmission']) for a in free]).all():
        held = [answer(recording, servo, Settings(mode='observer')) for servo in (old, new)]
    floor = free[0].balance_noise
    found = {}
    for k, name in enumerate(BALANCES):
        answers = held if name in _BY_ANGLE else free
        sizes = [_rms(a.residual[name], name == 'transmission') * a.balance_noise[k] / floor[k]
                 for a in answers]
        if np.isfinite(sizes).all():
            found[name] = tuple(sizes)
    if not found:
        raise ValueError(f'{recording.name}: no balance can be judged by it')
    both = np.exp(np.log(np.maximum(list(found.values()), 1.0)).mean(axis=0))
    return Judgement(float(both[0]), float(both[1]), found)


def _rms(values: np.ndarray, about_mean: bool = False) -> float:
    good = values[np.isfinite(values)]
    if not len(good):
        return float('nan')
    return sqrt(float(np.square(good - good.mean() if about_mean else good).mean()))


def main(arguments: list[str]) -> int:
    """Judge; where that cannot be, tell why, with status 2."""
    try:
        old, new = (servo_file.load(path) for path in arguments[:2])
        judgement = judge(old, new, read_recording(arguments[2]))
    except (ValueError, OSError) as problem:
        return refused(problem)
    report(old=judgement.old, new=judgement.new, balances=judgement.balances)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
