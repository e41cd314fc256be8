"""
The job that retrains a servo file from bags.

`python -m servo_identify.jobs.live.retrain_job SPEC`

SPEC is a JSON file: `servo` (path), `bags` (paths), `stretch` (from and to, s, of each bag),
`learn` (names, see :func:`wanted`), `output` (path of the servo file to write). The loss that is
reported on the way is the fit's cost, or the network's mean square error on what is kept back;
`loss_before` and `loss_after` are the fit's costs where only parameters are fitted, else what the
old and the new servo leave of the balances over the bags, in noise floors (see compare_job).
"""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path
import sys

import numpy as np

from servo_twin.description import servo_file
from servo_twin.physics.element_names import split_name
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ...data.reading import read_looked_at
from ...data.stretch import Stretch
from ...fit.fit_choices import LEARNED
from ...fit.output_error import fit, Progress
from .compare_job import judge
from .job_process import refused, report

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
    whole = set(free)  # a row that is named takes in each of its numbers
    return learned, [name for path, name in ((split_name(name)[0], name)
                                             for name in dict.fromkeys(free))
                     if path == name or path not in whole]


def main(arguments: list[str]) -> int:
    """Retrain; where that cannot be, tell why, with status 2."""
    spec = json.loads(Path(arguments[0]).read_text())
    try:
        report(stage='reading', progress=0.0)
        servo = servo_file.load(spec['servo'])
        learned, free = wanted(servo, spec['learn'])
        recordings = read_looked_at(spec['bags'], spec['servo'],
                                    stretch=Stretch(*spec['stretch']))
        before, losses = servo, {}
        if free:
            servo, losses = _fit(servo, recordings, free, bool(learned))
        for number, name in enumerate(learned):
            servo = _learn(name, servo, recordings, number + bool(free),
                           len(learned) + bool(free))
        if learned:
            report(stage='judging', progress=0.95)
            losses = _losses(before, servo, recordings)
        servo_file.save(servo, Path(spec['output']))
    except (ValueError, OSError) as problem:
        return refused(problem)
    report(stage='done', progress=1.0, **losses)
    return 0


def _fit(servo: Servo, recordings: list[Recording], free: list[str], more: bool
         ) -> tuple[Servo, dict]:
    def told(at: Progress) -> None:
        share = 0.1 + 0.8 * min(1.0, at.iteration / _STEPS)
        report(stage=at.stage, progress=0.5 * share if more else share, loss=at.cost)

    estimate = fit(servo, recordings, free, iterations=_STEPS, progress=told)
    for warning in estimate.warnings:
        print(f'warning: {warning}', flush=True)
    return estimate.servo, {'loss_before': estimate.cost_before, 'loss_after': estimate.cost,
                            'loss': estimate.cost}


def _learn(name: str, servo: Servo, recordings: list[Recording], done: int, parts: int) -> Servo:
    """
    Learn one effect from the bags of its experiment (all, where none says it is of it).

    The reports leave a twentieth of the progress to what comes after.
    """
    from ...learn.learned_effects import learn

    def told(share: float, loss: float) -> None:
        report(stage=f'learning {name}', progress=0.95 * (done + share) / parts, loss=loss)

    report(stage=f'learning {name}', progress=0.95 * done / parts)
    own = [recording for recording in recordings if recording.family == name]
    servo, said = learn(name, servo, own or recordings, told)
    print('\n'.join(said), flush=True)
    return servo


def _losses(old: Servo, new: Servo, recordings: list[Recording]) -> dict:
    """Return both losses over all recordings that can judge; none when no recording can."""
    found = []
    for recording in recordings:
        try:
            judgement = judge(old, new, recording)
        except ValueError as problem:
            print(f'warning: {problem}', flush=True)
            continue
        found.append((judgement.old, judgement.new))
    if not found:
        return {}
    before, after = np.exp(np.log(found).mean(axis=0)).tolist()
    return {'loss_before': before, 'loss_after': after}


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
