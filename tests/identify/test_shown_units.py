"""An answer about a linear axis speaks in the units of the shaft that it is about."""

from dataclasses import replace
from pathlib import Path

import pytest

from servo_identify.diagnose.answer.missing_effect import _turn
from servo_identify.diagnose.answer.shown_units import channel_unit, curve_units
from servo_identify.diagnose.answer.sizes import size_of, values_of
from servo_identify.diagnose.handover.added import Added
from servo_identify.diagnose.mechanisms.hypothesis import Form, Mechanism, UNKNOWN
from servo_twin.description.servo_file import load
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

BENCH = load(Path(__file__).parents[2] / 'config' / 'servos' / 'rv_bench.yaml')
BELT = replace(BENCH, linear=True)
LINEAR_MOTOR = replace(BELT, turning=False)


def form(variable, unit, y_unit):
    return Form(variable, unit, y_unit, lambda one: one, lambda x: x)


@pytest.mark.parametrize(('name', 'site', 'belt', 'linear_motor'), [
    ('cogging', 'motor', ('rad', 'N m'), ('m', 'N')),
    ('position_dependent_friction', 'load', ('m', 'N'), ('m', 'N')),
    (UNKNOWN, 'motor', ('m', 'N m'), ('m', 'N'))])
def test_a_torque_over_an_angle_is_in_units_of_its_shaft(name, site, belt, linear_motor):
    mechanism, curve = Mechanism(name, 'torque', site, ('angle',), 'none'), form(
        'angle', 'rad', 'N m')
    assert curve_units(BENCH, mechanism, curve) == ('rad', 'N m')
    assert curve_units(BELT, mechanism, curve) == belt
    assert curve_units(LINEAR_MOTOR, mechanism, curve) == linear_motor


def test_the_error_of_a_belt_is_in_metres_over_the_turn_of_its_motor():
    mechanism = Mechanism('kinematic_error', 'mesh_error', 'mesh', ('angle',), 'none')
    assert curve_units(BELT, mechanism, form('angle', 'rad', 'rad')) == ('rad', 'm')


def test_channels_are_in_the_units_of_their_shafts():
    assert [channel_unit(BELT, name) for name in (
        'motor_position', 'load_position', 'torsion', 'torque', 'current')] == [
            'rad', 'm', 'm', 'N', 'A']


@pytest.mark.parametrize(('value', 'std', 'told'), [
    (628.13253, 0.00366, 'lead 628.133 +- 0.004 m'), (0.0393, 0.89, 'lead 0.0393 +- 0.9 m'),
    (0.12, 8e-5, 'lead 0.12000 +- 8e-05 m'), (400.0, 1.0, 'lead 400 +- 1 m'),
    (400.2, None, 'lead 400 m'), (1.5, float('nan'), 'lead 1.5 m'), (0.0, 2.0, 'lead 0 +- 2 m')])
def test_a_value_has_the_digits_that_its_standard_deviation_leaves(value, std, told):
    assert size_of({'a.lead': {'value': value, 'std': std, 'unit': 'm'}}, None) == told


def test_what_is_rounding_beside_the_rest_of_a_curve_is_zero():
    curve = {'x': [4.4e-16, 1.0, 7.92], 'y': [8e-17, 0.3, 0.635], 'unit': 'rad/s', 'y_unit': 'N m'}
    assert size_of({}, curve) == '0 to 0.635 N m from 0 to 7.92 rad/s'


def test_a_value_that_is_not_told_is_shown_as_its_curve():
    curve = {'x': [0.0, 4.0, 8.0], 'y': [0.0, -0.01, -0.13], 'unit': 'A', 'y_unit': 'N m'}
    loss = {'loss': {'value': 15.1, 'std': 1000.0, 'unit': 'N m/A'}}
    assert size_of(loss, curve) == '0 to -0.13 N m from 0 to 8 A'
    loss['loss']['std'] = 3.0
    assert size_of(loss, curve) == 'loss 15.1 +- 3 N m/A'


def test_waves_are_told_by_amplitude_order_and_shaft():
    waves = {'order': {'value': 22.0, 'std': None, 'unit': '1/rad'}} | {
        f'{name}[{k}]': {'value': value, 'std': 0.0002, 'unit': 'N m'}
        for k, pair in enumerate(((0.03, 0.04), (0.006, 0.008))) for name, value in zip(
            ('cosine', 'sine'), pair, strict=True)}
    assert size_of(waves, None, 'motor') == (
        'amplitude 0.0500 +- 0.0002 N m, 22 per turn of the motor, and 0.01 N m at 44')


def test_an_effect_without_a_curve_is_told_with_all_its_values():
    values = {'stiffness': {'value': 1870.0, 'std': 200.0, 'unit': 'N/m'},
              'time': {'value': 0.3115, 'std': None, 'unit': 's'}}
    assert size_of(values, None) == 'stiffness 1.87e+03 +- 200 N/m and time 0.311 s'


@pytest.mark.parametrize(('servo', 'told'), [
    (BENCH, '151 per turn of the motor, and 0.5 N at 302'),
    (BELT, '151 per turn of the motor, and 0.5 N at 302'),
    (LINEAR_MOTOR, 'a period of 41.6 mm, and 0.5 N at 20.8 mm')])
def test_waves_of_a_motor_that_does_not_turn_are_told_by_their_period(servo, told):
    added = Added(None, (Placed('e', find('cogging'), 'motor'),))
    parameters = {name: {'value': value, 'std': 0.01, 'unit': unit} for name, value, unit in (
        ('cosine[0]', 1.0, 'N'), ('sine[0]', 0.0, 'N'), ('cosine[1]', 0.5, 'N'),
        ('sine[1]', 0.0, 'N'), ('order', 151.0, '1/rad'))}
    assert size_of(parameters, None, _turn(added, servo)) == f'amplitude 1.00 +- 0.01 N, {told}'


def test_a_table_names_values_with_their_effect_and_their_deviation():
    values = {'difference': {'value': -0.0081, 'std': 0.005, 'unit': 'N m'},
              'order': {'value': 1.0, 'std': None, 'unit': '1/rad'},
              'torque[3]': {'value': 1.0, 'std': 0.1, 'unit': 'N m'},
              'effects.viscous_friction.slope': {'value': 3.965e-05, 'std': 0.003,
                                                 'unit': 'N m s/rad'}}
    assert values_of(values) == ['difference -0.0081 +- 0.005 N m',
                                 'slope of viscous friction 3.97e-05 +- 0.003 N m s/rad']
