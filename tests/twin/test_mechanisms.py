"""The mechanisms, against oracles from elsewhere."""

from __future__ import annotations

from dataclasses import replace

import control
import every_effect
from every_effect import inputs, only
import numpy as np
from plain_machines import PERIOD, rigid, rolled, two_inertia, UNIT_DRIVE
import pytest

from servo_twin.physics.catalogue import find
from servo_twin.physics.drives import CurrentDrive, VoltageDrive
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.servo import Placed, Servo
from servo_twin.physics.simulate import initial_state, simulate
from servo_twin.physics.state import (
    LOAD_ANGLE,
    LOAD_SPEED,
    MEASURED_MOTOR,
    MOTOR_ANGLE,
    MOTOR_SPEED,
    ZERO,
)


def first_harmonic(y, frequency):
    """Return the complex amplitude of whole cycles of a signal, sine as the reference."""
    t = np.arange(len(y)) * PERIOD
    return 2.0 * np.mean(y * np.exp(-1j * frequency * t)) * 1j


# --- free motion


def test_free_motion_keeps_its_energy_and_its_period():
    servo, count = two_inertia(), 20_000
    y, x = rolled(servo, inputs(count), torque=2.0)
    omega = np.sqrt(200.0 * (1.0 / 0.02 + 1.0 / 0.05))
    crossings = np.flatnonzero((y[:-1, 2] > 0.0) & (y[1:, 2] <= 0.0))
    within = y[crossings, 2] / (y[crossings, 2] - y[crossings + 1, 2])
    at = (crossings + within) * PERIOD
    period = (at[-1] - at[0]) / (len(at) - 1)
    assert period == pytest.approx(2.0 * np.pi / omega, rel=3e-4)
    amplitude = np.abs(y[:, 2])
    assert amplitude[-1000:].max() == pytest.approx(amplitude[:1000].max(), rel=2e-3)


def test_free_motion_keeps_its_momentum():
    y, x = rolled(two_inertia(), inputs(500), torque=2.0, motor_speed=3.0)
    assert 0.02 * x[MOTOR_SPEED] + 0.05 * x[LOAD_SPEED] == pytest.approx(0.06, rel=1e-9)


@pytest.mark.parametrize('mechanism', [Rigid, TwoInertia])
@pytest.mark.parametrize('samples_a_turn', [2000, 200, 40])
def test_a_crank_keeps_its_energy_however_seldom_it_is_read(mechanism, samples_a_turn):
    crank, plain = Placed('crank', find('linked_inertia'), 'load'), rigid()
    soft = {'mechanism.rotor_inertia': 0.5, 'mechanism.stiffness': 1.0, 'mechanism.damping': 0.0}
    if mechanism is TwoInertia:
        plain = replace(plain, mechanism=TwoInertia, values=plain.values | soft)
    servo = plain.with_effects(crank, values={
        'effects.crank.order': 1.0, 'effects.crank.cosine': (0.03, -0.1),
        'effects.crank.sine': (0.0, 0.02)})
    value = servo.numbers.get

    def energy(x):
        angle = x[LOAD_ANGLE]
        inertia = value('mechanism.load_inertia') + np.hypot(0.03, 0.0) + np.hypot(0.1, 0.02) + (
            0.03 * np.cos(angle) - 0.1 * np.cos(2.0 * angle) + 0.02 * np.sin(2.0 * angle))
        return (inertia * x[LOAD_SPEED] ** 2 + value('mechanism.rotor_inertia')
                * x[MOTOR_SPEED] ** 2 + value('mechanism.stiffness', 0.0)
                * (x[MOTOR_ANGLE] - angle) ** 2)

    x = initial_state(servo, 0.0)
    x[MOTOR_SPEED] = x[LOAD_SPEED] = 10.0
    begun, period = energy(x), 2.0 * np.pi / 10.0 / samples_a_turn
    simulate(servo, inputs(10 * samples_a_turn), period, x)
    assert energy(x) == pytest.approx(begun, rel=2e-3)


