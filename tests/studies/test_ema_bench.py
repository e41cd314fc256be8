"""The bench of paper 002: its rig, its twin, and what the two are set by."""

from math import pi
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from involute_bench import drawn_play, PLAIN, RIG
import numpy as np
import pytest

from servo_rig_driver.emulated.emulated_bench import Bench, run
from servo_twin.description import servo_file
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS

CONFIG = Path(__file__).parents[2] / 'config'
SERVO = servo_file.load(CONFIG / 'servos' / 'ema_bench.yaml')
RATIO, CONSTANT = 124.0, 1.48


def pushed(rig):
    """Return the backlash of a rig, rad: its encoder pushed both ways while the motor holds."""
    bench, angles = Bench(rig), []
    for push in (1.0, -1.0):
        for _ in range(300):
            out = bench.answer(2.0, 0.0, push)  # a current of zero: the brake alone holds
            bench.advance()
        angles.append(out[1] - out[0] / RATIO)
    return angles[1] - angles[0] - 2.0 / rig.values['machine.stiffness']


@settings(max_examples=10, deadline=None)
@given(opened=st.floats(3e-4, 2.5e-3))  # beyond, the drawn teeth touch at their tips alone
def test_the_slide_of_the_rig_opens_the_play_of_involute_gears(opened):
    rig = RIG.with_values({**PLAIN, 'carrier.setting': 0.0096 + opened, 'brake.torque': 20.0})
    assert pushed(rig) == pytest.approx(drawn_play(0.09 + opened), abs=3e-4)


def test_printed_arcs_and_a_slide_that_is_shut():
    shut = pushed(RIG.with_values({**PLAIN, 'carrier.setting': 0.009, 'brake.torque': 20.0}))
    assert abs(shut) < 2e-4
    ends, middle = (
        pushed(RIG.with_values({**PLAIN, 'carrier.arc': arc, 'carrier.setting': at,
                                'brake.torque': 20.0}))
        for arc, at in ((1.0, 0.0150), (1.0, 0.0126)))
    without = [pushed(RIG.with_values({**PLAIN, 'carrier.setting': at, 'brake.torque': 20.0}))
               for at in (0.0150, 0.0126)]
    assert ends - without[0] > 10.0 * abs(middle - without[1])


@pytest.mark.parametrize('asked', [0.5, 2.0])
def test_the_mean_of_the_brake_is_what_was_asked(asked):
    quiet = {'friction.temperature': 0.0, 'brake.grip': 0.0}
    speed = np.full(6000, 0.2)
    with_brake, without = (
        run(RIG.with_values({**quiet, 'brake.torque': torque}), 'velocity', speed)['current']
        for torque in (asked, 0.0))
    turns = slice(2000, 6000)
    grown = (with_brake[turns] - without[turns]) * CONSTANT
    assert grown.mean() == pytest.approx(asked, rel=0.01)
    assert 0.02 < grown.std() / asked < 0.06  # its force swings


def test_the_brake_is_begun_somewhere_else_in_its_swing_each_time():
    rig = RIG.with_values({'brake.torque': 2.0, 'sensors.noise': 0.0})
    speed = np.full(1000, 0.2)
    first, again, other = (run(rig, 'velocity', speed, seed=s)['current'] for s in (1, 1, 2))
    assert np.array_equal(first, again)
    assert np.abs(other - first).max() > 0.05


@pytest.mark.long
def test_the_position_loop_of_rig_and_twin_follows_a_ramp_with_the_lag_of_its_gain():
    # a loop with one integrator follows a ramp behind by speed / gain
    ramp = 0.1 * np.arange(4000) * 1e-3
    smooth = RIG.with_values({**PLAIN, 'brake.torque': 0.0, 'carrier.setting': 0.0})
    rig = run(smooth, 'position', ramp)['load_position']
    columns = {name: np.full(len(ramp), np.nan) for name in INPUTS}
    u = inputs_of({**columns, 'reference_position': ramp})
    twin = simulate(SERVO, u, 1e-3, initial_state(SERVO, 0.0, 0.0), 'closed_loop')[:, 1]
    for load in (rig, twin):
        assert np.mean((ramp - load)[-1000:]) == pytest.approx(0.1 / 8.0, rel=0.02)


def test_the_twin_holds_the_encoder_still_while_the_motor_crosses_the_gap():
    t = np.arange(10_000) * 1e-3
    columns = {name: np.full(len(t), np.nan) for name in INPUTS}
    u = inputs_of({**columns, 'reference_position': 0.5 * np.sin(0.2 * pi * t)})
    servo = SERVO.with_values({'effects.play.setting': 0.014})
    width = 0.0873 * (0.014 - 0.0096) / (0.015 - 0.0096)
    y = simulate(servo, u, 1e-3, initial_state(servo, 0.0, 0.0), 'closed_loop')
    lost = y[:, 0] / RATIO - y[:, 1]
    assert np.ptp(lost[2000:]) == pytest.approx(width, abs=8e-4)  # and what the teeth wind up
    crossing = np.abs(lost[2000:] - 0.5 * (lost.max() + lost.min())) < 0.4 * width
    still = np.abs(np.gradient(y[2000:, 1], 1e-3)) < 1e-6
    assert still[crossing].mean() > 0.97
