"""
Dynamixel XL330 with a pendulum: Coulomb-viscous against load-dependent friction.

Trained on three recordings; judged on one-second windows of three others, whose combination of
gain and trajectory was not trained on. The scale of torque comes from the pendulum, whose weight
is known.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from servo_twin import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed, Servo
from servo_twin.recording import Recording
from servo_twin.shipped import shipped

from ..fitting import Estimate, fit, misfit
from ..importing import import_table

TRAINED = ('kp400_sin_time_square', 'kp400_up_and_down', 'kp100_sin_time_square')
HELD_OUT = ('kp100_sin_sin', 'kp400_sin_sin', 'kp100_up_and_down')
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


def fitted(data: Path) -> dict[str, Estimate]:
    """Fit both structures to the training recordings."""
    recordings = [recording_of(data, name) for name in TRAINED]
    return {name: fit(servo, recordings, free, tolerance=False, horizon=WINDOW)
            for name, (servo, free) in servos().items()}


def figures(data: Path) -> dict:
    """Return the error on each held-out recording and over all of them, rad, by structure."""
    held = {name: recording_of(data, name) for name in HELD_OUT}
    answer: dict = {'published': PUBLISHED}
    for structure, estimate in fitted(data).items():
        errors = {name: misfit(estimate.servo, [recording], horizon=WINDOW)['motor_position']
                  for name, recording in held.items()}
        errors['all'] = float(np.sqrt(np.mean([e**2 for e in errors.values()])))
        answer[structure] = {'held_out': errors, 'values': dict(estimate.values),
                             'std': dict(estimate.std)}
    return answer
