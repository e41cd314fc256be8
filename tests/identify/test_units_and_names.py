"""Units and names as people write them, and which column of their data each is."""

from pathlib import Path

import numpy as np
import pytest

from servo_identify.data.column_names import split, TOLD_TORQUE
from servo_identify.data.column_units import factor_of
from servo_identify.data.physical_units import factor_to, value_in
from servo_identify.data.unit_symbols import UnitError
from servo_identify.init.asking import choose_columns
from servo_identify.init.joint_choice import choose_joint
from servo_identify.init.proposals import ANGLE, looks_like, proposed
from servo_identify.init.sources import Offered

COUNT = 2.0 * np.pi / 4096


@pytest.mark.parametrize(('text', 'wanted', 'value'), [
    ('1.2 mH', 'H', 1.2e-3), ('32 g cm2', 'kg m2', 3.2e-6), ('32 gcm²', 'kg m2', 3.2e-6),
    ('350 mohm', 'ohm', 0.35), ('350 mΩ', 'ohm', 0.35), ('45 mN m/A', 'N m/A', 0.045),
    ('45 mNm/A', 'N m/A', 0.045), ('4.7 V/krpm', 'V s/rad', 4.7 * 30 / np.pi / 1e3),
    ('212 rpm/V', 'V s/rad', 30 / np.pi / 212),
    ('4 rps/V', 'V s/rad', 0.125 / np.pi), ('1 V/rad/s', 'V s/rad', 1.0),
    ('3 oz in2', 'kg m2', 3 * 1.82899783e-5), ('50', '', 50.0), ('20 %', '', 0.2)])
def test_it_understands_units_as_people_write_them(text, wanted, value):
    assert value_in(text, wanted) == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize(('unit', 'wanted', 'factor'), [
    ('Grad', 'rad', np.pi / 180), ('Degrees', 'rad', np.pi / 180), ('Volts', 'V', 1.0),
    ('amps', 'A', 1.0), ('RPM', 'rad/s', np.pi / 30), ('U/min', 'rad/s', np.pi / 30),
    ('MS', 's', 1e-3), ('MSEC', 's', 1e-3), ('usec', 's', 1e-6), ('mrad/msec', 'rad/s', 1.0),
    ('Newton-meters', 'N m', 1.0), ('Degrees/second', 'rad/s', np.pi / 180)])
def test_a_unit_may_be_a_word_in_english_or_german(unit, wanted, factor):
    assert factor_to(unit, wanted) == pytest.approx(factor)


@pytest.mark.parametrize(('unit', 'value'), [
    ('U', 2.0 * np.pi), ('1/4096 U', COUNT), ('u/min', np.pi / 30), ('U/MIN', np.pi / 30)])
def test_a_turn_may_be_u_as_german_has_it(unit, value):
    assert factor_to(unit, 'rad/s' if 'm' in unit.lower() else 'rad') == pytest.approx(value)


@pytest.mark.parametrize(('header', 'unit'), [
    ('CURRENT (MA)', 'mA'), ('VOLTAGE [MV]', 'mV'), ('TORQUE (MNM)', 'mNm'),
    ('ANGLE [MRAD]', 'mrad'), ('SPEED (U/MIN)', 'U/MIN'), ('current (MA)', 'MA')])
def test_the_unit_of_a_header_in_capitals_throughout_has_no_case(header, unit):
    assert split(header)[1] == unit


@pytest.mark.parametrize(('text', 'wanted', 'word'), [
    ('2.1', 'ohm', 'no unit; say 2.1 ohm'), ('2.1 mH', 'ohm', "'mH' is no unit of ohm"),
    ('1 furlong', 'm', 'no unit that is known'), ('much', 'ohm', 'no number'),
    ('1', 'A/V', '1 A/A where the command is a current'), ('39.27 rad/m', '', 'say --linear'),
    ('5 mm/rev', '', 'say --linear')])
def test_it_refuses_a_value_without_its_unit(text, wanted, word):
    with pytest.raises(UnitError, match=word):
        value_in(text, wanted)


@pytest.mark.parametrize(('text', 'wanted', 'value'), [
    ('1 Hz', 'rad/s', 2.0 * np.pi), ('1 1/min', 'rad/s', np.pi / 30), ('1 1/s', 'rad/s', 1.0),
    ('7.96 Hz/V', 'V s/rad', 1.0 / 7.96 / 2.0 / np.pi), ('1 V/Hz', 'N m/A', 0.5 / np.pi),
    ('40 Hz', '1/s', 40.0), ('40 Hz', 'Hz', 40.0), ('1 rad/s', 'Hz', 0.5 / np.pi)])
def test_it_takes_a_frequency_as_turns_where_an_angle_is_wanted(text, wanted, value):
    assert value_in(text, wanted) == pytest.approx(value)


@pytest.mark.parametrize(('text', 'wanted', 'word'), [
    ('150 Nm', 'N m/rad', "'Nm' is no unit of N m/rad: it lacks the angle"),
    ('1 Nm/rad', 'N m', 'it is of an angle'), ('1 Nm/deg', 'N m', 'it is of an angle'),
    ('1 V', 'V/rad', 'lacks the angle'), ('5 mm', 'rad/m', "'mm' is no unit")])
def test_it_refuses_a_unit_that_differs_by_an_angle(text, wanted, word):
    with pytest.raises(UnitError, match=word):
        value_in(text, wanted)


@pytest.mark.parametrize(('text', 'wanted'), [
    ('1 V s', 'V s/rad'), ('1 Vs', 'V s/rad'), ('1 Nms', 'N m s/rad'), ('1 V s/rad', 'N m/A'),
    ('1 Nm/(rad/s)', 'N m s/rad'), ('1 N m/A', 'V s/rad'), ('1 N m s2/rad', 'kg m2')])