def test_coulomb_friction_takes_four_levels_over_stiffness_from_each_cycle():
    servo = rigid(coulomb__level=0.05, spring__stiffness=20.0, step=1e-5)
    x = initial_state(servo, 0.1)
    y = simulate(servo, inputs(3000), PERIOD, x)[:, 0]
    tops = np.flatnonzero((y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:]) & (y[1:-1] > 0.003)) + 1
    highs = np.array([0.1, *y[tops]])
    assert len(highs) > 5
    assert np.diff(highs) == pytest.approx(-4.0 * 0.05 / 20.0, rel=2e-3)


def test_a_shaft_at_rest_stays_where_it_is_to_the_last_bit():
    servo = rigid(coulomb__level=1.0, spring__stiffness=1.0)
    x = initial_state(servo, 0.7)
    y = simulate(servo, inputs(1000, voltage=0.2), PERIOD, x)
    assert (y[:, 0] == 0.7).all()


@pytest.mark.parametrize('speeds', [(3.0, -2.0), (0.5, 0.5), (-1.0, 0.0)])
def test_a_machine_left_alone_with_all_its_friction_never_gains_energy(speeds):
    rubbing = [p.name for p in every_effect.PLACED if p.effect.port == 'friction']
    values = {f'{name}__excess': 0.0 for name in rubbing if name.startswith('friction_drift')}
    servo = two_inertia(step=1e-5, **{f'{n}__rise': 0.01 for n in rubbing if 'drag' in n},
                        **{f'{n}__slope': 0.01 for n in rubbing if 'viscous' in n}, **values)
    kinetic, states = [], []
    on, x = only(*rubbing), initial_state(servo, 0.0, 0.0, 5.0, on=only(*rubbing))
    x[MOTOR_SPEED], x[LOAD_SPEED] = speeds
    for _ in range(60):
        wind_up = x[MOTOR_ANGLE] - x[LOAD_ANGLE] - x[ZERO]
        kinetic.append(0.01 * x[MOTOR_SPEED]**2 + 0.025 * x[LOAD_SPEED]**2)
        states.append(kinetic[-1] + 100.0 * wind_up**2)
        simulate(servo, inputs(5), 1e-4, x, on=on)
    assert np.diff(states).max() < 2e-3 * states[0]
    assert kinetic[-1] < 1e-3 * states[0]  # it rests, though what rubs may hold it wound up
    assert kinetic[-1] < 0.05 * states[0]


# --- the linear machine


def test_two_masses_answer_as_python_control_says():
    jm, jl, k, c = 0.02, 0.05, 200.0, 0.3
    plant = control.ss([[0, 1, 0, 0], [-k / jm, -c / jm, k / jm, c / jm], [0, 0, 0, 1],
                        [k / jl, c / jl, -k / jl, -c / jl]], [[0], [1 / jm], [0], [0]],
                       np.eye(4), np.zeros((4, 1)))
    t = np.arange(2000) * PERIOD
    u = np.sin((20.0 + 60.0 * t) * t)  # through antiresonance (10 Hz) and resonance (19 Hz)
    expected = control.forced_response(control.c2d(plant, PERIOD), t, u).outputs
    y, _ = rolled(two_inertia(jm, jl, k, c, step=1e-5), inputs(len(t), voltage=u))
    assert np.abs(y[:, 0] - expected[0]).max() < 2e-3 * np.ptp(expected[0])
    assert np.abs(y[:, 1] - expected[2]).max() < 2e-3 * np.ptp(expected[2])


def test_a_velocity_loop_answers_as_python_control_says():
    kp, ki, jm, jl, k, c = 0.6, 3.0, 0.02, 0.05, 800.0, 0.6
    plant = control.c2d(control.ss(
        [[0, 1, 0, 0], [-k / jm, -c / jm, k / jm, c / jm], [0, 0, 0, 1],
         [k / jl, c / jl, -k / jl, -c / jl]], [[0], [1 / jm], [0], [0]],
        [[1, 0, 0, 0]], [[0]]), PERIOD)
    difference = control.tf([1, -1], [PERIOD, 0], PERIOD)
    loop = control.ss(control.tf([kp + ki * PERIOD, -kp], [1, -1], PERIOD))
    expected = control.feedback(plant * loop, control.ss(difference))
    t = np.arange(3000) * PERIOD
    reference = np.where(t > 0.05, 1.5, 0.0)
    answer = control.forced_response(expected, t, reference).outputs
    servo = two_inertia(jm, jl, k, c, step=1e-5).with_values(
        {'controller.kp': kp, 'controller.ki': ki, 'controller.limit': 100.0})
    x = initial_state(servo, 0.0, 0.0, on=only())
    y = simulate(servo, inputs(len(t), reference_velocity=reference), PERIOD, x, 'closed_loop',
                 on=only())
    assert np.abs(y[:, 0] - answer).max() < 2e-3 * np.ptp(answer)


