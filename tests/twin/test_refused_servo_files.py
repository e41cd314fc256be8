"""A servo file is refused with a sentence that says what is wrong and what to do."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest
from servo_text import BENCH, changed

from servo_twin.description.servo_file import load, loads
from servo_twin.description.shipped import servo_file
from servo_twin.lockstep.live_changes import changed as changed_live
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import (
    DRIVES,
    MECHANISMS,
    Placed,
    Servo,
    ServoError,
)

REFUSED = {
    'bad YAML': ('servo: [a', ['not YAML']),
    'a tab': (BENCH + '\tstep: 1e-4', ['holds a tab']),
    'a wide colon': (changed('bearing:', 'bearing\N{FULLWIDTH COLON}'), ['holds a wide colon']),
    'a ratio with a colon': (changed('22.0', '30:1'), ["level = '30:1' is not a number"]),
    'off': (changed('type: current', 'type: off'), ["drive.type: there is no 'off'"]),
    'a decimal comma': (changed('22.0', '22,5'), ['write a decimal point']),
    'a list': ('[1, 2]', ['the file must be a mapping']),
    'a key that is a list': ('? [a]\n: 1', ['not YAML']),
    'nothing': ('', ["section 'servo' is missing"]),
    'a missing section': ('servo: a\ndrive: {type: current}', ["section 'mechanism' is missing"]),
    'an unknown section': (BENCH + 'efects: {}', ["no 'efects'", "'effects'"]),
    'an unknown drive': (changed('type: current', 'type: hydraulic'),
                         ["drive.type: there is no 'hydraulic'", "'voltage'"]),
    'a missing type': (changed('type: current, ', ''), ['drive.type', "'voltage'"]),
    'an unknown effect': (changed('coulomb_friction', 'coulomb'),
                          ["there is no 'coulomb'", "'coulomb_friction'"]),
    'an unknown parameter': (changed('level:', 'height:'),
                             ["effects.bearing has no parameter 'height'", "['level']"]),
    'an unknown detail': (changed('unit: N m', 'units: N m'), ["no 'units'", "'unit'"]),
    'an unknown place': (changed('at: load', 'at: mesh'), ["no 'mesh'", "'motor', 'load'"]),
    'a missing place': (changed('at: load, ', ''), ['effects.bearing.at', "'motor', 'load'"]),
    'an unknown sensor': (BENCH + 'sensors: {gyro: {}}', ["no 'gyro'", "'load_encoder'"]),
    'out of range': (changed('22.0', '-3'), ['effects.bearing.level = -3 N m is outside',
                                             '[0, 100000]']),
    'not a number': (changed('22.0', 'many'), ["effects.bearing.level = 'many' is not a number"]),
    'NaN': (changed('22.0', '.nan'), ['effects.bearing.level = nan N m is outside']),
    'infinite': (changed('22.0', '.inf'), ['effects.bearing.level = inf N m is outside']),
    'empty': (changed('{value: 22.0, unit: N m, source: a guess}', ''),
              ['effects.bearing.level = None is not a number']),
    'true': (changed('22.0', 'true'), ['effects.bearing.level = True is not a number']),
    'a row for a number': (changed('22.0', '[1, 2]'), ['effects.bearing.level', 'not a number']),
    'no value': (changed('value: 22.0, ', ''), ['effects.bearing.level: the value is missing']),
    'another unit': (changed('unit: N m', 'unit: N cm'),
                     ["effects.bearing.level: the unit is 'N cm', it must be 'N m'"]),
    'a rotary unit on a linear axis': (
        BENCH + 'travel: linear', ["the unit is 'N m', it must be 'N'"]),
    'backlash in a rigid mechanism': (
        changed('two_inertia', 'rigid').replace('stiffness: 5.0e+5, damping: 40.0', '')
        .replace('coulomb_friction, at: load', 'backlash, at: mesh')
        .replace('level', 'width').replace('22.0, unit: N m', '0.1'),
        ['effects.bearing: backlash needs a mesh that winds up, and the mechanism is rigid']),
    'a name that is none': (changed('bearing:', 'my bearing:'), ["'my bearing' is not a name"]),
    'a name that Python keeps': (changed('bearing:', 'class:'), ["'class' is not a name"]),
    'a step of zero': (BENCH + 'step: 0', ['step = 0 s is outside']),
    'a step that is no number': (BENCH + 'step: fast', ["step = 'fast' is not a number"]),
    'an unknown travel': (BENCH + 'travel: sideways', ["no 'sideways'", "'linear'"]),
    'a tolerance of nothing': (BENCH + 'tolerance: {drive.again: 5 %}',
                               ["there is no parameter 'drive.again'"]),
    'a tolerance that is none': (BENCH + 'tolerance: {drive.gain: wide}',
                                 ["'wide' is neither a share like 10 % nor [low, high]"]),
    'a tolerance of a row': (
        BENCH + '  teeth: {effect: cogging, at: motor, order: 6, cosine: [0.1, 0.2], '
                'sine: [0.0, 0.0]}\ntolerance: {effects.teeth.cosine: [0.1, 0.3]}',
        ['tolerance of effects.teeth.cosine', 'a row of 2 values', 'a share like 10 %',
         'effects.teeth.cosine[0]: [low, high]']),
    'a range of a row of zeros': (
        BENCH + '  teeth: {effect: cogging, at: motor, order: 6, cosine: [0.1, 0.2], '
                'sine: [0.0, 0.0]}\ntolerance: {effects.teeth.sine: [0, 0.1]}',
        ['tolerance of effects.teeth.sine', 'effects.teeth.sine[0]: [low, high]']),
    'a tolerance beyond a row': (
        BENCH + '  teeth: {effect: cogging, at: motor, order: 6, cosine: [0.1, 0.2], '
                'sine: [0.0, 0.0]}\ntolerance: {"effects.teeth.cosine[2]": 10 %}',
        ['effects.teeth.cosine[2]', 'a row of 2', 'effects.teeth.cosine[1]']),
    'a tolerance of a row and of one of it': (
        BENCH + '  teeth: {effect: cogging, at: motor, order: 6, cosine: [0.1, 0.2], '
                'sine: [0.0, 0.0]}\n'
                'tolerance: {effects.teeth.cosine: 10 %, "effects.teeth.cosine[1]": 5 %}',
        ['effects.teeth.cosine[1] is given twice']),
    'a tolerance of a row that is one number': (
        BENCH + 'tolerance: {"drive.gain[0]": 10 %}', ['drive.gain is one number']),
    'a tolerance beside the value': (BENCH + 'tolerance: {drive.gain: [1, 2]}',
                                     ['does not hold its value 0.49']),
    'a std that is no number': (changed('source: a guess', 'std: small'),
                                ['effects.bearing.level', "std = 'small' is not a number"]),
    'bags that are no list': (changed('source: a guess', 'bags: 3'),
                              ['effects.bearing.level', 'bags = 3 is not a list']),
    'a name twice': (BENCH + '  bearing: {effect: viscous_friction, at: load}\n',
                     ["'bearing' is there twice"]),
    'an alias': (BENCH.replace('0.49', '&gain 0.49') + 'step: *gain\n', ['an alias (*gain)']),
    'deep nesting': (BENCH + 'tolerance: ' + 500 * '[', ['nested deeper than 20 levels']),
    'a number beyond all floats': (BENCH + f'step: 1{400 * "0"}\n',
                                   ['a whole number of 401 digits is more than a float64']),
    'a date that is none': (BENCH + 'step: 2026-13-77\n', ['a value is none']),
    'rows of other lengths': (
        changed('bearing:', 'net: {effect: network_friction, at: load, forward_angle: [1, 2]}\n'
                '  bearing:'), ['effects.net.forward_speed has 1', 'has 2']),
    'a curve that goes nowhere': (
        BENCH + '  curve: {effect: friction_over_speed, at: load, low: 2, high: 2, curve: [1]}\n',
        ['effects.curve.high = 2 rad/s is not above effects.curve.low = 2 rad/s',
         'Give a higher end']),
    'a curve over a turn from its higher end': (
        BENCH + '  curve: {effect: error_over_angle, low: 1, high: -1, curve: [0, 1e-5]}\n',
        ['effects.curve.high = -1 rad is not above', 'the same for a curve that repeats']),
    'a row that is none': (
        changed('bearing:', 'cog: {effect: cogging, cosine: 3}\n  bearing:'),
        ['effects.cog.cosine = 3 is not a row of numbers']),
}


def test_a_curve_is_not_turned_round_while_a_twin_runs():
    servo = loads(BENCH + '  curve: {effect: torque_over_angle, at: load, low: -1, high: 1,'
                          ' curve: [0.1]}\n')
    with pytest.raises(ServoError, match='not above effects.curve.low'):
        changed_live(servo, {'effects.curve.low': 2.0})


@pytest.mark.parametrize('what', REFUSED)
def test_a_servo_file_is_refused_with_a_clear_sentence_for(what):
    text, words = REFUSED[what]
    with pytest.raises(ServoError) as refusal:
        loads(text, 'my_servo.yaml')
    assert str(refusal.value).startswith('my_servo.yaml: ')
    for word in words:
        assert word in str(refusal.value)


def test_a_file_that_is_not_there_is_refused_with_its_name(tmp_path):
    with pytest.raises(ServoError, match='nothing.yaml: cannot be read'):
        load(tmp_path / 'nothing.yaml')


def test_a_file_that_is_not_text_is_refused_with_its_name(tmp_path):
    (tmp_path / 'servo.yaml').write_bytes(b'\xff\xfe\x00')
    with pytest.raises(ServoError, match='servo.yaml: cannot be read'):
        load(tmp_path / 'servo.yaml')


@settings(max_examples=300, deadline=None)
@given(text=st.text(st.sampled_from(list('servo: {}[]"\'|>&*!%#@`,?-~.\n\t0129abc')),
                    max_size=60))
def test_no_text_makes_it_fail_otherwise_than_by_refusing(text):
    for whole in (text, BENCH + text, BENCH.replace('22.0', text)):
        try:
            loads(whole)
        except ServoError:
            pass


def test_two_effects_of_one_name_are_refused():
    twice = (Placed('a', find('backlash'), 'mesh'),) * 2
    with pytest.raises(ServoError, match="two effects are named 'a'"):
        Servo('s', DRIVES['current'], MECHANISMS['two_inertia'], effects=twice)


def test_a_value_of_no_parameter_is_refused():
    with pytest.raises(ServoError, match="there is no parameter 'drive.gian'"):
        loads(BENCH).with_values({'drive.gian': 1.0})


def test_a_file_longer_than_any_servo_is_refused_unread():
    with pytest.raises(ServoError, match='too long; a servo file has at most'):
        loads('# ' + 'x' * 1_000_001)


def test_a_folder_is_no_servo_file(tmp_path):
    with pytest.raises(ServoError, match='it is a folder; give the path of one'):
        servo_file(tmp_path)
