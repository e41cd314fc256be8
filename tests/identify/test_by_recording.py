"""What differs from recording to recording: friction that warms up, a zero that drifts."""

from dataclasses import replace
import re

import numpy as np
import pytest
from synthetic_recordings import run_of
from test_selection import recorded, SERVO, with_effect

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.handed import selecting
from servo_identify.diagnose.mechanisms.builder import Builder
from servo_identify.diagnose.mechanisms.by_recording import between, within_one
from servo_identify.diagnose.mechanisms.every_hypothesis import hypotheses_of
from servo_identify.diagnose.mechanisms.hypothesis import BY_RECORDING
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained
from servo_identify.diagnose.splitting import split
from servo_twin.description.servo_file import loads
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
def test_wind_that_pushes_otherwise_in_each_recording_is_no_weight():
    several = [recorded(with_effect('constant_torque', 'load', torque=push), seed)
               for seed, push in enumerate((-30.0, 12.0, 40.0, -8.0, 25.0, 3.0))]
    report = report_of(several)
    first = report.which[0]
    assert (first.effect, first.site) == ('constant_torque', 'load')
    low, high = map(float, re.findall(r'(\S+) \(', first.change))
    assert np.allclose((low, high), (-30.0, 40.0), atol=1.0)
    assert 'record it as external_torque' in report.verdict['sentence']


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


@pytest.mark.long
def test_where_each_motion_was_recorded_once_the_motion_may_be_what_differs():
    several = [replace(off(recorded(SERVO, seed), more), family=f'motion {seed}')
               for seed, more in enumerate((0.0, 3.0, 6.0, 9.0))]
    assert all('by recording' not in one.change for one in report_of(several).which)


@pytest.mark.long
def test_teeth_that_wear_are_a_clearance_that_is_another_in_each_recording():
    widths = (2e-4, 6e-4, 1.1e-3, 1.7e-3)
    several = [recorded(SERVO.with_effects(Placed('gap', find('backlash'), 'mesh'), values={
        'effects.gap.width': width}), seed) for seed, width in enumerate(widths)]
    found = explained(residual_samples(several, SERVO))
    assert [one.mechanism.label for one in found.chosen] == ['backlash (mesh)']
    sizes = found.amplitudes(found.explanation.smallest.choice.numbers[0])
    assert sizes == pytest.approx(widths, abs=1e-4)


MIXER = """
servo: mixer
step: 1.0e-4
drive: {type: voltage, gain: 1.0, resistance: 0.6, inductance: 0.0, back_emf: 0.04,
        torque_constant: 0.04}
mechanism: {type: rigid, rotor_inertia: 2.4e-4, load_inertia: 0.0, ratio: 1.0}
controller: {type: none}
sensors: {motor_encoder: {noise: 4.4e-4}, current_sensor: {noise: 0.03}}
effects:
  rubs: {effect: coulomb_friction, at: motor, level: 0.04}
  drags: {effect: viscous_friction, at: motor, slope: 1.2e-3}
tolerance: {drive.torque_constant: 4 %, mechanism.rotor_inertia: 8 %}
"""


def mixed(seed, cold, more, period=5e-3, rows=4000, fine=50):
    """Return a motor whose winding warms up evenly, from ``cold`` ohm by ``more``."""
    time, chance = period * np.arange(rows), np.random.default_rng(seed)
    volts = sum(3.0 * np.sin(2.0 * np.pi * f * time + seed * f) for f in (0.2, 0.5, 1.1, 2.3))
    speed, angle, seen = 0.0, 0.0, []
    for k in range(rows):
        resistance = cold + more * k / rows
        seen.append((angle, (volts[k] - 0.04 * speed) / resistance))  # just after it acts
        for _ in range(fine):
            push = 0.04 * (volts[k] - 0.04 * speed) / resistance - 1.2e-3 * speed
            speed += period / fine * (push - 0.04 * np.tanh(speed / 0.05)) / 2.4e-4
            angle += period / fine * speed
    angle, current = np.array(seen).T
    known = {'voltage': volts, 'current': current + 0.03 * chance.standard_normal(rows),
             'motor_position': angle + 4.4e-4 * chance.standard_normal(rows)}
    return run_of(seed, period, known, 'tones')


@pytest.mark.long
@pytest.mark.slow
def test_a_winding_that_warms_up_in_each_recording_is_one_resistance():
    """It had been a gain of the drive that changes over time, beside a resistance."""
    several = [mixed(seed, cold, 0.06) for seed, cold in enumerate((0.6, 0.68, 0.75, 0.62))]
    servo = loads(MIXER)
    found = explained(residual_samples(several, servo))
    assert [one.mechanism.label for one in found.chosen] == ['parameter:resistance (drive)']
    one, number = found.chosen[0], found.explanation.smallest.choice.numbers[0]
    words = one.detail['told'](one.knots, found.amplitudes(number), servo)
    low, high, within = map(float, re.fullmatch(
        r'(\S+) \(run_0\) to (\S+) \(run_2\) ohm, by recording, and by (\S+) ohm within one',
        words).groups())
    assert (low, high, within) == pytest.approx((0.63, 0.78, 0.06), abs=0.02)


def test_what_changes_most_within_a_recording_is_told():
    values = np.array([1.0, -0.2, 2.0, -0.5, 3.0, 0.1])
    assert within_one([0, 0, 1, 1, 2, 2], values, 'N m') == ', and by -0.5 N m within one'
    assert within_one([0, 0, 1, 1, 2, 2], values, '') == ', and by -0.5 within one'
    assert within_one([0, 1, 2], values[::2], 'N m') == ''


def test_recordings_that_have_one_of_two_values_are_told_by_those_that_are_fewer():
    names, knots = ['a', 'b', 'c', 'd', 'e'], [0, 1, 2, 3, 4]
    two = between(names, knots, np.array([0.01, 3.1, 0.0, 3.0, 0.02]), 'N m')
    assert two == 'in d, b 3.05 N m, in the others 0.01, by recording'
    even = between(names, knots, np.array([1.0, 2.0, 3.0, 4.0, 5.0]), 'ohm')
    assert even == '1 (a) to 5 (e) ohm, by recording'


@pytest.mark.parametrize(('count', 'differs'), [(1, False), (4, True)])
def test_parts_of_one_recording_are_no_repetition_of_a_motion(count, differs):
    parts = split([recorded(SERVO, seed) for seed in range(count)], [], [])
    samples = residual_samples(selecting(parts, False), SERVO)
    several = hypotheses_of(Builder(samples), samples.base)
    assert any(BY_RECORDING in one.mechanism.variables for one in several) is differs
