"""
Dynamixel XL330 with a pendulum: Coulomb-viscous against load-dependent friction.

Trained on some recordings and judged on one-second windows of others: of combinations of gain and
trajectory that were not trained on, of a gain of the controller that was not, and of both. The
scale of torque comes from the pendulum, whose weight is known.

  python -m servo_studies.real_machines.xl330 DATA

prints the table; DATA as for `servo-identify results`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import sys

import numpy as np

from servo_identify.data.table_import import import_table
from servo_identify.fit.estimate import Estimate
from servo_identify.fit.output_error import fit, misfit
from servo_twin.description import servo_file
from servo_twin.description.shipped import shipped
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed, Servo
from servo_twin.recording.recording import Recording

TRAINED = ('kp400_sin_time_square', 'kp400_up_and_down', 'kp100_sin_time_square')
HELD_OUT = ('kp100_sin_sin', 'kp400_sin_sin', 'kp100_up_and_down')
_LIVELY = ('sin_sin', 'sin_time_square', 'up_and_down')
SPLITS = {
    'gain and trajectory in another combination': (TRAINED, HELD_OUT),
    'gain 100, trained on 400': (tuple(f'kp400_{name}' for name in _LIVELY),
                                 tuple(f'kp100_{name}' for name in _LIVELY)),
    'gain 400, trained on 100': (tuple(f'kp100_{name}' for name in _LIVELY),
                                 tuple(f'kp400_{name}' for name in _LIVELY)),
    'gain 100 and other trajectories': (('kp400_sin_time_square', 'kp400_up_and_down'),
                                        ('kp100_sin_sin', 'kp100_lift_and_drop')),
}
"""What is held out: recordings to train on, recordings to judge by."""

WINDOW = 1.0  # s
PUBLISHED = {'coulomb_viscous': 0.147, 'load_dependent': 0.052}
"""rad on one-second windows, a quick fit elsewhere."""

FREE = ('drive.torque_constant', 'mechanism.rotor_inertia', 'effects.coulomb.level',
        'effects.viscous.slope')


def recording_of(data: Path, name: str) -> Recording:
    """Return a recording of the shared data folder."""
    return import_table(data / f'xl330/{name}.json', shipped('servos/xl330.yaml'),
                        mapping=shipped('imports/xl330.yaml'))


def servos() -> dict[str, tuple[Servo, tuple[str, ...]]]:
    """Return the two structures with the parameters that are free in each."""
    plain = servo_file.load(shipped('servos/xl330.yaml'))
    loaded = plain.with_effects(Placed('loaded', find('load_dependent_friction'), 'load'),
                                values={'effects.loaded.share': 0.1})
    return {'coulomb_viscous': (plain, FREE),
            'load_dependent': (loaded, (*FREE, 'effects.loaded.share',
                                        'effects.loaded.back_driven'))}


def fitted(data: Path, trained: Sequence[str] = TRAINED) -> dict[str, Estimate]:
    """Fit both structures to the training recordings."""
    recordings = [recording_of(data, name) for name in trained]
    return {name: fit(servo, recordings, free, tolerance=False, horizon=WINDOW)
            for name, (servo, free) in servos().items()}


def held_out(data: Path, trained: Sequence[str] = TRAINED, held: Sequence[str] = HELD_OUT) -> dict:
    """Return the error on each held-out recording and over all of them, rad, by structure."""
    recordings = {name: recording_of(data, name) for name in held}
    answer = {}
    for structure, estimate in fitted(data, trained).items():
        errors = {name: misfit(estimate.servo, [recording], horizon=WINDOW)['motor_position']
                  for name, recording in recordings.items()}
        errors['all'] = float(np.sqrt(np.mean([e**2 for e in errors.values()])))
        answer[structure] = {'held_out': errors, 'values': dict(estimate.values),
                             'std': dict(estimate.std)}
    return answer


def figures(data: Path) -> dict:
    """Return what :func:`held_out` does for the first of SPLITS, and `splits` with all errors."""
    first, *others = SPLITS
    found = {name: held_out(data, *SPLITS[name]) for name in (first, *others)}
    return {'published': PUBLISHED, **found[first], 'splits': {
        name: {structure: part['held_out'] for structure, part in one.items()}
        for name, one in found.items()}}


def table(found: dict) -> str:
    """Return the errors of all splits as Markdown."""
    lines = ['| held out | friction | all, rad | by recording, rad |', '|---|---|---|---|']
    for split, by_structure in found['splits'].items():
        for structure, errors in by_structure.items():
            each = ', '.join(f'{n} {e:.3f}' for n, e in errors.items() if n != 'all')
            lines.append(f'| {split} | {structure.replace("_", " ")} | {errors["all"]:.3f} '
                         f'| {each} |')
    return '\n'.join(lines) + '\n'


if __name__ == '__main__':
    print(table(figures(Path(sys.argv[1]))), end='')
