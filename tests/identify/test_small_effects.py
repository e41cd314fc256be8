"""A small effect beside a large one, and effects of what turns where nothing does."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recordings import PERIOD, sampled
from test_selection import named_by_equations, without

from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

AXIS = servo_file.loads("""
servo: axis
travel: linear
step: 1.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.3}
mechanism:
  type: rigid
  rotor_inertia: 1.0e-4
  load_inertia: {value: 9.0, unit: kg}
  ratio: {value: 400.0, unit: rad/m}
sensors:
  load_encoder:
    noise: {value: 2.0e-6, unit: m}
  current_sensor: {noise: 0.01}
effects:
  rubs: {effect: coulomb_friction, at: load, level: {value: 12.0, unit: N}}
""")
BELT = servo_file.loads("""
servo: belt
travel: linear
step: 5.0e-5
drive: {type: current, gain: 1.0, torque_constant: 0.6}
mechanism:
  type: two_inertia
  rotor_inertia: 4.0e-3
  load_inertia: {value: 24.0, unit: kg}
  ratio: {value: 31.4, unit: rad/m}
  stiffness: {value: 6.0e+5, unit: N/m}
  damping: {value: 400.0, unit: N s/m}
sensors:
  motor_encoder: {noise: 1.0e-5}
  load_encoder: {noise: {value: 5.0e-7, unit: m}}
  current_sensor: {noise: 0.01}
effects:
  rubs: {effect: coulomb_friction, at: load, level: {value: 30.0, unit: N}}
""")
TURNING = """
servo: table
step: 1.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.35}
mechanism: {type: rigid, rotor_inertia: 4.0e-4, load_inertia: 3.0e-3, ratio: 1.0}
sensors:
  load_encoder: {noise: 1.0e-4}
  current_sensor: {noise: 0.01}
effects:
  rubs: {effect: coulomb_friction, at: load, level: 0.05}
  drags: {effect: viscous_friction, at: load, slope: 0.01}
"""
TABLE = servo_file.loads(TURNING)
RIPPLE = 0.05 * TABLE.numbers['drive.torque_constant']  # N m/A


def turning(rig, seed, size=5.0, seconds=8.0):
    """Return a recording of a rig whose load turns far."""
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    command = sum(size * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.25, 0.9, 2.1))
    return replace(sampled(rig, command, seed=seed), name=f'turn_{seed}', family='turn')


def added(servo, name, site, **values):
    return servo.with_effects(Placed('e', find(name), site), values={
        f'effects.e.{key}': value for key, value in values.items()})


@pytest.mark.long
@pytest.mark.slow
def test_a_ripple_is_found_beside_a_weight_that_is_twenty_times_as_large():
    rig = added(TABLE, 'gravity', 'load', cosine=0.3, sine=0.1)
    rig = rig.with_effects(Placed('r', find('torque_ripple'), 'motor'), values={
        'effects.r.order': 7.0, 'effects.r.cosine': (RIPPLE,), 'effects.r.sine': (0.0,)})
    several = [without(turning(rig, seed, 0.8), 'motor_position', 'torque') for seed in (1, 2, 3)]
    assert named_by_equations(several, TABLE) == {('gravity', 'load'), ('torque_ripple', 'motor')}


@pytest.mark.long
@pytest.mark.slow
def test_nothing_hangs_on_an_axis_that_does_not_turn():
    rig = added(AXIS, 'spring_load', 'load', stiffness=250.0, rest=-0.3)
    several = [without(turning(rig, seed, 1.0), 'motor_position', 'torque') for seed in (1, 2)]
    assert named_by_equations(several, AXIS) == {('spring_load', 'load')}


@pytest.mark.long
@pytest.mark.slow
def test_the_one_encoder_of_a_direct_drive_may_be_eccentric():
    rig = added(TABLE, 'load_encoder_eccentricity', 'load_position', cosine=4e-3, sine=-4e-3)
    several = [without(turning(rig, seed, 0.8), 'motor_position', 'torque') for seed in (1, 2)]
    assert named_by_equations(several, TABLE) == {('load_encoder_eccentricity', 'load_position')}


@pytest.mark.long
def test_the_one_encoder_of_a_direct_drive_may_be_on_the_motor():
    table = servo_file.loads(TURNING.replace('load_encoder', 'motor_encoder'))
    rig = added(table, 'motor_encoder_eccentricity', 'motor_position', order=2.0,
                cosine=(4e-3,), sine=(-3e-3,))
    several = [without(turning(rig, seed, 0.8), 'load_position', 'torque') for seed in (1, 2)]
    found = explained(residual_samples(several, table))
    assert [one.mechanism.name for one in found.chosen] == ['motor_encoder_eccentricity']
    number = found.explanation.smallest.choice.numbers[0]
    sizes = dict(zip(found.hypotheses[number].knots[::2],
                     found.amplitudes(number).reshape(-1, 2), strict=True))
    assert sizes[2.0] == pytest.approx((4e-3, -3e-3), rel=0.1)


@pytest.mark.long
@pytest.mark.slow
def test_a_belt_is_stiffer_at_one_end_of_an_axis():
    rig = added(BELT, 'stiffness_ripple', 'mesh', order=8.0, cosine=(1e5,), sine=(5e4,))
    several = [without(turning(rig, seed, 2.0), 'torque') for seed in (1, 2)]
    assert named_by_equations(several, BELT) == {('stiffness_error', 'mesh')}
