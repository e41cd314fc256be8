"""A twin that is simulated over a recording comes down to the noise where nothing is missing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_recordings import from_rest

import servo_identify as si
from servo_identify.diagnose.handover.simulated_gap import simulated
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

JOINT = servo_file.loads("""
servo: joint
step: 1.0e-3
drive: {type: current, gain: 1.0, torque_constant: 0.1}
mechanism: {type: rigid, rotor_inertia: 1.0e-4, load_inertia: 0.03, ratio: 9.0}
sensors: {motor_encoder: {noise: 1.0e-4}, current_sensor: {noise: 0.02}}
effects:
  drags: {effect: viscous_friction, at: load, slope: 0.5}
""")

TABLE = servo_file.loads("""
servo: table
step: 2.0e-4
drive: {type: current, gain: 1.0, torque_constant: 2.0}
mechanism: {type: rigid, rotor_inertia: 2.0e-3, load_inertia: 0.031, ratio: 1.0}
sensors: {motor_encoder: {noise: 1.0e-5}, current_sensor: {noise: 0.006}}
effects:
  dry: {effect: coulomb_friction, at: load, level: 0.13}
  teeth: {effect: cogging, at: motor, order: 24, cosine: [0.06, 0.055], sine: [0.07, 0.01]}
""")

EXAMPLE = Path(__file__).resolve().parents[2] / 'docs' / 'example'


@pytest.mark.parametrize('family', ['multisine', 'slow_reversals'])
def test_the_zero_between_the_encoders_is_estimated(family):
    servo = si.load_servo(EXAMPLE / 'fan.yaml')
    whole = servo.servo.with_effects(Placed('fan', find('quadratic_drag'), 'load'),
                                     values={'effects.fan.rise': 3.0e-4})
    gap = simulated(whole, si.read(EXAMPLE / 'runs' / f'{family}_1.csv', servo)).gap
    assert gap.rms('torsion') < 1.3 * gap.floor['torsion']
    assert gap.rms('current') < 1.3 * gap.floor['current']


@pytest.mark.parametrize('ahead', [0.0, 0.6, 1.0])
def test_a_current_that_is_read_after_its_command_acts_is_no_gap(ahead):
    time, chance = np.arange(0.0, 8.0, 4e-3), np.random.default_rng(1)
    command = 2.0 * np.sin(3.0 * time) + chance.normal(0.0, 0.4, len(time))
    gap = simulated(JOINT, [from_rest(JOINT, command, 4e-3, chance, ahead)]).gap
    assert gap.rms('current') == pytest.approx(0.02, rel=0.1)
    assert gap.rms('motor_position') == pytest.approx(1e-4, rel=0.2)


@pytest.mark.parametrize('begin', [1.8, 1.9, 2.0, 2.05])
def test_a_recording_that_begins_as_a_shaft_speeds_up_among_detents_is_no_gap(begin):
    time, chance = np.arange(0.0, 4.0, 5e-4), np.random.default_rng(3)
    command = np.where(time < 2.2, 0.8 * np.sin(3.0 * np.pi * time), 0.0)
    whole = from_rest(TABLE, command, 5e-4, chance)
    rest = replace(whole, columns={name: column[round(begin / 5e-4):].copy()
                                   for name, column in whole.columns.items()})
    gap = simulated(TABLE, [rest]).gap
    assert gap.rms('motor_position') < 3e-5


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
