"""An answer about a linear axis speaks in the units of the shaft that it is about."""

from dataclasses import replace
from pathlib import Path

import pytest

from servo_identify.diagnose.answer.shown_units import channel_unit, curve_units
from servo_identify.diagnose.mechanisms.hypothesis import Form, Mechanism, UNKNOWN
from servo_twin.description.servo_file import load

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
