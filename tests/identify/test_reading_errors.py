"""Readings that are off: torque over its angle or late, encoders over a turn, a wrong ratio."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from test_selection import named_by_equations, recorded, SERVO, with_effect

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.mechanisms.orders import strongest

TORQUE = ('torque_sensor_offset', 'torque')
MOTOR = ('motor_encoder_eccentricity', 'motor_position')


@pytest.mark.long
@pytest.mark.parametrize(('rig', 'truth'), [
    (with_effect('torque_sensor_ripple', 'torque', order=2.0, cosine=(3.0,), sine=(2.0,)),
     TORQUE),
    (with_effect('torque_sensor_hysteresis', 'torque', level=8.0, travel=60.0),
     ('torque_sensor_hysteresis', 'torque')),
    (with_effect('sensor_delay', 'torque', delay=0.006), ('sensor_delay', 'torque')),
    (SERVO.with_values({'mechanism.ratio': 1.01 * SERVO.numbers['mechanism.ratio']}),
     ('parameter:ratio', 'mesh')),
], ids=['over its angle', 'loops', 'late', 'ratio'])
def test_what_is_off_is_named(rig, truth):
    assert named_by_equations([recorded(rig, seed) for seed in (1, 2)]) == {truth}


@pytest.mark.long
@pytest.mark.slow
def test_an_error_over_the_turn_of_the_motors_encoder_keeps_its_size_though_the_twin_drifts():
    rig = with_effect('motor_encoder_eccentricity', 'motor_position', order=3.0,
                      cosine=(6e-3,), sine=(-4e-3,))
    first, second, third = (recorded(rig, seed) for seed in (1, 2, 3))
    answer = diagnose([first], SERVO, [second], [third])
    assert [(one.effect, one.site) for one in answer.report.which] == [MOTOR]
    found = answer.augmented.values
    assert found['effects.motor_encoder_eccentricity.order'] == 3.0
    assert found['effects.motor_encoder_eccentricity.cosine'][0] == pytest.approx(6e-3, rel=0.03)
    assert found['effects.motor_encoder_eccentricity.sine'][0] == pytest.approx(-4e-3, rel=0.03)
    assert 'per turn of the motor' in answer.report.which[0].change


@pytest.mark.long
@pytest.mark.slow
def test_the_wheel_of_a_shaft_between_motor_and_load_has_no_whole_order():
    order = 64.0 / 19.0
    time = np.linspace(0.0, 1.0, 8000)
    angle = 12.0 * np.pi * (1.0 + np.sin(6.0 * np.pi * time))
    noise = np.random.default_rng(0).normal(0.0, 0.5, len(angle))
    found, tried = strongest(angle, np.cos(order * angle + 1.0) + noise, np.ones(len(angle)), 0.3)
    assert found[0] == pytest.approx(order, abs=2e-3)
    assert tried > 1000  # each costs: chance finds a wave among many


@pytest.mark.long
@pytest.mark.slow
def test_noise_that_a_filter_has_passed_is_no_fault_where_the_file_says_how_much_it_is():
    several, size = [], 2.0 * SERVO.noise('current')
    for seed in (1, 2, 3):
        one = recorded(SERVO, seed)
        noise = lfilter([1.0], [1.0, -0.9], np.random.default_rng(seed).normal(size=len(one)))
        several.append(replace(one, columns={
            **one.columns, 'current': one.columns['current'] + size * noise / noise.std()}))
    noisy = SERVO.with_values({'sensors.current_sensor.noise': 1.2 * size})
    for servo, status in ((noisy, 'no_gap'), (SERVO, 'unknown')):
        answer = diagnose(several[:1], servo, several[1:2], several[2:])
        assert answer.report.verdict['status'] == status
