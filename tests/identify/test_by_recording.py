"""What differs from recording to recording: friction that warms up, a zero that drifts."""

from dataclasses import replace
import re

import numpy as np
import pytest
from test_selection import recorded, SERVO

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.mechanisms.by_recording import between
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

LEVEL = 'effects.coulomb.level'


def rubbing(times):
    return SERVO.with_values({LEVEL: times * SERVO.numbers[LEVEL]})


def off(recording, more):
    columns = recording.columns | {'torque': recording.columns['torque'] + more}
    return replace(recording, columns=columns)


def report_of(recordings):
    *first, second, third = recordings
    return diagnose(first, SERVO, [second], [third]).report


@pytest.mark.long
@pytest.mark.slow
def test_friction_that_falls_from_recording_to_recording_is_named_with_its_range():
    several = [recorded(rubbing(times), seed) for seed, times in enumerate((4.0, 3.0, 2.0, 1.5))]
    report = report_of([*several, recorded(SERVO, 7), recorded(SERVO, 8)])
    assert [(one.effect, one.site) for one in report.which] == [('friction_drift', 'load')]
    assert 'by recording' in report.which[0].change
    assert 'warms up' in report.verdict['sentence']
    assert report.which[0].shrink_realised > 0.8  # of its equation
    assert report.gap['after'] == report.gap['before']  # no file can hold it


@pytest.mark.long
@pytest.mark.slow
def test_a_zero_of_the_torque_sensor_that_differs_is_told_between_its_ends():
    several = [off(recorded(SERVO, seed), more) for seed, more in enumerate((0.0, 3.0, 6.0, 9.0))]
    report = report_of([*several, recorded(SERVO, 7), recorded(SERVO, 8)])
    assert [(one.effect, one.site) for one in report.which] == [('torque_sensor_offset', 'torque')]
    low, high = map(float, re.findall(r'(\S+) \(', report.which[0].change))
    assert np.allclose((low, high), (0.0, 9.0), atol=0.5)
    assert 'zero' in report.verdict['sentence']


@pytest.mark.long
@pytest.mark.slow
def test_a_zero_that_is_the_same_in_all_is_one_value():
    report = report_of([off(recorded(SERVO, seed), 6.0) for seed in range(6)])
    assert [one.effect for one in report.which] == ['torque_sensor_offset']
    assert report.which[0].parameters['offset']['value'] == pytest.approx(6.0, abs=0.5)


@pytest.mark.slow
def test_where_each_motion_was_recorded_once_the_motion_may_be_what_differs():
    several = [replace(off(recorded(SERVO, seed), more), family=f'motion {seed}')
               for seed, more in enumerate((0.0, 3.0, 6.0, 9.0))]
    assert all('by recording' not in one.change for one in report_of(several).which)


@pytest.mark.slow
def test_teeth_that_wear_are_a_clearance_that_is_another_in_each_recording():
    widths = (2e-4, 6e-4, 1.1e-3, 1.7e-3)
    several = [recorded(SERVO.with_effects(Placed('gap', find('backlash'), 'mesh'), values={
        'effects.gap.width': width}), seed) for seed, width in enumerate(widths)]
    found = explained(residual_samples(several, SERVO))
    assert [one.mechanism.label for one in found.chosen] == ['backlash (mesh)']
    sizes = found.amplitudes(found.explanation.smallest.choice.numbers[0])
    assert sizes == pytest.approx(widths, abs=1e-4)


def test_recordings_that_have_one_of_two_values_are_told_by_those_that_are_fewer():
    names, knots = ['a', 'b', 'c', 'd', 'e'], [0, 1, 2, 3, 4]
    two = between(names, knots, np.array([0.01, 3.1, 0.0, 3.0, 0.02]), 'N m')
    assert two == 'in d, b 3.05 N m, in the others 0.01, by recording'
    even = between(names, knots, np.array([1.0, 2.0, 3.0, 4.0, 5.0]), 'ohm')
    assert even == '1 (a) to 5 (e) ohm, by recording'
