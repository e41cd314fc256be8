"""The three-phase drive, against SciPy, python-control and formulas of another form."""

from __future__ import annotations

from collections import namedtuple

import control
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from servo_twin.physics import pmsm_drive
from servo_twin.physics.pmsm_drive import PmsmDrive
from servo_twin.physics.three_phase import (
    averaged,
    clarke,
    duties,
    park,
    phases,
    stator,
    turned_back,
    winding,
)

BUS, CYCLE = 560.0, 31.25e-6
angles = st.floats(-np.pi, np.pi)


def drive(**changes):
    """Return the parameters of the drive with the values of table 2, some changed."""
    values = {name: p.default for name, p in PmsmDrive.parameters.items()}
    return namedtuple('Drive', values)(**{**values, **changes})


def stepped(p, command, steps, h=CYCLE, angle=0.0, speed=0.0):
    """Return the current after each of so many steps of a shaft that turns evenly, and memory."""
    s, answers = np.zeros(PmsmDrive.memory), []
    for k in range(steps):
        answers.append(PmsmDrive.law(p, s, command, angle + speed * k * h, speed, h))
    return np.array(answers), s


# --- transforms and modulation


@given(angle=angles, size=st.floats(0.1, 400.0))
def test_three_phases_are_a_vector_and_back(angle, size):
    a, b, c = (size * np.cos(angle - k * 2.0 * np.pi / 3.0) for k in range(3))
    alpha, beta = clarke(a, b, c)
    assert (alpha, beta) == pytest.approx((size * np.cos(angle), size * np.sin(angle)), abs=1e-9)
    assert phases(alpha, beta) == pytest.approx((a, b, c), abs=1e-9)


@given(at=angles, behind=angles)
def test_a_vector_that_turns_with_the_rotor_stands_still_in_its_frame(at, behind):
    d, q = park(np.cos(at + behind), np.sin(at + behind), np.cos(at), np.sin(at))
    assert (d, q) == pytest.approx((np.cos(behind), np.sin(behind)), abs=1e-12)
    assert stator(d, q, np.cos(at), np.sin(at)) == pytest.approx(
        (np.cos(at + behind), np.sin(at + behind)), abs=1e-12)


@given(angle=st.floats(-0.05, 0.05))
def test_a_small_turn_is_that_of_park(angle):
    assert turned_back(3.0, -2.0, angle) == pytest.approx(
        park(3.0, -2.0, np.cos(angle), np.sin(angle)), abs=1e-9)


@given(angle=angles, share=st.floats(0.0, 1.0))
def test_duties_are_those_of_the_middle_of_the_three_phases(angle, share):
    """Independent form: the reference of each phase with half the sum of the extremes off it."""
    size = share * BUS / np.sqrt(3.0)
    wanted = size * np.cos(angle - np.arange(3) * 2.0 * np.pi / 3.0)
    expected = 0.5 + (wanted - 0.5 * (wanted.max() + wanted.min())) / BUS
    assert duties(size * np.cos(angle), size * np.sin(angle), BUS) == pytest.approx(
        expected, abs=1e-12)


@given(angle=angles, share=st.floats(1.2, 3.0))
def test_more_than_the_hexagon_is_drawn_back_to_its_edge_at_the_same_angle(angle, share):
    size = share * BUS / np.sqrt(3.0)
    found = duties(size * np.cos(angle), size * np.sin(angle), BUS)
    assert min(found) == pytest.approx(0.0, abs=1e-12)
    assert max(found) == pytest.approx(1.0, abs=1e-12)
    alpha, beta = averaged(size * np.cos(angle), size * np.sin(angle), BUS)
    assert np.cos(np.arctan2(beta, alpha) - angle) == pytest.approx(1.0, abs=1e-12)
    within = np.mod(angle, np.pi / 3.0) - np.pi / 6.0  # from the middle of a side of the hexagon
    assert np.hypot(alpha, beta) == pytest.approx(BUS / np.sqrt(3.0) / np.cos(within), rel=1e-9)


# --- the motor


@pytest.mark.parametrize('inductances', [(2.3e-3, 2.3e-3), (1.7e-3, 3.1e-3)])
def test_the_winding_answers_as_scipy_says(inductances):
    ld, lq = inductances
    resistance, flux, omega, ud, uq = 0.184, 0.17, 800.0, -25.0, 160.0

    def slope(t, i):
        return [(ud - resistance * i[0] + omega * lq * i[1]) / ld,
                (uq - resistance * i[1] - omega * (ld * i[0] + flux)) / lq]

    steps = 400
    exact = solve_ivp(slope, (0.0, steps * CYCLE), [1.0, -2.0], 'DOP853',
                      np.arange(1, steps + 1) * CYCLE, rtol=1e-10, atol=1e-10).y
    i, found = (1.0, -2.0), []
    for _ in range(steps):
        i = winding(*i, ud, uq, omega, resistance, ld, lq, flux, CYCLE)
        found.append(i)
    assert np.abs(np.array(found).T - exact).max() < 1e-3 * np.abs(exact).max()


