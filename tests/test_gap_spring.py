"""A rigid twin beside machines that bend and that do not, integrated here on their own."""

from math import pi, sin, tanh

import numpy as np
import pytest

from servo_identify.gap.diagnose import diagnose
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import names
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.recording.recording import Recording

FEW = tuple(n for n in names() if n not in (
    'viscous_friction', 'load_dependent_friction', 'sensor_delay', 'transmission_error'))
"""A small catalogue compiles in seconds; these are what could be taken for a spring."""
PERIOD, FINE, RATIO, ROTOR, LOAD, GAIN = 1e-3, 20, 30.0, 2e-4, 0.6, 0.11
TWIN = """
servo: joint
step: 1.0e-3
drive: {type: current, gain: 1.0, torque_constant: 0.11}
mechanism: {type: rigid, rotor_inertia: 2.0e-4, load_inertia: 0.6, ratio: 30.0}
effects:
  bearing: {effect: coulomb_friction, at: load, level: 1.5}
  oil: {effect: viscous_friction, at: motor, slope: 4.0e-4}
tolerance:
  drive.torque_constant: 5 %
  mechanism.rotor_inertia: 10 %
  mechanism.load_inertia: 10 %
  effects.bearing.level: [0.0, 5.0]
  effects.oil.slope: [0.0, 2.0e-3]
"""


def moved(stiffness, damping, seed, torque_sensor, seconds=6.0):
    """Return a recording of a joint; stiffness in N m/rad, None for a shaft that does not bend."""
    rate, steps = PERIOD / FINE, int(seconds / PERIOD)
    rows = np.empty((steps, 5))
    motor = load = motor_speed = load_speed = 0.0
    swings = [(0.4, 0.9), (0.9, 0.7), (2.3, 0.9), (5.1, 0.8), (9.7, 0.9), (17.0, 0.8)]
    for k in range(steps):
        at = k * PERIOD
        current = sum(a * sin(2 * pi * f * at + seed * f) for f, a in swings)
        for _ in range(FINE):
            drag = 1.5 * tanh(load_speed / 2e-3)
            push = GAIN * current - 4e-4 * motor_speed
            if stiffness is None:
                carried = (LOAD * push / RATIO + ROTOR * drag) / (ROTOR + LOAD / RATIO**2)
            else:
                carried = stiffness * (motor / RATIO - load) + damping * (
                    motor_speed / RATIO - load_speed)
            motor_speed += rate * (push - carried / RATIO) / ROTOR
            load_speed += rate * (carried - drag) / LOAD
            if stiffness is None:
                motor_speed = load_speed * RATIO
            motor += rate * motor_speed
            load += rate * load_speed
        rows[k] = current, motor, load, carried, at
    chance = np.random.default_rng(seed)
    current, motor, load, carried, _ = rows.T
    columns = {
        'voltage': np.append(current[1:], current[-1]),
        'current': current + chance.normal(0.0, 2e-3, steps),
        'motor_position': np.round(motor / 1e-4) * 1e-4,
        'load_position': load + 0.3 + chance.normal(0.0, 2e-6, steps)}
    if torque_sensor:
        columns['torque'] = carried + chance.normal(0.0, 0.02, steps)
    return Recording(f'swings_{seed}', PERIOD, columns, family='multisine', replicate=seed)


def diagnosed(stiffness, damping, torque_sensor):
    first, second, third = (moved(stiffness, damping, seed, torque_sensor) for seed in (1, 2, 3))
    return diagnose([first], servo_file.loads(TWIN), [second], [third], FEW)


@pytest.mark.parametrize('torque_sensor', [False, True])
def test_a_rigid_twin_of_a_machine_that_bends_lacks_its_spring(torque_sensor):
    found = diagnosed(2500.0, 4.0, torque_sensor)
    report, cause = found.report, found.report.which[0]
    assert report.verdict['effects'] == ['stiffness_error']
    assert report.verdict['balance'] == 'transmission' and cause.site == 'mesh'
    assert 'its mechanism is rigid' in report.verdict['sentence']
    assert cause.parameters['stiffness']['value'] == pytest.approx(2500.0, rel=0.05)
    assert cause.parameters['damping']['value'] == pytest.approx(4.0, rel=0.5)
    assert cause.interval[0] > 0.2
    assert found.augmented.mechanism is TwoInertia
    assert servo_file.loads(servo_file.dumps(found.augmented)) == found.augmented
    low, high = found.augmented.tolerance['mechanism.stiffness']
    assert low < found.augmented.values['mechanism.stiffness'] < high
    # what was found lacks nothing
    first, second, third = (moved(2500.0, 4.0, seed, torque_sensor) for seed in (4, 5, 6))
    again = diagnose([first], found.augmented, [second], [third], FEW).report
    assert again.which == ()


@pytest.mark.parametrize('torque_sensor', [False, True])
def test_a_rigid_twin_of_a_rigid_machine_is_given_no_spring(torque_sensor):
    report = diagnosed(None, 0.0, torque_sensor).report
    assert 'stiffness_error' not in [c.effect for c in report.which]
    assert report.verdict['status'] == 'no_gap'
