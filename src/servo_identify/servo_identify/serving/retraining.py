"""
The job that retrains a servo file from bags: `python -m servo_identify.serving.retraining SPEC`.

SPEC is a JSON file: `servo` (path), `bags` (paths), `learn` (names, see :func:`wanted`), `output`
(path of the servo file to write).
"""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path
import sys

from servo_twin import servo_file
from servo_twin.bag import read_recording
from servo_twin.physics.servo import Servo

from ..fitting.command import LEARNED, write
from ..fitting.output_error import fit, Progress
from .job import report

_STEPS = 40  # of a fit, at most


def wanted(servo: Servo, learn: Sequence[str]) -> tuple[list[str], list[str]]:
    """
    Return what is learned (of fitting.command.LEARNED) and the paths that are fitted.

    A name is one of LEARNED, a path of the servo file, or the name of one of its effects, which
    means all its parameters that are numbers. Nothing means all that have a tolerance. Raises
    ValueError for a name that is none of them.
    """
    if not learn:
        if not servo.tolerance:
            raise ValueError(f'{servo.name}: no parameter has a tolerance; say what to learn')
        return [], list(servo.tolerance)
    learned, free = [], []
    numbers = [path for path, value in servo.values.items() if not isinstance(value, tuple)]
    for name in learn:
        below = [path for path in numbers if path.startswith(f'effects.{name}.')]
        if name == 'physical':
            free += list(servo.tolerance)
        elif name in LEARNED:
            learned.append(name)
        elif name in servo.values:
            free.append(name)
        elif below:
            free += below
        else:
            effects = [placed.name for placed in servo.effects]
            raise ValueError(f'{name!r} is not to be learned: it is none of {list(LEARNED)}, no '
                             f'effect of {effects}, and no parameter of {servo.name}')
    return learned, list(dict.fromkeys(free))


def main(arguments: list[str]) -> int:
    """Retrain; what is wrong is the last line, with status 2."""
    spec = json.loads(Path(arguments[0]).read_text())
    try:
        report(stage='reading', progress=0.0)
        servo = servo_file.load(spec['servo'])
        learned, free = wanted(servo, spec['learn'])
        recordings = [read_recording(bag) for bag in spec['bags']]
        losses = {}
        if free:
            servo, losses = _fit(servo, recordings, free, bool(learned))
        for number, name in enumerate(learned):
            from ..learning import learn
            report(stage=f'learning {name}', progress=(number + bool(free)) / (
                len(learned) + bool(free)))
            servo, said = learn(name, servo, recordings)
            print('\n'.join(said), flush=True)
        write(servo, Path(spec['output']))
    except (ValueError, OSError) as problem:
        print(problem, flush=True)
        return 2
    report(stage='done', progress=1.0, **losses)
    return 0


def _fit(servo: Servo, recordings: list, free: list[str], more: bool) -> tuple[Servo, dict]:
    def told(at: Progress) -> None:
        share = 0.1 + 0.8 * min(1.0, at.iteration / _STEPS)
        report(stage=at.stage, progress=0.5 * share if more else share, loss=at.cost)

    estimate = fit(servo, recordings, free, iterations=_STEPS, progress=told)
    for warning in estimate.warnings:
        print(f'warning: {warning}', flush=True)
    return estimate.servo, {'loss_before': estimate.cost_before, 'loss_after': estimate.cost,
                            'loss': estimate.cost}


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
