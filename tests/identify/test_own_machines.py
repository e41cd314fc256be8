"""Machines with laws of their own, integrated here and not by the twin."""

import numpy as np
import pytest

from servo_identify.diagnose.mechanisms.builder import Builder
from servo_identify.diagnose.mechanisms.friction_by_direction import friction_by_direction
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.bounded_least_squares import bounded
from servo_identify.diagnose.selection.explain import explained
from servo_twin.description import servo_file
from servo_twin.recording.recording import COLUMNS, Recording

JOINT = servo_file.loads("""
servo: joint
step: 1.0e-3
drive: {type: current, gain: 1.0, torque_constant: 1.0}
mechanism: {type: rigid, rotor_inertia: 0.02, load_inertia: 0.08, ratio: 1.0}
sensors: {motor_encoder: {noise: 1.0e-4}, current_sensor: {noise: 0.02}}
effects:
  rubs: {effect: coulomb_friction, at: load, level: 0.3}
  drags: {effect: viscous_friction, at: load, slope: 0.04}
tolerance: {mechanism.load_inertia: 10 %, effects.rubs.level: 30 %, effects.drags.slope: 50 %}
""")
PERIOD, FINE, SECONDS = 4e-3, 2e-4, 20.0


def joint(seed, law, size, slowest=0.15):
    """Return a recording of a joint behind its own controller; ``law(angle, speed)`` in N m."""
    chance = np.random.default_rng(seed)
    tones = slowest * np.array((1.0, 2.7, 6.1))
    phases = chance.uniform(0.0, 2.0 * np.pi, 3)
    angle = speed = 0.0
    rows = []
    for tick in range(int(SECONDS / FINE)):
        time = tick * FINE
        if tick % round(PERIOD / FINE) == 0:
            wanted = size * float(np.sin(2.0 * np.pi * tones * time + phases)
                                  @ (1.0, 0.5, 0.2)) * min(time, 1.0)
            current = float(np.clip(60.0 * (wanted - angle) - 2.5 * speed, -40.0, 40.0))
            rows.append((angle, current))
        rubs = 0.3 * np.tanh(speed / 2e-3) + 0.04 * speed
        speed += FINE * (current - rubs + law(angle, speed)) / 0.1
        angle += FINE * speed
    seen, current = np.array(rows).T
    columns = {name: np.full(len(seen), np.nan) for name in COLUMNS} | {
        'motor_position': seen + chance.normal(0.0, 1e-4, len(seen)),
        'current': 0.5 * (current + np.append(current[:1], current[:-1]))
        + chance.normal(0.0, 0.02, len(seen))}
    return Recording(f'tones {seed}', PERIOD, columns, family='tones', replicate=seed,
                     digest=f'{seed:064d}')


def found_in(law, size, slowest=0.15):
    several = [joint(seed, law, size, slowest) for seed in (1, 2, 3)]
    found = explained(residual_samples(several, JOINT))
    amplitudes = [found.amplitudes(n) for n in found.explanation.smallest.choice.numbers]
    return found.chosen, amplitudes


def nothing(angle, speed):
    return 0.0


def eddy(angle, speed):
    return -2.0 * 1.5 * (speed / 6.0) / (1.0 + (speed / 6.0)**2)


def rubber(angle, speed):
    return -40.0 * max(angle - 1.25, 0.0)**1.5 * (1.0 + 0.15 * speed)


@pytest.mark.long
@pytest.mark.slow
def test_a_machine_that_does_what_its_file_says_is_missing_nothing():
    assert found_in(nothing, 1.0)[0] == []


@pytest.mark.long
@pytest.mark.slow
def test_a_drag_that_has_a_peak_over_speed_is_an_eddy_brake():
    (one,), (amplitudes,) = found_in(eddy, 6.0)
    assert one.mechanism.name == 'eddy_brake'
    assert amplitudes == pytest.approx([1.5], rel=0.1)
    assert one.knots == pytest.approx([6.0], rel=0.1)


@pytest.mark.long
@pytest.mark.slow
def test_a_rubber_stop_at_one_end_is_a_spring_over_the_angle():
    chosen, _ = found_in(rubber, 1.2)
    assert chosen[0].mechanism.name == 'spring_load'


def test_friction_that_differs_by_direction_is_no_weight():
    bare = JOINT.without_effects(lambda placed: True)
    builder = Builder(residual_samples([joint(1, nothing, 0.6)], bare))
    weight = builder.place('load_torque', lambda one: np.ones((len(one.motion.rows), 1))).table
    differing = [one for one in friction_by_direction(builder, 'load')
                 if one.mechanism.name == 'asymmetric_friction' and one.knots == ()]
    assert differing
    for one in differing:
        table = one.columns.whole()
        for bounds in one.bounds():
            left = weight[:, 0] + table @ bounded(table.T @ table, table.T @ weight[:, 0], *bounds)
            assert np.mean(left**2) > 0.3 * np.mean(weight**2)  # it resists one way: half of it
