"""A linear axis: which side is in metres and which in radians, and what files may say of it."""

from math import log
from pathlib import Path

import numpy as np
import pytest

from servo_twin.description.servo_file import dumps, load, loads
from servo_twin.physics.controllers import encoder_speed
from servo_twin.physics.servo import ServoError

EMPS = load(Path(__file__).parents[2] / 'config' / 'servos' / 'emps.yaml')
BELT = """
servo: belt
travel: linear
drive:
  type: voltage
  resistance: {value: 1.0, unit: ohm}
  back_emf: {value: 0.25, unit: V s/rad}
  torque_constant: {value: 0.25, unit: N m/A}
mechanism:
  type: two_inertia
  rotor_inertia: {value: 1.0e-4, unit: kg m2}
  load_inertia: {value: 8.0, unit: kg}
  ratio: {value: 150.0, unit: rad/m}
  stiffness: {value: 3.0e+5, unit: N/m}
  damping: {value: 90.0, unit: N s/m}
controller: {type: cascade, kp: {value: 15.0, unit: 1/s}, kv: {value: 36.0, unit: V s/m}}
sensors:
  motor_encoder: {noise: {value: 1.6e-4, unit: rad}}
  load_encoder: {noise: {value: 5.0e-7, unit: m}}
effects:
  cog: {effect: cogging, order: {value: 6.0, unit: 1/rad}, cosine: {value: [0.01], unit: N m},
        sine: {value: [0.0], unit: N m}}
  drag: {effect: viscous_friction, at: motor, slope: {value: 1.0e-4, unit: N m s/rad}}
  rails: {effect: coulomb_friction, at: load, level: {value: 12.0, unit: N}}
  belt: {effect: kinematic_error, order: {value: 1.0, unit: 1/rad},
         cosine: {value: [1e-5], unit: m}, sine: {value: [0.0], unit: m}}
"""
OLD = (BELT.replace('150.0, unit: rad/m', '150.0').replace('V s/rad', 'V s/m')
       .replace('N m/A', 'N/A').replace('kg m2', 'kg').replace('N m s/rad', 'N s/m')
       .replace('N m}', 'N}').replace('unit: rad}', 'unit: m}').replace('1/rad', '1/m'))
"""As files of before were: the motor of a linear axis in m, N and kg whatever its ratio was."""


def test_a_motor_that_turns_is_in_rotary_units_and_its_load_in_straight_ones():
    servo = loads(BELT)
    assert servo.turning
    assert [servo.unit(f'mechanism.{name}') for name in (
        'rotor_inertia', 'load_inertia', 'ratio', 'stiffness')] == ['kg m2', 'kg', 'rad/m', 'N/m']
    assert not servo.straight('motor_position') and servo.straight('load_position')
    assert (servo.reads('N m', 'motor'), servo.reads('N m', 'torque')) == ('N m', 'N')


def test_its_file_is_written_as_it_is_read():
    servo = loads(BELT)
    assert loads(dumps(servo)) == servo
    assert 'unit: rad/m' in dumps(servo) and 'the motor turns' in dumps(servo)


def test_without_any_unit_a_ratio_says_whether_the_motor_turns():
    bare = ('servo: a\ntravel: linear\ndrive: {type: current, gain: 1, torque_constant: 0.2}\n'
            'mechanism: {type: rigid, rotor_inertia: 1e-4, load_inertia: 8, ratio: RATIO}')
    assert loads(bare.replace('RATIO', '150')).unit('drive.torque_constant') == 'N m/A'
    assert loads(bare.replace('RATIO', '1')).unit('drive.torque_constant') == 'N/A'
    one = loads(bare.replace('RATIO', '{value: 1, unit: rad/m}'))
    assert one.unit('drive.torque_constant') == 'N m/A' and loads(dumps(one)) == one


def test_a_linear_motor_is_in_straight_units_and_stays_so_while_its_ratio_is_fitted():
    assert not EMPS.turning and EMPS.unit('mechanism.rotor_inertia') == 'kg'
    moved = EMPS.with_values({'mechanism.ratio': 1.01})
    assert moved.unit('drive.torque_constant') == 'N/A' and moved.unit('mechanism.ratio') == ''


def test_a_file_of_before_reads_as_it_did():
    old, new = loads(OLD), loads(BELT)
    assert old.values == new.values and old.unit('drive.torque_constant') == 'N/A'
    assert loads(dumps(old)) == old


def test_all_wrong_units_are_named_at_once_with_what_a_linear_axis_means():
    wrong = BELT.replace('value: 8.0, unit: kg', 'value: 8.0, unit: kg m2').replace(
        'unit: V s/rad', 'unit: V s/m')
    with pytest.raises(ServoError) as refusal:
        loads(wrong)
    said = str(refusal.value)
    for word in ("mechanism.load_inertia: the unit is 'kg m2', it must be 'kg'",
                 "drive.back_emf: the unit is 'V s/m', it must be 'V s/rad'",
                 'the ratio is in rad/m'):
        assert word in said
    assert said.count('it must be') == 2


def test_the_observer_s_bandwidth_is_a_frequency_and_old_files_call_it_a_speed():
    assert EMPS.unit('observer.bandwidth') == 'rad/s'
    old = loads(dumps(EMPS).replace('unit: rad/s', 'unit: m/s'))
    assert old.values == EMPS.values


@pytest.mark.parametrize(('kept', 'filter'), [
    (lambda period, lag: lag / (lag + period), lambda period, lag: period / log(1 + period / lag)),
    (lambda period, lag: 1 - period / lag, lambda period, lag: -period / log(1 - period / lag))],
    ids=['backward Euler', 'forward Euler'])
def test_the_filter_of_a_firmware_is_the_exact_one_of_the_page_of_signs(kept, filter):
    period, lag = 0.002, 0.004
    angles = np.random.default_rng(0).normal(size=50)
    memory, speed, keep = np.zeros(4), 0.0, kept(period, lag)
    for before, now in zip(angles[:1].tolist() + angles[:-1].tolist(), angles, strict=True):
        speed = keep * speed + (1.0 - keep) * (now - before) / period
        assert encoder_speed(memory, now, filter(period, lag), period) == pytest.approx(speed)
