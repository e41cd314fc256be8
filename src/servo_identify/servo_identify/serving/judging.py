"""
The job that judges a new servo file against the old: `... serving.judging OLD NEW BAG`.

Both run over the same recording under its measured input. Each balance counts by its root mean
square, in noise floors of the old one and at least one; all together by the geometric mean, so
that a balance that either misses by far does not hide the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
import sys

import numpy as np

from servo_twin import servo_file
from servo_twin.answering import answer
from servo_twin.bag import read_recording
from servo_twin.physics.servo import Servo
from servo_twin.recording import BALANCES, Recording

from .job import report


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
    answers = [answer(recording, servo) for servo in (old, new)]
    floor = answers[0].balance_noise
    found = {}
    for k, name in enumerate(BALANCES):
        sizes = [_rms(a.residual[name]) * a.balance_noise[k] / floor[k] for a in answers]
        if np.isfinite(sizes).all():
            found[name] = tuple(sizes)
    if not found:
        raise ValueError(f'{recording.name}: no balance can be judged by it')
    both = np.exp(np.log(np.maximum(list(found.values()), 1.0)).mean(axis=0))
    return Judgement(float(both[0]), float(both[1]), found)


def _rms(values: np.ndarray) -> float:
    good = values[np.isfinite(values)]
    return sqrt(float(np.square(good).mean())) if len(good) else float('nan')


def main(arguments: list[str]) -> int:
    """Judge; what is wrong is the last line, with status 2."""
    try:
        old, new = (servo_file.load(path) for path in arguments[:2])
        judgement = judge(old, new, read_recording(arguments[2]))
    except (ValueError, OSError) as problem:
        print(problem, flush=True)
        return 2
    report(old=judgement.old, new=judgement.new, balances=judgement.balances)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
