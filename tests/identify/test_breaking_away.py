"""A shaft that sticks and slips: its friction at rest shows as it breaks away."""

import numba
import numpy as np
import pytest
from synthetic_recordings import run_of

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.residuals.breakaway import breakaways
from servo_identify.diagnose.residuals.test_function import TestFunction
from servo_twin.description import servo_file

PERIOD, FINE = 4e-3, 100
CONSTANT, RATIO, INERTIA, RUBS, DRAG, NOISE = 0.05, 50.0, 0.06, 3.0, 1.2, 0.01
COUNT = 2.0 * np.pi / 16384
SERVO = servo_file.loads(f"""
servo: valve
drive: {{type: current, gain: 1.0, torque_constant: {CONSTANT}}}
mechanism: {{type: rigid, rotor_inertia: 2.0e-5, load_inertia: 0.0104, ratio: {RATIO}}}
sensors:
  load_encoder: {{noise: {COUNT / np.sqrt(12.0)}}}
  current_sensor: {{noise: {NOISE}}}
effects:
  coulomb: {{effect: coulomb_friction, at: load, level: {1.02 * RUBS}}}
  viscous: {{effect: viscous_friction, at: load, slope: 1.25}}
tolerance:
  drive.torque_constant: 3 %
  mechanism.load_inertia: 10 %
  effects.coulomb.level: 8 %
  effects.viscous.slope: 15 %
""")


@numba.njit
def _ridden(asked, holds, angles, currents):
    """Move a valve that holds at rest with ``holds`` N m, and rubs the less the faster it goes."""
    angle, speed, current, command, integral, sticks = 0.0, 0.0, 0.0, 0.0, 0.0, True
    h = PERIOD / FINE
    for k in range(len(asked)):
        angles[k], currents[k] = np.floor(angle / COUNT) * COUNT, current
        for i in range(FINE):
            if i % 25 == 0:
                error = 6.0 * (asked[k] - np.floor(angle / COUNT) * COUNT) - speed
                integral = min(max(integral + 0.02 * error, -3.0), 3.0)
                command = min(max(0.6 * error + integral, -4.0), 4.0)
            current += h / 2e-4 * (command - current)
            push = CONSTANT * RATIO * current
            if sticks and abs(push) <= holds:
                continue
            way = np.sign(push) if sticks else np.sign(speed)
            rubs = RUBS + (holds - RUBS) * np.exp(-abs(speed) / 0.05) + DRAG * abs(speed)
            then = speed + h * (push - way * rubs) / INERTIA
            sticks = then * way < 0.0 and abs(push) <= holds
            speed = 0.0 if sticks else then
            angle += h * speed


def recorded(seed, holds, asked):
    angles, currents = np.zeros((2, len(asked)))
    _ridden(asked, holds, angles, currents)
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(asked))
    return run_of(seed, PERIOD, {'load_position': angles, 'reference_position': asked,
                                 'current': currents + noise}, f'motion-{seed % 10}')


def triangle(size, period, seconds=30.0):
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    return size * (2.0 / np.pi) * np.arcsin(np.sin(2.0 * np.pi * time / period))


def recordings(holds):
    kinds = [(0.3, 20.0), (0.5, 8.0), (0.12, 13.3)]
    return [[recorded(seed + n, holds, triangle(size * (1.0 + 0.02 * seed), period))
             for n, (size, period) in enumerate(kinds)] for seed in (10, 20, 30)]


@pytest.mark.slow
@pytest.mark.parametrize('share', [1.6, 2.0])
def test_friction_at_rest_is_found_where_a_shaft_sticks_and_slips(share):
    found = diagnose(recordings(share * RUBS)[0], SERVO, *recordings(share * RUBS)[1:])
    which, = found.report.which
    assert which.effect == 'stribeck_friction'
    assert which.parameters['excess']['value'] == pytest.approx((share - 1.0) * RUBS, rel=0.2)


@pytest.mark.slow
def test_friction_at_rest_that_is_little_above_that_of_sliding_is_named_too():
    which, = diagnose(recordings(1.25 * RUBS)[0], SERVO, *recordings(1.25 * RUBS)[1:]).report.which
    assert which.effect == 'stribeck_friction'


def test_a_shaft_whose_friction_is_known_lacks_nothing():
    select, accept, report = recordings(RUBS)
    assert not diagnose(select, SERVO, accept, report).report.which


@pytest.mark.parametrize('way', [1.0, -1.0])
def test_a_start_is_the_last_sample_at_rest(way):
    test = TestFunction(5, 1e-3, 3)
    angle = np.concatenate((np.zeros(200), way * 0.01 * np.arange(1, 101)))
    one, = breakaways(test, np.arange(300 - 2 * test.reach) < 200 - 2 * test.reach,
                      [(angle, 0.005)])
    assert one.start == 199 and one.way == way
    assert one.centre + test.reach <= one.start < one.centre + test.reach + test.stride
    assert one.centre in test.centres(300)


def test_a_motor_that_winds_up_a_gap_first_is_no_start_of_the_load():
    test, resting = TestFunction(5, 1e-3, 3), np.arange(472) < 300
    motor = np.concatenate((np.zeros(250), 0.01 * np.arange(250)))
    load = np.concatenate((np.zeros(320), 0.01 * np.arange(180)))
    assert not list(breakaways(test, resting, [(motor, 0.005), (load, 0.005)]))