def test_it_lets_the_angle_be_left_out_of_a_speed(text, wanted):
    assert value_in(text, wanted) == 1.0


@pytest.mark.parametrize(('text', 'wanted', 'word'), [
    ('1 kg cm', 'N m', "is it 'kgf cm'"), ('1 oz-in', 'N m', "is it 'ozf-in'"),
    ('1 lb ft', 'N m', "is it 'lbf ft'"), ('1 degF', 'degC', 'scale: 0.5556'),
    ('1 MA', 'A', "is it 'mA'"), ('1 MNM', 'N m', "is it 'mNm'")])
def test_it_offers_the_unit_that_is_probably_meant(text, wanted, word):
    with pytest.raises(UnitError, match=word):
        factor_to(text.removeprefix('1 '), wanted)


def test_a_count_of_an_encoder_is_a_unit():
    assert factor_to('1/4096 rev', 'rad') == pytest.approx(COUNT)


@pytest.mark.parametrize(('wanted', 'example'), [
    ('rad', '1/4096 rev'), ('A', '2.69 mA'), ('s', '2 ms'), ('N m', '3 mN m')])
def test_what_one_count_is_is_asked_for_in_the_quantity_of_the_column(wanted, example):
    assert factor_to(example, wanted) > 0.0
    with pytest.raises(UnitError, match=f'write {example} in place of lsb'):
        factor_to('lsb', wanted)


@pytest.mark.parametrize(('source', 'kind', 'column'), [
    ('Zeit', '', 't'), ('motor_angle [deg]', '', 'motor_position'), ('Winkel', '', ANGLE),
    ('thetaMotor', '', 'motor_position'), ('supply_voltage', '', ''), ('speed', '', ''),
    ('/joint_states.position[a]', 'sensor_msgs/msg/JointState', 'load_position'),
    ('/motor.q', 'Motor', ANGLE), ('target_position', '', 'reference_position'),
    ('/dynamic.interface_values[arm].values[current]', 'DynamicJointState', 'current'),
    ('Commanded Position', '', 'reference_position'), ('Demand Speed', '', 'reference_velocity'),
    ('fActCur', '', 'current'), ('fSetCur', '', 'current_reference'),
    ('Iq_measured', '', 'current'), ('tau_cmd', '', TOLD_TORQUE),
    ('/command/data', '', 'voltage')])
def test_it_tells_columns_by_their_names(source, kind, column):
    assert looks_like(source, kind) == column


def test_a_unit_of_another_quantity_is_quoted_as_it_was_given():
    with pytest.raises(UnitError, match="'N m/A' is no unit of N/A"):
        value_in('0.25 N m/A', 'N/A')


@pytest.mark.parametrize(('source', 'column'), [
    ('Sollstrom [mA]', 'current_reference'), ('Motorwinkel', 'motor_position'),
    ('Lastwinkel', 'load_position'), ('Istwinkel', ANGLE), ('Motorstrom', 'current')])
def test_it_takes_german_names_apart(source, column):
    assert looks_like(source) == column


def test_it_asks_for_the_joint_where_a_bag_has_several_and_says_what_it_left_out():
    names = [f'/joint_states.{kind}[{joint}]' for kind in ('position', 'effort')
             for joint in ('shoulder', 'elbow')]
    of = Offered(Path('bag'), (*names, '/joint_states.stamp'), {}, kinds=dict.fromkeys(
        names, 'sensor_msgs/msg/JointState'))
    joint, asked = choose_joint(of, proposed(of), {}, '', None)
    assert joint == 'shoulder'
    assert asked == ["--joint NAME (of ['shoulder', 'elbow']; what follows is for 'shoulder'), or "
                     '--joint all, which writes the files of each into the folder -o']
    chosen, missing = choose_columns(of, proposed(of, 'elbow'), {}, True, None)
    effort, = missing
    assert effort.startswith("--column 'current=/joint_states.effort[elbow]:N m' where the drive")
    assert chosen['load_position'].source == '/joint_states.position[elbow]'


def test_it_asks_for_the_topic_where_two_tell_the_angle_of_one_joint():
    of = Offered(Path('bag'), (
        dynamic := '/dynamic.interface_values[elbow].values[position]',
        plain := '/joint_states.position[elbow]', '/joint_states.stamp', '/dynamic.stamp'), {},
        kinds={dynamic: 'control_msgs/msg/DynamicJointState',
               plain: 'sensor_msgs/msg/JointState'})
    missing = choose_columns(of, proposed(of, 'elbow'), {}, True, None)[1]
    assert missing == [f"--column load_position=SOURCE (of ['{dynamic}', '{plain}'])"]



@pytest.mark.parametrize(('name', 'unit', 'words'), [
    ('voltage', '%', 'scale: 0.08 where the whole is 8 V'),
    ('current', 'N m', 'torque constant of 1 N m/A'),
    ('voltage', 'N m', 'torque constant of 1 N m/A')])
def test_a_share_or_a_torque_for_a_current_is_refused_with_what_to_give(name, unit, words):
    with pytest.raises(ValueError, match='leave the unit out') as refused:
        factor_of('a column', name, unit, None)
    assert words in str(refused.value)


def test_degrees_take_a_prefix_but_never_that_of_a_million():
    assert factor_to('mdeg', 'rad') == pytest.approx(np.pi / 180e3)
    with pytest.raises(UnitError, match="is it 'mdeg'"):
        factor_to('Mdeg', 'rad')