def test_a_winding_charges_as_its_time_constant_says():
    servo = Servo('winding', VoltageDrive, Rigid, values={
        **UNIT_DRIVE, 'drive.resistance': 2.0, 'drive.inductance': 0.02, 'drive.back_emf': 0.0},
        step=1e-5)
    y = simulate(servo, inputs(50, voltage=6.0), PERIOD, initial_state(servo))
    assert y[:, 3] == pytest.approx(3.0 * (1.0 - np.exp(-np.arange(50) * PERIOD / 0.01)), rel=2e-3)


@pytest.mark.long
def test_a_rigid_servo_is_a_stiff_one():
    u = inputs(500, voltage=np.sin(0.02 * np.arange(500)))
    stiff, _ = rolled(two_inertia(stiffness=1e5, damping=30.0, step=1e-5), u)
    servo = Servo('rigid', CurrentDrive, Rigid, values={
        **UNIT_DRIVE, 'mechanism.rotor_inertia': 0.02, 'mechanism.load_inertia': 0.05}, step=1e-5)
    y = simulate(servo, u, PERIOD, initial_state(servo))
    assert np.abs(y[:, 1] - stiff[:, 1]).max() < 1e-4 * np.ptp(y[:, 1])
    assert np.abs(y[:, 2] - stiff[:, 2])[20:].max() < 0.02 * np.ptp(y[:, 2])


# --- describing functions


def imposed(amplitude, frequency, values, on, **inertias):
    """Move a motor that is too heavy to be disturbed along a sine; return one settled cycle."""
    heavy = 1e3
    servo = two_inertia(motor=heavy, step=1e-5, **inertias, **values)
    samples = round(2.0 * np.pi / frequency / PERIOD)
    t = np.arange(3 * samples) * PERIOD
    u = inputs(len(t), voltage=-heavy * amplitude * frequency**2 * np.sin(frequency * t))
    y, _ = rolled(servo, u, only(*on), motor_speed=amplitude * frequency)
    return y[2 * samples:]


FREQUENCY = 2.0 * np.pi / 0.4


@pytest.mark.parametrize('amplitude', [0.012, 0.02, 0.05])
def test_backlash_on_a_held_load_answers_as_its_describing_function(amplitude):
    y = imposed(amplitude, FREQUENCY, {'backlash_at_mesh__width': 0.02}, ['backlash_at_mesh'],
                load=1e6, stiffness=100.0)
    share = 0.01 / amplitude
    dead_zone = 1.0 - 2.0 / np.pi * (np.arcsin(share) + share * np.sqrt(1.0 - share**2))
    measured = first_harmonic(y[:, 2], FREQUENCY) / first_harmonic(y[:, 0], FREQUENCY)
    assert measured == pytest.approx(100.0 * dead_zone, rel=5e-3, abs=0.02)


@pytest.mark.parametrize('amplitude', [0.015, 0.02, 0.05])
def test_backlash_before_a_rubbing_load_answers_as_its_describing_function(amplitude):
    y = imposed(amplitude, FREQUENCY,
                {'backlash_at_mesh__width': 0.02, 'coulomb_friction_at_load__level': 0.5},
                ['backlash_at_mesh', 'coulomb_friction_at_load'],
                load=1e-5, stiffness=1e4, damping=0.2)
    play = control.friction_backlash_nonlinearity(0.02)
    expected = control.describing_function(play, amplitude)
    measured = first_harmonic(y[:, 1], FREQUENCY) / first_harmonic(y[:, 0], FREQUENCY)
    assert measured == pytest.approx(expected, rel=0.02)


