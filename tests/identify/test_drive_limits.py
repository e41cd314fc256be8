"""Limits of a drive whose current nobody measures: a command and one encoder tell them."""

import numpy as np
import pytest
from synthetic_recordings import run_of
from test_selection import named_by_equations

from servo_identify.diagnose.diagnose import diagnose
from servo_twin.description import servo_file

PERIOD, FINE = 2e-3, 4
INERTIA, CONSTANT, RUBS, DRAG = 0.02, 0.12, 0.05, 5e-4
FILE = servo_file.loads(f"""
servo: spindle
drive: {{type: current, gain: 1.0, torque_constant: {CONSTANT}}}
mechanism: {{type: rigid, rotor_inertia: 0.0, load_inertia: {INERTIA}, ratio: 1.0}}
sensors: {{motor_encoder: {{noise: 1.0e-3}}}}
effects:
  bearing: {{effect: coulomb_friction, at: motor, level: {RUBS}}}
  grease: {{effect: viscous_friction, at: motor, slope: {DRAG}}}
tolerance: {{mechanism.load_inertia: 5 %, drive.torque_constant: 5 %}}
""")


def spun(seed, gives, top=110.0, most=12.0, seconds=20.0):
    """Return a spindle under control of its speed; ``gives(command, speed)`` is the current."""
    time, chance = np.arange(0.0, seconds, PERIOD), np.random.default_rng(seed)
    asked = top * np.tanh(1.5 * sum(np.sin(2.0 * np.pi * f * time + chance.uniform(0.0, 6.0))
                                    for f in (0.13, 0.31)))
    asked *= np.minimum(time, 1.0)
    angle = speed = 0.0
    rows = np.empty((len(time), 2))
    for k, goal in enumerate(asked):
        command = float(np.clip(0.6 * (goal - speed), -most, most))
        rows[k] = angle, command
        for _ in range(FINE):
            torque = CONSTANT * gives(command, speed) - DRAG * speed - RUBS * np.tanh(speed / 0.1)
            speed += PERIOD / FINE * torque / INERTIA
            angle += PERIOD / FINE * speed
    seen = {'motor_position': rows[:, 0] + chance.normal(0.0, 1e-3, len(time)),
            'voltage': rows[:, 1]}
    return run_of(seed, PERIOD, seen, 'spindle')


def brakes(command, speed):
    return np.clip(command, -75.0 / CONSTANT / abs(speed), 75.0 / CONSTANT / abs(speed)) if (
        command * speed < 0.0) else command


def drives(command, speed):
    most = max(14.0 - 0.1 * abs(speed), 0.0)
    return np.clip(command, -most, most) if command * speed > 0.0 else command


def opens(command, speed):
    return command - np.clip(command, -0.8, 0.5)


@pytest.mark.slow
def test_all_of_a_command_lacks_nothing():
    assert named_by_equations([spun(seed, lambda u, w: u) for seed in (1, 2)], FILE) == set()


@pytest.mark.long
@pytest.mark.slow
def test_a_brake_without_power_enough_is_named_with_that():
    several = [spun(seed, brakes) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], FILE, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['braking_power_limit']
    sure = answer.report.which[0].confidence
    assert sure['curve'] == sure['law'] > 0.9  # no curve is drawn of it, and its law is known
    power = answer.augmented.numbers['effects.braking_power_limit.power']
    assert CONSTANT * power == pytest.approx(75.0, rel=0.05)
    assert answer.report.gap['shrink'] > 0.9


@pytest.mark.slow
def test_a_drive_out_of_voltage_is_named_by_its_command_alone():
    several = [spun(seed, drives) for seed in (1, 2)]
    assert named_by_equations(several, FILE) == {('torque_speed_limit', 'command')}


@pytest.mark.slow
def test_a_command_that_is_cut_is_named_by_what_was_asked_for():
    several = [spun(seed, lambda u, w: np.clip(u, -5.0, 5.0)) for seed in (1, 2)]
    assert named_by_equations(several, FILE) == {('drive_saturation', 'command')}


@pytest.mark.long
@pytest.mark.slow
def test_an_overlap_that_is_wider_one_way_is_a_dead_band_of_two_widths():
    several = [spun(seed, opens, top=20.0, most=3.0) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], FILE, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['drive_dead_band']
    values = answer.augmented.numbers
    widths = [values[f'effects.uneven_dead_band.{way}'] for way in ('positive', 'negative')]
    assert widths == pytest.approx([0.5, 0.8], rel=0.15)
