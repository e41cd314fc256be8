"""Values of the file that vary over temperature or speed, or from recording to recording."""

from dataclasses import replace

import numpy as np
import pytest
from test_selection import recorded, SERVO

from servo_identify.diagnose.diagnose import diagnose
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

CONSTANT = 'drive.torque_constant'


def weak(recording, share, temperature=None):
    """Return a recording that took more current, of a motor with this share of its torque."""
    columns = recording.columns | {'current': recording.columns['current'] / share,
                                   'voltage': recording.columns['voltage'] / share}
    if temperature is not None:
        columns['temperature'] = np.full(len(recording), temperature)
    return replace(recording, columns=columns)


def report_of(recordings):
    *first, second, third = recordings
    return diagnose(first, SERVO, [second], [third]).report


@pytest.mark.long
def test_a_torque_constant_that_falls_with_temperature_has_its_curve():
    several = [weak(recorded(SERVO, seed), 1.0 - 0.04 * seed, 20.0 + 10.0 * seed)
               for seed in range(6)]
    one, = report_of(several).which
    assert (one.effect, one.site) == ('torque_constant_error', 'motor')
    assert one.mechanism['variables'] == ['current', 'temperature']
    rise = np.polyfit(one.curve['x'], one.curve['y'], 1)[0] / SERVO.numbers[CONSTANT]
    assert rise == pytest.approx(-0.004, rel=0.3)
    assert 'degC' in one.change


@pytest.mark.long
@pytest.mark.slow
def test_without_a_temperature_it_differs_by_recording():
    several = [weak(recorded(SERVO, seed), 1.0 - 0.06 * seed) for seed in range(6)]
    one, = report_of(several).which
    assert one.effect == 'torque_constant_error' and 'by recording' in one.change


@pytest.mark.long
def test_a_field_that_is_weakened_shows_over_speed():
    def fading(seed):
        one = recorded(SERVO, seed)
        speed = np.gradient(one.columns['motor_position'], one.period)
        smooth = np.convolve(speed, np.ones(41) / 41.0, 'same')
        return weak(one, 1.0 - 0.3 * (smooth / np.max(np.abs(smooth)))**2)

    one, = report_of([fading(seed) for seed in (1, 2, 3)]).which
    assert one.effect == 'torque_constant_error'
    assert one.mechanism['variables'] == ['current', 'speed']
    assert one.curve['y'][0] > one.curve['y'][-1]


@pytest.mark.long
@pytest.mark.slow
def test_of_a_cold_and_a_warm_recording_friction_has_its_slope_over_the_temperature():
    def warm(seed, temperature, viscous):
        rig = SERVO.with_effects(Placed('grease', find('viscous_friction'), 'load'), values={
            'effects.grease.slope': viscous})
        one = recorded(rig, seed, seconds=12.0)
        columns = {**one.columns, 'temperature': temperature + 0.1 * one.time}
        return replace(one, name=f'at_{temperature:g}', family=f'at_{temperature:g}',
                       columns=columns)

    answer = diagnose([warm(1, 20.0, 60.0), warm(2, 40.0, 20.0)], SERVO)
    assert [len(part) for part in answer.report.recordings.values()] == [2, 2, 2]
    drift = next(one for one in answer.report.which if one.effect == 'friction_drift')
    assert drift.parameters['slope']['value'] == pytest.approx(-2.0, rel=0.3)
    assert drift.parameters['slope']['unit'] == 'N m s/rad degC'
    assert answer.report.gap['solved'] > 0.5


@pytest.mark.long
@pytest.mark.slow
def test_grease_that_thins_exponentially_has_its_law():
    """Six recordings at six temperatures: 60 N m at 20 degC, a third of it every 8 degC."""
    def warm(seed, temperature):
        rig = SERVO.with_effects(Placed('grease', find('coulomb_friction'), 'load'), values={
            'effects.grease.level': 60.0 * np.exp(-(temperature - 20.0) / 8.0)})
        one = recorded(rig, seed, seconds=8.0)
        columns = {**one.columns, 'temperature': temperature + 0.01 * one.time}
        return replace(one, name=f'at_{temperature:g}', family='move', columns=columns)

    answer = diagnose([warm(seed, temperature) for seed, temperature in enumerate(
        (20.0, 24.0, 31.0, 45.0, 22.0, 36.0))], SERVO)
    drift = next(one for one in answer.report.which if one.effect == 'friction_drift')
    assert drift.parameters['thinning']['value'] == pytest.approx(0.125, rel=0.3)
    assert drift.parameters['thinning']['unit'] == '1/degC'
    assert answer.report.gap['equation_solved'] > 0.9
