"""The verdict as a person is told it."""

from dataclasses import replace

import pytest

from servo_identify.diagnose.answer.report import Alternative, MissingEffect
from servo_identify.diagnose.answer.sentences import sentence
from servo_identify.diagnose.answer.telling import confirmations
from servo_twin.description import servo_file

GAP = {'shrink': 0.9, 'solved': 0.9}
TWO_INERTIAS = """
servo: gripper
drive: {type: current, gain: 1.0, torque_constant: 0.05}
mechanism: {type: two_inertia, rotor_inertia: 1.0e-5, load_inertia: 0.6, ratio: 100,
            stiffness: 1.74e+5, damping: 40.0}
"""
PATTERN = {'depends_on': ['angle'], 'parity': 'even', 'size': '0.22 N m'}


def missing(effect, site):
    return MissingEffect(
        effect, site, {}, 0.9, 0.9, (0.8, 1.0), (), 'law', {'mechanism': 1.0},
        {'port': 'torque', 'site': site, 'variables': ['angle'], 'symmetry': 'odd',
         'memory': False, 'driving': False}, True, None, (), '2 N m')


def test_it_names_the_place_of_an_effect_once():
    told = sentence('explained', [missing('hysteresis', 'mesh')], 'transmission', GAP, {})
    assert told.startswith('The transmission is missing hysteresis (2 N m). Adding it removes')
    told = sentence('explained', [missing('gravity', 'load')], 'load', GAP, {})
    assert told.startswith('The load-side torque balance is missing gravity at the load shaft (')


@pytest.mark.parametrize('held', [True, False])
def test_it_tells_of_a_pattern_without_a_name_beside_effects_that_have_one(held):
    told = sentence('partly_explained', [missing('gravity', 'load')], 'load', GAP,
                    PATTERN | {'held': held})
    assert ('What else is missing has no name in the list. It depends on the angle of the shaft '
            'and is even in the direction of motion. Its size is 0.22 N m.') in told
    assert ('The new file holds it as a curve. Adding them' in told) == held


@pytest.mark.parametrize(('taken', 'so'), [(0.95, True), (0.58, False)])
def test_a_setting_that_leaves_most_of_a_gap_is_not_said_to_be_the_controllers(taken, so):
    gain = replace(missing('controller_mismatch', 'controller'), parameters={'kv': {}},
                   shrink_realised=taken)
    told = sentence('partly_explained', [gain], 'controller', {'solved': 0.0, 'shrink': 0.0}, {})
    assert ('Set the controller of the servo file so.' in told) == so
    assert ('This setting takes 58 % of what the controller deviates from its law' in told) != so


def test_what_else_it_may_be_is_told_after_what_a_value_is_compared_with():
    other = Alternative('drive_saturation', 'command', 0.4, '')
    gain = replace(missing('parameter:gain', 'drive'), rung='place', alternatives=(other,))
    told = sentence('partly_explained', [gain], 'drive', {'solved': 0.3, 'shrink': 0.3}, {})
    assert 'has another value of gain (2 N m) than the servo file, or perhaps drive' in told
    weight = replace(missing('gravity', 'load'), rung='place', alternatives=(other,))
    told = sentence('partly_explained', [weight, gain], 'load', {'solved': 0.3, 'shrink': 0.3}, {})
    assert ('gravity at the load shaft (2 N m), or perhaps drive saturation, and the rig has '
            'another value of gain (2 N m) than the servo file') in told


def test_a_value_is_compared_with_what_was_found_of_it_and_with_no_namesake():
    servo = servo_file.loads(TWO_INERTIAS)
    spring = replace(missing('spring_load', 'load'), parameters={
        'stiffness': {'value': 338.0, 'std': 7.0, 'unit': 'N m/rad'},
        'rest': {'value': 0.1, 'std': 0.01, 'unit': 'rad'}}, ambiguous_with=())
    lost = replace(missing('backlash', 'mesh'), parameters={
        'width': {'value': 1e-4, 'std': 1e-5, 'unit': 'rad'}}, ambiguous_with=('stiffness_error',))
    said = [one for one in confirmations([spring, lost], servo) if 'by itself' in one]
    assert len(said) == 1 and '1.74e+05' in said[0] and '338' not in said[0]
    soft = replace(missing('stiffness_error', 'mesh'), parameters={
        'stiffness': {'value': 9e4, 'std': 1e3, 'unit': 'N m/rad'}}, ambiguous_with=())
    said = [one for one in confirmations([spring, soft], servo) if 'by itself' in one]
    assert len(said) == 1 and 'this diagnosis 9e+04 N m/rad' in said[0]
