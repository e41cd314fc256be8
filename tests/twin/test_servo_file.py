"""The servo file: read, and written so that it reads back as the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from hypothesis import assume, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from servo_text import BENCH, changed

from servo_twin.description.given_values import Default, defaults, required
from servo_twin.description.servo_file import dumps, load, loads, save
from servo_twin.physics.catalogue import find, names
from servo_twin.physics.curve_ends import check_curves
from servo_twin.physics.servo import (
    CONTROLLERS,
    DRIVES,
    MECHANISMS,
    Placed,
    Provenance,
    SENSORS,
    Servo,
    ServoError,
)
from servo_twin.physics.step_limit import check_step, longest_step

SHIPPED = sorted((Path(__file__).parents[2] / 'config' / 'servos').glob('*.yaml'))


@st.composite
def servos(draw):
    """Any servo that the parts and effects there are can make."""
    mechanism = draw(st.sampled_from(list(MECHANISMS.values())))
    unfit = () if mechanism.compliant else ('mesh', 'clearance')
    unfit += () if mechanism.carries else ('inertia',)
    fitting = [n for n in names() if find(n).port not in unfit]
    effects = tuple(
        Placed(f'e{i}', find(n), draw(st.sampled_from(find(n).sites)))
        for i, n in enumerate(draw(st.lists(st.sampled_from(fitting), max_size=4))))
    parts = {'drive': draw(st.sampled_from(list(DRIVES.values()))), 'mechanism': mechanism,
             'controller': draw(st.sampled_from(list(CONTROLLERS.values())))}
    sensors = tuple(draw(st.lists(st.sampled_from(list(SENSORS.values())), unique=True)))
    plain = Servo(draw(st.text(st.characters(codec='utf-8', exclude_categories=['C', 'Z']),
                               min_size=1)), **parts, sensors=sensors, effects=effects,
                  linear=draw(st.booleans()), step=draw(st.floats(1e-7, 0.1)))
    values, provenance, tolerance = {}, {}, {}
    for path, parameter in plain.declarations():
        number = st.floats(*parameter.bounds)
        if parameter.row:
            length = len(plain.values[path])
            values[path] = tuple(draw(st.lists(number, min_size=length, max_size=length)))
        else:
            values[path] = draw(number)
            if draw(st.booleans()):
                tolerance[path] = (values[path] - 1.0, values[path])
        if draw(st.booleans()):
            provenance[path] = Provenance(
                draw(st.text(st.characters(codec='ascii', categories=['L', 'P']))),
                draw(st.none() | st.floats(0.0, 1e6)),
                tuple(draw(st.lists(st.sampled_from(['one.bag', 'run: 2', "o'clock"])))))
    provenance = {p: v for p, v in provenance.items() if v != Provenance()}
    return Servo(plain.name, **parts, sensors=sensors, effects=effects, values=values,
                 tolerance=tolerance, provenance=provenance, step=plain.step,
                 linear=plain.linear)


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(servo=servos())
def test_a_written_servo_reads_back_as_the_same_servo(servo):
    servo = replace(servo, step=min(servo.step, max(1e-7, longest_step(servo) / 4.0)))
    try:
        check_curves(servo)
        check_step(servo)
    except ServoError:
        assume(False)  # stiffer than the shortest step, or a curve without a length
    again = loads(dumps(servo))
    assert again == servo
    assert np.array_equal(again.theta, servo.theta)
    assert dumps(again) == dumps(servo)


def test_a_saved_file_loads_as_the_same_servo(tmp_path):
    servo = loads(BENCH)
    save(servo, tmp_path / 'servo.yaml')
    assert load(tmp_path / 'servo.yaml') == servo


@pytest.mark.parametrize('file', SHIPPED, ids=lambda f: f.stem)
def test_a_shipped_servo_file_loads_and_says_where_its_values_come_from(file):
    servo = load(file)
    assert servo.sensors and servo.tolerance
    said = [p for p in servo.values if p.startswith(('drive.', 'mechanism.', 'effects.'))
            and p in servo.provenance]
    assert said


def test_a_value_keeps_where_it_comes_from():
    servo = loads(changed('source: a guess', 'source: a guess, std: 0.5, bags: [a.bag]'))
    assert servo.provenance['effects.bearing.level'] == Provenance('a guess', 0.5, ('a.bag',))


def test_what_is_left_out_takes_its_default_and_is_listed():
    servo = loads(BENCH + 'sensors: {load_encoder: {}}\ncontroller: {type: position_loop, '
                  'kp: 20.0, kv: 3.0}')
    listed = {one.path: one for one in defaults(servo)}
    assert listed['sensors.load_encoder.noise'] == Default('sensors.load_encoder.noise', 1e-6,
                                                           'rad')
    assert (listed['step'].value, listed['step'].unit) == (1e-4, 's')
    assert servo.values['controller.limit'] == listed['controller.limit'].value == 10.0
    assert not {path for path in listed if path.startswith(('drive', 'mechanism', 'effects'))}
    assert loads(BENCH).controller.name == 'open'


def test_a_default_is_listed_until_another_value_takes_its_place():
    servo = loads(BENCH + 'sensors: {load_encoder: {}}')
    other = servo.with_values({'sensors.load_encoder.noise': 2e-6})
    assert {one.path for one in defaults(servo)} - {one.path for one in defaults(other)} == {
        'sensors.load_encoder.noise'}
    assert defaults(loads(dumps(servo))) == ()


def test_a_default_that_is_so_by_nature_is_not_listed_unless_it_is_per_metre():
    weight = BENCH + ('  weight: {effect: gravity, cosine: {value: 3.0}, sine: 0.0}\n'
                      '  cog: {effect: cogging, cosine: [0.01], sine: [0.0]}\n')
    listed = {one.path for one in defaults(loads(weight))}
    assert not {'effects.weight.order', 'observer.bandwidth'} & listed
    assert 'effects.cog.order' in listed  # how often a motor cogs is not known by nature
    straight = loads(weight.replace('22.0, unit: N m', '22.0, unit: N') + 'travel: linear\n')
    assert 'effects.weight.order' in {one.path for one in defaults(straight)}


def test_every_missing_value_that_results_hang_on_is_refused_by_name_unit_and_meaning():
    with pytest.raises(ServoError) as refusal:
        loads('servo: three_lines\ndrive: {type: voltage}\nmechanism: {type: rigid}\n')
    said = str(refusal.value)
    for line in ('drive.resistance [ohm]: Of the winding and the leads.',
                 'drive.back_emf [V s/rad]: ', 'drive.torque_constant [N m/A]: ',
                 'mechanism.rotor_inertia [kg m2]: ', 'mechanism.load_inertia [kg m2]: ',
                 'mechanism.ratio: Motor turns for one turn of the load.'):
        assert line in said
    assert 'inductance' not in said  # off where it is left out


@pytest.mark.parametrize('kind', [*DRIVES, *MECHANISMS])
def test_no_inertia_ratio_or_motor_constant_has_a_silent_default(kind):
    part = (DRIVES | MECHANISMS)[kind]
    hang_on = {'rotor_inertia', 'load_inertia', 'ratio', 'torque_constant', 'resistance',
               'back_emf', 'phase_resistance', 'stiffness'}
    assert hang_on & set(part.parameters) <= set(required(part))


def test_an_effect_without_its_size_is_refused():
    with pytest.raises(ServoError, match=r'effects.bearing.level \[N m\]: What it resists with'):
        loads(changed(', level: {value: 22.0, unit: N m, source: a guess}', ''))


def test_an_effect_with_one_place_needs_none_named():
    servo = loads(changed('effect: coulomb_friction, at: load, level: {value: 22.0, unit: N m, '
                          'source: a guess}', 'effect: backlash, width: 1.0e-3'))
    assert servo.effects[0].site == 'mesh'


def test_a_tolerance_is_a_share_or_two_bounds():
    servo = loads(BENCH + 'tolerance: {mechanism.ratio: 10 %, drive.gain: [0.4, 0.5]}')
    assert servo.tolerance['mechanism.ratio'] == pytest.approx((144.9, 177.1))
    assert servo.tolerance['drive.gain'] == (0.4, 0.5)


@pytest.mark.parametrize(('written', 'value'), [('022', 22.0), ('22', 22.0), ('+2.2e1', 22.0),
                                                ('22.', 22.0), ('.5', 0.5), ('1e-5', 1e-5)])
def test_a_number_is_the_decimal_one_that_it_looks_like(written, value):
    assert loads(changed('22.0', written)).values['effects.bearing.level'] == value


def test_a_curve_whose_ends_are_alike_repeats_each_turn():
    loads(BENCH + '  curve: {effect: error_over_angle, low: 0, high: 0, curve: [0, 1e-5, 0, 0]}\n')


def test_an_effect_goes_with_all_that_was_said_of_it():
    servo = loads(BENCH)
    placed = Placed('bearing_too', find('viscous_friction'), 'load')
    values = placed.paths({'slope': 2.0})
    more = servo.with_effects(placed, values=values, provenance=dict.fromkeys(
        values, Provenance('a guess')))
    assert more.values['effects.bearing_too.slope'] == 2.0
    assert more.without_effects(lambda one: one.name == 'bearing_too') == servo
    assert not more.without_effects(lambda one: one.site == 'load').provenance


@pytest.mark.parametrize('written', ['1e-5', '1E-5', '1.0e-5', '+1e-05', '.1e-4', '0.00001'])
def test_a_number_may_be_written_with_or_without_a_point(written):
    text = SHIPPED[0].read_text()
    head = '\n'.join(line for line in text.splitlines() if not line.startswith('step:'))
    assert loads(f'{head}\nstep: {written}\n').step == 1e-5