def test_coulomb_friction_answers_as_the_describing_function_of_a_relay():
    y = imposed(0.05, FREQUENCY, {'coulomb_friction_at_load__level': 0.5},
                ['coulomb_friction_at_load'], load=1e-5, stiffness=1e5, damping=0.2)
    relay = control.relay_hysteresis_nonlinearity(0.5, 0.0)
    speed = 0.05 * FREQUENCY
    measured = first_harmonic(y[:, 2], FREQUENCY) / 1j  # in phase with the speed
    assert measured == pytest.approx(control.describing_function(relay, speed) * speed, rel=0.03)
    assert abs(measured) == pytest.approx(4.0 * 0.5 / np.pi, rel=3e-3)


# --- states


def test_two_instances_of_one_effect_add_up():
    def sticky(*levels):
        effects = tuple(Placed(f'part{i}', find('coulomb_friction'), 'load')
                        for i in range(len(levels)))
        return Servo('parts', CurrentDrive, Rigid, effects=effects, values={
            **UNIT_DRIVE, **{f'effects.part{i}.level': v for i, v in enumerate(levels)}})
    u = inputs(300, voltage=3.0 * np.sin(0.03 * np.arange(300)))
    both, one = sticky(0.25, 0.5), sticky(0.75, 0.0)
    answers = [simulate(s, u, PERIOD, initial_state(s)) for s in (both, one)]
    assert np.array_equal(*answers)


@pytest.mark.parametrize('torque', [-30.0, 0.0, 30.0])
def test_a_recording_begins_at_rest_with_the_torque_it_was_measured_with(torque):
    servo = every_effect.servo()
    on = ~np.array([p.effect.port in ('mesh', 'drive', 'torque', 'sensor')
                    for p in every_effect.PLACED])
    x = initial_state(servo, 3.0, 0.1, torque, on=on)
    begin = x.copy()
    ratio, gear = 161.0, 0.49 * 0.4878
    u = inputs(5, voltage=torque / ratio / gear, external_torque=torque)
    y = simulate(servo, u, PERIOD, x, on=on)
    assert y[:, 2] == pytest.approx(torque, abs=1e-6)
    assert x[[MOTOR_ANGLE, LOAD_ANGLE]] == pytest.approx(begin[[MOTOR_ANGLE, LOAD_ANGLE]])


def test_a_run_in_two_parts_is_the_run_in_one_to_the_last_bit():
    servo = every_effect.servo()
    u = inputs(200, voltage=3.0 * np.sin(0.1 * np.arange(200)))
    x = initial_state(servo, 0.0, 0.0)
    whole = simulate(servo, u, PERIOD, x.copy())
    parts = [simulate(servo, part, PERIOD, x) for part in np.split(u, 4)]
    assert np.array_equal(np.concatenate(parts), whole)


# --- a motor that its encoder leads


def test_a_load_follows_a_led_motor_as_its_spring_and_damper_say():
    servo = two_inertia(damping=0.4, step=2e-5)
    t = np.arange(4000) * PERIOD
    motor = 0.3 * np.sin(2.0 * np.pi * 3.0 * t) + 0.05 * np.sin(2.0 * np.pi * 11.0 * t + 1.0)
    motor *= 0.5 * (1.0 - np.cos(np.pi * np.minimum(t, 1.0)))  # begins at rest
    u = inputs(len(t))
    u[:, MEASURED_MOTOR] = motor
    y = simulate(servo, u, PERIOD, initial_state(servo, 0.0, on=only()), 'forced_motion',
                 on=only())
    wanted = control.forced_response(
        control.tf([0.4, 200.0], [0.05, 0.4, 200.0]), t, motor).outputs
    np.testing.assert_allclose(y[:, 0], motor, atol=1e-12)
    np.testing.assert_allclose(y[:, 1], wanted, atol=2e-3)


def test_a_rigid_load_goes_with_a_led_motor_whatever_rubs():
    servo = rigid(coulomb__level=30.0)
    motor = np.sin(np.arange(1000) * 0.01)
    u = inputs(1000)
    u[:, MEASURED_MOTOR] = motor
    y = simulate(servo, u, PERIOD, initial_state(servo, 0.0), 'forced_motion')
    np.testing.assert_allclose(y[:, 0], motor, atol=1e-12)
    np.testing.assert_allclose(y[1:, 1], motor[1:], atol=1e-9)
