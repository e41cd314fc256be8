"""A twin that is simulated over a recording comes down to the noise where nothing is missing."""

from pathlib import Path

import numpy as np
import pytest

import servo_identify as si
from servo_identify.diagnose.handover.simulated_gap import simulated
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

EXAMPLE = Path(__file__).resolve().parents[2] / 'docs' / 'example'


@pytest.mark.parametrize('family', ['multisine', 'slow_reversals'])
def test_the_zero_between_the_encoders_is_estimated(family):
    servo = si.load_servo(EXAMPLE / 'fan.yaml')
    whole = servo.servo.with_effects(Placed('fan', find('quadratic_drag'), 'load'),
                                     values={'effects.fan.rise': 3.0e-4})
    gap = simulated(whole, si.read(EXAMPLE / 'runs' / f'{family}_1.csv', servo)).gap
    assert gap.rms('torsion') < 1.3 * gap.floor['torsion']
    assert gap.rms('current') < 1.3 * gap.floor['current']


@pytest.mark.long
@pytest.mark.parametrize('family', ['multisine', 'slow_reversals'])
def test_what_both_shafts_drift_does_not_move_the_zero_between_the_encoders(family):
    servo = si.load_servo(EXAMPLE / 'fan.yaml')
    pushed = servo.servo.with_effects(Placed('push', find('gravity'), 'load'),
                                      values={'effects.push.cosine': 0.5})
    data = si.read(EXAMPLE / 'runs' / f'{family}_1.csv', servo)
    rig, twin = next(iter(data)), simulated(pushed, data).outputs[0]
    ratio = servo.servo.numbers['mechanism.ratio']
    drift = twin['motor_position'] - rig['motor_position']
    torsion, wrong = (some['load_position'] - some['motor_position'] / ratio
                      for some in (rig, {n: twin[n] - rig[n] for n in twin}))
    assert abs(np.nanmean(drift)) / ratio > np.nanstd(torsion)
    assert abs(np.nanmean(wrong)) < 0.1 * np.nanstd(torsion)
