"""Detents and tight spots: a torque or a friction at narrow places of a shaft."""

import numpy as np
import pytest
from synthetic_recordings import run_of

from servo_identify.diagnose.diagnose import diagnose
from servo_twin.description import servo_file

PERIOD, FINE, INERTIA, CONSTANT, RUBS, NOISE = 2e-3, 20, 0.02, 0.5, 0.06, 0.01
COUNT = 2.0 * np.pi / 65536
PLACES = ((-0.62, 0.05, 0.5), (0.31, 0.04, 0.3), (0.9, 0.06, 0.6))  # rad, rad, N m
SERVO = servo_file.loads(f"""
servo: dial
step: 1.0e-4
drive: {{type: current, gain: 1.0, torque_constant: {CONSTANT}}}
mechanism: {{type: rigid, rotor_inertia: {INERTIA}, load_inertia: 0.0, ratio: 1.0}}
sensors:
  motor_encoder: {{noise: {COUNT / np.sqrt(12.0)}}}
  current_sensor: {{noise: {NOISE}}}
effects:
  rubs: {{effect: coulomb_friction, at: motor, level: {RUBS}}}
tolerance:
  mechanism.rotor_inertia: 4 %
  effects.rubs.level: 10 %
""")


def detents(angle):
    return sum(-size * z * np.exp(0.5 - 0.5 * z * z)
               for place, width, size in PLACES for z in [(angle - place) / width])


def tight(angle):
    return sum(size * np.exp(-0.5 * ((angle - place) / width) ** 4)
               for place, width, size in PLACES)


def recorded(seed, torque, rubs, seconds=15.0):
    """A stiff controller turns the dial to and fro over all places, at one speed and another."""
    rows, rng = round(seconds / PERIOD), np.random.default_rng(seed)
    time = np.arange(rows) * PERIOD
    asked = 0.2 + 1.1 * np.sin(2.0 * np.pi * (0.21 + 0.03 * seed) * time + seed)
    asked += 0.2 * np.sin(2.0 * np.pi * 0.83 * time)
    angle, speed = asked[0], 0.0
    angles, currents = np.zeros(rows), np.zeros(rows)
    for k in range(rows):
        angles[k] = angle
        currents[k] = (30.0 * (asked[k] - angle) - 1.2 * speed) / CONSTANT
        for _ in range(FINE):
            friction = (RUBS + rubs(angle)) * np.tanh(speed / 0.01)
            speed += PERIOD / FINE * (CONSTANT * currents[k] + torque(angle) - friction) / INERTIA
            angle += PERIOD / FINE * speed
    return run_of(seed, PERIOD, {
        'motor_position': np.floor(angles / COUNT + 0.5) * COUNT, 'voltage': currents,
        'current': currents + NOISE * rng.standard_normal(rows)}, 'turns')


def none(angle):
    return 0.0


def answer_of(torque, rubs):
    one, two, three = (recorded(seed, torque, rubs) for seed in (1, 2, 3))
    return diagnose([one], SERVO, [two], [three])


def shrink_of(found):
    given, patch = (found.evidence.reported[name].gap.total() for name in ('given', 'patch'))
    return 1.0 - patch / given


@pytest.mark.long
@pytest.mark.slow
def test_detents_come_with_their_place_and_variable_and_are_in_the_new_file():
    found = answer_of(detents, none)
    unknown = found.report.unknown
    assert (unknown['depends_on'], unknown['parity']) == (['angle'], 'even')
    assert unknown['balance'] == 'torque' and unknown['held']
    assert shrink_of(found) > 0.6


@pytest.mark.long
@pytest.mark.slow
def test_tight_spots_come_as_a_friction_with_all_of_them():
    found = answer_of(none, tight)
    which, = found.report.which
    assert which.effect == 'position_dependent_friction'
    x, y = np.asarray(which.curve['x']), np.asarray(which.curve['y'])
    known = (x > -0.8) & (x < 1.2)
    off = (y - tight(x))[known]  # the level of the file takes what is the same everywhere
    assert np.std(off) < 0.2 * np.std(tight(x)[known])
    assert shrink_of(found) > 0.7
