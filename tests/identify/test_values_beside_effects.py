"""A missing effect beside a value of the file that is off within its tolerance."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recordings import sampled

from servo_identify.diagnose.diagnose import diagnose
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

WHEEL = servo_file.loads("""
servo: wheel
step: 1.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.3}
mechanism: {type: rigid, rotor_inertia: 2.0e-3, load_inertia: 0.0, ratio: 1.0}
sensors:
  motor_encoder: {noise: 1.0e-3}
  current_sensor: {noise: 2.0e-3}
effects:
  drags: {effect: viscous_friction, at: motor, slope: 0.02}
tolerance:
  drive.torque_constant: 5 %
""")
RUBS = 0.018  # N m
STRONGER = 1.04
ROW = 2e-3  # s


def driven(rig, seed, command, family):
    one = sampled(rig, command, seed=seed, period=ROW)
    gone = np.full(len(command), np.nan)
    return replace(one, columns={**one.columns, 'load_position': gone, 'torque': gone},
                   family=family, name=f'{family}_{seed}')


@pytest.mark.long
@pytest.mark.slow
def test_where_the_effect_alone_does_worse_the_values_move_with_it():
    """A motor stronger than its file hides the friction of a drive that turns one way."""
    rig = WHEEL.with_effects(Placed('rubs', find('coulomb_friction'), 'motor'), values={
        'effects.rubs.level': RUBS, 'drive.torque_constant': 0.3 * STRONGER})
    time = np.arange(round(8.0 / ROW)) * ROW
    to_and_fro = [sum(size * np.sin(2.0 * np.pi * f * time + seed * f) for f, size in (
        (0.2, 0.4), (0.9, 0.2), (2.3, 0.2))) for seed in (1, 2, 3, 4)]
    onwards = 1.6 + 0.05 * np.sin(2.0 * np.pi * 0.7 * time)
    found = diagnose([driven(rig, seed, one, 'multisine') for seed, one in enumerate(to_and_fro)],
                     WHEEL, reporting=[driven(rig, 9, onwards, 'onwards')])
    which, = found.report.which
    assert which.effect == 'coulomb_friction'
    assert found.augmented.values['drive.torque_constant'] == pytest.approx(
        0.3 * STRONGER, rel=0.01)
    given, patch = (found.evidence.reported[name].gap.total() for name in ('given', 'patch'))
    assert patch < 0.2 * given