def test_the_current_loop_answers_as_python_control_says():
    p = drive(velocity_time=1e3, speed_gain=1.0)
    wanted = p.velocity_gain * p.tuned_inertia / p.torque_constant * 0.5  # A, of 0.5 rad/s
    plant = control.c2d(control.ss([[-p.phase_resistance / p.q_inductance]],
                                   [[1.0 / p.q_inductance]], [[1.0]], [[0.0]]), CYCLE)
    kp = p.current_gain * p.q_inductance
    ki = kp * CYCLE / p.current_time
    loop = control.ss(control.tf([kp + ki, -kp], [1, -1], CYCLE))
    closed = control.feedback(plant * loop, 1)
    t = np.arange(300) * CYCLE
    expected = control.forced_response(closed, t, np.full(len(t), wanted)).outputs
    found, _ = stepped(p, 0.5, len(t) - 1)
    assert found == pytest.approx(expected[1:], rel=2e-3)


def test_the_velocity_loop_runs_every_fourth_time_and_adds_up_as_equation_15_says():
    p = drive(speed_gain=1.0)
    steps = 40
    _, s = stepped(p, 0.3, steps)
    runs = steps // 4
    kp = p.velocity_gain * p.tuned_inertia / p.torque_constant
    expected = kp * 0.3 + kp / p.velocity_time * runs * 0.3 * p.velocity_cycle
    assert s[pmsm_drive.WANTED] == pytest.approx(expected, rel=1e-12)


def test_loops_keep_their_cycles_at_any_step():
    p = drive(speed_gain=1.0)
    for parts in (1, 2, 3, 8):
        _, s = stepped(p, 0.3, 40 * parts, CYCLE / parts)
        kp = p.velocity_gain * p.tuned_inertia / p.torque_constant
        assert s[pmsm_drive.WANTED] == pytest.approx(
            kp * 0.3 * (1.0 + 10 * p.velocity_cycle / p.velocity_time), rel=1e-12)


def test_a_limited_current_does_not_wind_the_integral_up():
    p = drive(current_limit=5.0)
    _, s = stepped(p, 10.0, 200)
    assert s[pmsm_drive.WANTED] == 5.0 and s[pmsm_drive.VELOCITY_SUM] == 0.0


def test_reluctance_adds_torque_as_equation_20_says():
    p = drive(d_inductance=1.5e-3, q_inductance=3e-3, velocity_time=1e3)
    current, s = stepped(p, 0.2, 50, speed=150.0)
    d, q = s[pmsm_drive.D], s[pmsm_drive.Q]
    flux = p.torque_constant / (1.5 * p.pole_pairs)
    torque = 1.5 * p.pole_pairs * ((p.d_inductance * d + flux) * q - p.q_inductance * q * d)
    assert abs(d) > 0.1
    assert p.torque_constant * current[-1] == pytest.approx(torque, rel=1e-12)


# --- the switching inverter


def test_between_edges_the_switched_current_is_that_of_scipy():
    p = drive(switching=1.0, velocity_time=1e3)
    parts, speed, at = 8, 90.0, 0.4
    s = np.zeros(PmsmDrive.memory)
    for k in range(6 * parts):  # six cycles, the last one is looked at
        if k == 5 * parts:
            begun = s[pmsm_drive.D], s[pmsm_drive.Q]
        PmsmDrive.law(p, s, 6.0, at + speed * k * CYCLE / parts, speed, CYCLE / parts)
    shares = s[[pmsm_drive.DUTY_A, pmsm_drive.DUTY_B, pmsm_drive.DUTY_C]]
    flux, omega = p.torque_constant / (1.5 * p.pole_pairs), p.pole_pairs * speed
    start = p.pole_pairs * (at + speed * 5 * CYCLE)

    def slope(t, i):
        leg = BUS * (np.abs(t / CYCLE - 0.5) < 0.5 * shares)
        vector = 2.0 / 3.0 * leg @ np.exp(2j * np.pi / 3.0 * np.arange(3))
        u = vector * np.exp(-1j * (start + omega * t))
        complex_i = i[0] + 1j * i[1]
        rate = (u - (p.phase_resistance + 1j * omega * p.q_inductance) * complex_i
                - 1j * omega * flux) / p.q_inductance
        return [rate.real, rate.imag]

    exact = solve_ivp(slope, (0.0, CYCLE), begun, 'RK45', rtol=1e-8, atol=1e-10,
                      max_step=CYCLE / 500).y[:, -1]
    assert (s[pmsm_drive.D], s[pmsm_drive.Q]) == pytest.approx(tuple(exact), abs=2e-3)
    assert np.ptp(shares) > 0.1


def test_the_switched_inverter_gives_on_average_what_the_averaged_one_does():
    plain, _ = stepped(drive(velocity_time=1e3), 8.0, 400, speed=100.0)
    switched, _ = stepped(drive(velocity_time=1e3, switching=1.0), 8.0, 400, speed=100.0)
    assert np.abs(switched - plain).max() < 0.01 * np.abs(plain).max()


def test_a_switched_current_ripples_within_the_cycle():
    p = drive(velocity_time=1e3, switching=1.0)
    parts = 16
    current, _ = stepped(p, 4.0, 20 * parts, CYCLE / parts, speed=80.0)
    last = current[-parts:]
    assert np.ptp(last) > 5.0 * abs(last[-1] - current[-parts - 1])
