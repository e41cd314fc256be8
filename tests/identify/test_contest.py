"""Where the equations leave several names, the simulation may tell which."""

import numpy as np
import pytest

from servo_identify.diagnose.diagnose import diagnose
from servo_twin.description import servo_file
from servo_twin.recording.recording import Recording

pytestmark = pytest.mark.slow

KNEE = """
servo: exo_knee
step: 2.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.083}
mechanism: {type: two_inertia, rotor_inertia: 3.3e-5, load_inertia: 0.28, ratio: 60.0,
            stiffness: 260.0, damping: 0.5}
controller: {type: none}
sensors:
  motor_encoder: {noise: 2.0e-4}
  load_encoder: {noise: 3.0e-5}
  current_sensor: {noise: 0.01}
effects:
  leg: {effect: gravity, at: load, cosine: 0.0, sine: -11.0}
  gear: {effect: coulomb_friction, at: motor, level: 0.02}
  hinge: {effect: coulomb_friction, at: load, level: RUBS}
  hinge_oil: {effect: viscous_friction, at: load, slope: 0.15}
tolerance: {mechanism.stiffness: 10 %, effects.leg.sine: 3 %, effects.gear.level: 20 %,
            effects.hinge.level: 20 %, effects.hinge_oil.slope: 50 %}
"""
RATIO, PERIOD, FINE = 60.0, 0.004, 20
WAVES = ([(0.6, 0.5, 0.0), (0.2, 1.0, 1.2)], [(0.9, 0.3, 0.0)], [(0.4, 0.8, 0.5), (0.1, 2.1, 0.0)],
         [(0.7, 0.4, 1.0)])


def soft(twist):
    """Torque of a spring of rubber, N m."""
    return 265.0 * twist * (1.0 - 0.45 / (1.0 + abs(twist) / 0.02))


def loose(twist):
    """Torque of a spring behind a clearance whose ends are round, N m."""
    beyond = abs(twist) - 2e-3
    return np.sign(twist) * 265.0 * (0.5 * beyond + np.hypot(0.5 * beyond, 1e-4))


def leg(seed, spring, weight, rubs):
    """
    Return a recording of a leg on a spring.

    The motor goes where it is told; what it needs for that is its current.
    """
    h = PERIOD / FINE
    t = np.arange(int(16.0 / h)) * h
    waves = WAVES[seed]
    fade = np.minimum(t / 2.0, 1.0) ** 2 * (3.0 - 2.0 * np.minimum(t / 2.0, 1.0))
    turned = fade * sum(a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in waves)
    rate = np.gradient(turned, h)
    angle = speed = 0.0
    at, torque = np.empty(len(t)), np.empty(len(t))
    for k in range(len(t)):
        twist = turned[k] - angle
        torque[k] = spring(twist) + 0.5 * (rate[k] - speed)
        speed += h / 0.28 * (torque[k] - weight * np.sin(angle) - 0.15 * speed
                             - 1.05 * rubs * np.tanh(speed / 0.02))
        angle += h * speed
        at[k] = angle
    drawn = 3.3e-5 * RATIO * np.gradient(rate, h) + 0.021 * np.tanh(RATIO * rate / 0.3)
    current = (drawn + torque / RATIO) / 0.083
    chance, rows = np.random.default_rng(seed), slice(None, None, FINE)
    count = len(t[rows])
    return Recording(f'leg_{seed}', PERIOD, {
        'voltage': current[rows],
        'current': current[rows] + chance.normal(0.0, 0.01, count),
        'motor_position': RATIO * turned[rows] + chance.normal(0.0, 2e-4, count),
        'load_position': at[rows] + chance.normal(0.0, 3e-5, count)})


def answer(spring, weight, rubs):
    text = KNEE.replace('-11.0', f'{-weight / 1.01}').replace('RUBS', f'{rubs}')
    several = [leg(seed, spring, weight, rubs) for seed in range(4)]
    return diagnose(several, servo_file.loads(text)).report.which[0]


@pytest.mark.long
def test_a_soft_spring_is_told_from_a_clearance_that_grows_with_the_load():
    first = answer(soft, weight=11.0, rubs=0.4)
    assert first.effect == 'nonlinear_stiffness' and first.confidence['mechanism'] > 0.7


@pytest.mark.long
def test_a_clearance_under_a_load_that_rubs_is_told_from_a_soft_spring():
    first = answer(loose, weight=0.0, rubs=2.0)
    assert first.effect == 'backlash' and first.confidence['mechanism'] > 0.5
