"""Laws with a memory, against closed forms and solvers from elsewhere."""

from __future__ import annotations

import control
from every_effect import inputs, only, parameters
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
from plain_machines import PERIOD, rigid, rolled, two_inertia
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp

from servo_twin.physics.catalogue import find
from servo_twin.physics.simulate import initial_state, simulate

# --- friction against event-located and stiff integration


def stick_slip(push, until, inertia, coulomb, excess, fade, exponent, spring):
    """Integrate one inertia with stiction, each phase up to its event; return the angle of t."""
    def free(t, angle):
        return push(t) - spring * angle

    def level(speed):
        return coulomb + excess * np.exp(-np.abs(speed / fade) ** exponent)

    def stops(t, state):
        return state[1]

    t, state, way, pieces = 0.0, [0.0, 0.0], 0.0, []
    while t < until:
        if way == 0.0:
            def breaks(now, _, angle=state[0]):
                return abs(free(now, angle)) - level(0.0)

            breaks.terminal, breaks.direction = True, 1.0
            piece = solve_ivp(lambda now, held: [0.0], (t, until), [state[0]], events=breaks,
                              rtol=1e-10, max_step=1e-2, dense_output=True)
            pieces.append((t, piece.t[-1], piece.sol))
            t, state = piece.t[-1], [state[0], 0.0]
            way = np.sign(free(t, state[0]))
        else:
            stops.terminal, stops.direction = True, -way
            piece = solve_ivp(
                lambda now, s, sign=way: [s[1], (free(now, s[0]) - sign * level(s[1])) / inertia],
                (t, until), state, events=stops, rtol=1e-10, atol=1e-12, max_step=1e-2,
                dense_output=True)
            pieces.append((t, piece.t[-1], piece.sol))
            t, state = piece.t[-1], [piece.y[0, -1], 0.0]
            pushing = free(t, state[0])
            way = np.sign(pushing) if abs(pushing) > level(0.0) else 0.0

    def angle(now):
        return np.array([next(p(s)[0] for a, b, p in pieces if a <= s <= b) for s in now])

    return angle


@pytest.mark.long
@pytest.mark.parametrize('exponent', [2.0, 1.0])
def test_stiction_sticks_and_slips_as_event_located_integration_says(exponent):
    t = np.arange(2000) * PERIOD
    force = 0.8 * np.sin(5.0 * t)

    def push(now):  # the drive holds each sample: half a period late
        return 0.8 * np.sin(5.0 * (now - 0.5 * PERIOD))

    angle = stick_slip(push, t[-1] + PERIOD, 0.05, 0.3, 0.2, 0.1, exponent, 4.0)(t)
    servo = rigid(coulomb__level=0.3, stribeck__excess=0.2, stribeck__fade=0.1,
                  stribeck__exponent=exponent, spring__stiffness=4.0, step=1e-5)
    y = simulate(servo, inputs(len(t), voltage=force), PERIOD, initial_state(servo))
    assert np.ptp(angle) > 0.1
    assert np.abs(y[:, 0] - angle).max() < 5e-3 * np.ptp(angle)


def test_lugre_creeps_and_breaks_away_as_a_stiff_solver_says():
    inertia, level, excess, breakaway, fade, lag = 0.05, 0.3, 0.2, 2e-3, 0.05, 2e-3
    stiffness = (level + excess) / breakaway

    def slope(t, state):
        angle, speed, bend = state
        most = level + excess * np.exp(-((speed / fade) ** 2))
        rate = speed - stiffness * abs(speed) / most * bend
        torque = -stiffness * (bend + lag * rate)
        return [speed, (0.6 * np.sin(3.0 * (t - 0.5 * PERIOD)) + torque) / inertia, rate]

    t = np.arange(1500) * PERIOD
    expected = solve_ivp(slope, (0.0, t[-1]), [0.0, 0.0, 0.0], 'Radau', t, rtol=1e-8, atol=1e-11)
    servo = rigid(presliding__level=level, presliding__excess=excess, presliding__fade=fade,
                  presliding__breakaway=breakaway, presliding__lag=lag, step=1e-5)
    y = simulate(servo, inputs(len(t), voltage=0.6 * np.sin(3.0 * t)), PERIOD,
                 initial_state(servo))
    bent = expected.y[0][:150]
    assert np.abs(y[:150, 0] - bent).max() < 0.01 * np.ptp(bent), 'before it breaks away'
    assert np.abs(y[:, 0] - expected.y[0]).max() < 0.01 * np.ptp(expected.y[0])


@settings(max_examples=50, deadline=None)
@given(width=st.floats(1e-6, 0.1), turns=st.lists(st.floats(-0.5, 0.5), min_size=2, max_size=20))
def test_lost_motion_is_what_a_load_pushed_at_either_end_of_a_gap_loses(width, turns):
    effect, s = find('lost_motion'), np.zeros(3)
    p = parameters(effect, width=width)
    shown = {f: 0.0 for f in effect.motion._fields}
    load = turns[0]
    for driven in turns:
        lost = effect.law(p, s, effect.motion(**{**shown, 'driven': driven}), 1e-3)
        load = min(max(load, driven - 0.5 * width), driven + 0.5 * width)
        assert lost == pytest.approx(driven - load, abs=1e-12)


def test_dahl_friction_follows_its_closed_form_through_reversals():
    dahl, s = find('dahl_friction'), np.zeros(1)
    p = parameters(dahl, level=2.0, travel=1e-3)
    shown = {f: 0.0 for f in dahl.motion._fields}
    torque, start = [], 0.0
    for way in (1.0, -1.0, 1.0):
        for k in range(1, 401):
            torque.append(dahl.law(p, s, dahl.motion(**{**shown, 'speed': 0.02 * way}), 1e-3))
            gone = 0.02 * 1e-3 * k
            assert -torque[-1] == pytest.approx(
                2.0 * way + (start - 2.0 * way) * np.exp(-gone / 1e-3), abs=1e-12)
        start = -torque[-1]


def test_a_rounded_loop_tends_to_its_level_and_small_ones_wander():
    effect, s = find('dahl_hysteresis'), np.zeros(2)
    p = parameters(effect, level=2.0, travel=1e-4)
    ends, begin = [], 0.0
    for end in (1e-3, 0.9e-3, 1e-3, 0.9e-3, 1e-3):
        for angle in np.linspace(begin, end, 50):
            torque = effect.law(p, s, effect.motion(angle, 0.0, 0.0), 1e-4)
        ends.append(torque)
        begin = end
    assert ends[0] == pytest.approx(2.0, abs=1e-3)
    assert ends[1] == pytest.approx(2.0 * (2.0 * np.exp(-1.0) - 1.0), abs=1e-3)
    assert ends[0] - ends[2] > ends[2] - ends[4] > 0.0


def test_hysteresis_closes_its_minor_loops():
    effect, s = find('hysteresis'), np.zeros(5)
    p = parameters(effect)
    legs = [(0.0, 8e-5), (8e-5, -2e-5), (-2e-5, 4e-5), (4e-5, -2e-5), (-2e-5, 8e-5)]
    ends = []
    for begin, end in legs:
        for angle in np.linspace(begin, end, 50):
            torque = effect.law(p, s, effect.motion(angle, 0.0, 0.0), 1e-4)
        ends.append(torque)
    assert ends[3] == pytest.approx(ends[1], abs=1e-12)
    assert ends[4] == pytest.approx(ends[0], abs=1e-12)


@pytest.mark.long
def test_a_payload_shows_its_resonance_and_antiresonance():
    place = 'payload_resonance_at_load'
    servo = two_inertia(load=0.05, stiffness=1e5, damping=20.0, step=1e-5,
                        **{f'{place}__inertia': 0.03, f'{place}__frequency': 10.0,
                           f'{place}__damping': 0.05})
    t = np.arange(2000) * PERIOD
    u = np.sin((20.0 + 40.0 * t) * t)
    jl, jp, w = 0.07, 0.03, 2.0 * np.pi * 10.0
    k, c = jp * w**2, 2.0 * 0.05 * w * jp
    plant = control.tf([jp, c, k], [jl * jp, (jl + jp) * c, (jl + jp) * k, 0])
    speed = control.forced_response(control.c2d(control.ss(plant), PERIOD), t, u).outputs
    y, x = rolled(servo, inputs(len(t), voltage=u), only(place))
    angle = cumulative_trapezoid(speed, t, initial=0.0)
    assert np.abs(y[:, 1] - angle).max() < 5e-3 * np.ptp(angle)


@pytest.mark.parametrize(('name', 'rate', 'way'), [
    ('relaxing_spring', 'speed', -1.0), ('viscoelasticity', 'rate', 1.0)])
def test_the_torque_of_what_creeps_fades_at_rest_and_damps_slow_motion(name, rate, way):
    effect, s, h = find(name), np.zeros(1), 1e-5
    p = parameters(effect, stiffness=20.0, time=0.05)

    def moving(speed):
        return effect.motion(**dict.fromkeys(effect.motion._fields, 0.0) | {rate: speed})

    moved = [effect.law(p, s, moving(2.0), h) for _ in range(100)]
    assert moved[-1] == pytest.approx(way * 20.0 * 2.0 * 100 * h, rel=0.02)  # at once, a spring
    rests = [effect.law(p, s, moving(0.0), h) for _ in range(5000)]
    assert rests[-1] / moved[-1] == pytest.approx(np.exp(-1.0), rel=1e-3)
    goes_on = [effect.law(p, s, moving(2.0), h) for _ in range(100_000)]
    assert goes_on[-1] == pytest.approx(way * 20.0 * 0.05 * 2.0, rel=1e-3)  # in the end, a damper


def test_a_torque_sensor_with_an_inertia_in_front_lacks_what_that_takes():
    place = 'torque_sensor_inertia_at_torque'
    servo = two_inertia(load=0.05, stiffness=400.0, damping=0.5, step=1e-5,
                        **{f'{place}__inertia': 0.004})
    t = np.arange(1000) * PERIOD
    driven = inputs(len(t), voltage=np.sin((5.0 + 20.0 * t) * t))
    whole, lacks = (rolled(servo, driven, switches)[0] for switches in (only(), only(place)))
    assert np.array_equal(np.delete(whole, 2, 1), np.delete(lacks, 2, 1))
    speed = np.diff(whole[:, 1]) / PERIOD  # halfway between readings, as the law has it
    taken = 0.004 * np.diff(speed) / PERIOD
    said = 0.5 * (whole - lacks)[1:-1, 2] + 0.5 * (whole - lacks)[2:, 2]
    assert np.abs(said - taken).max() < 0.01 * np.abs(taken).max()


# --- delays


def test_a_rate_limit_makes_a_ramp_of_a_jump_and_lets_slow_changes_pass():
    effect, h = find('command_rate_limit'), 1e-3
    p = parameters(effect, rate=30.0)

    def followed(command):
        s = np.zeros(2)
        return np.array([effect.law(p, s, effect.motion(one, 0.0, 0.0), h) for one in command])

    t = np.arange(400) * h
    jump = np.where(t < 0.05, -1.0, 5.0)
    assert followed(jump) == pytest.approx(
        np.clip(-1.0 + 30.0 * (t - 0.049), -1.0, 5.0), abs=1e-9)
    slow = np.sin(20.0 * t)
    assert followed(slow) == pytest.approx(slow, abs=1e-12)


def test_a_drive_out_of_voltage_gives_less_while_it_drives_and_all_while_it_brakes():
    effect = find('torque_speed_limit')
    p = parameters(effect, limit=80.0, slope=0.4)

    def gives(command, speed):
        return effect.law(p, np.zeros(1), effect.motion(command, speed, 0.0), 1e-3)

    assert gives(20.0, 100.0) == 20.0 and gives(-20.0, 0.0) == -20.0
    assert gives(20.0, 160.0) == pytest.approx(80.0 - 0.4 * 160.0)
    assert gives(-20.0, -160.0) == pytest.approx(-16.0)
    assert gives(20.0, -160.0) == 20.0  # it brakes
    assert gives(20.0, 250.0) == 0.0 and gives(0.0, 250.0) == 0.0


def test_a_drive_that_takes_little_back_brakes_with_so_much_power_and_drives_with_all():
    effect = find('braking_power_limit')
    p = parameters(effect, power=600.0)

    def gives(command, speed):
        return effect.law(p, np.zeros(1), effect.motion(command, speed, 0.0), 1e-3)

    assert gives(20.0, 100.0) == 20.0 and gives(20.0, 0.0) == 20.0
    assert gives(-20.0, 100.0) == pytest.approx(-6.0) and gives(20.0, -100.0) == pytest.approx(6.0)
    assert gives(-5.0, 100.0) == -5.0  # 500 of the 600


def test_the_overlap_of_a_valve_is_left_out_each_way_by_its_own_width():
    effect = find('uneven_dead_band')
    p = parameters(effect, positive=0.4, negative=0.6)

    def gives(command):
        return effect.law(p, np.zeros(1), effect.motion(command, 0.0, 0.0), 1e-3)

    assert [gives(one) for one in (0.3, -0.5, 0.0)] == [0.0, 0.0, 0.0]
    assert [gives(one) for one in (1.4, -1.6)] == pytest.approx([1.0, -1.0])


def test_a_reading_behind_a_filter_shows_63_percent_of_a_step_in_its_time():
    effect, h = find('sensor_lag'), 1e-4
    p, s = parameters(effect, lag=0.02), np.zeros(2)
    read = [effect.law(p, s, effect.motion(value, 0.0, 0.0, 0.0, 0.0), h)
            for value in [3.0] * 10 + [5.0] * 200]
    assert read[:10] == [3.0] * 10  # it begins settled
    assert read[-1] == pytest.approx(5.0 - 2.0 * np.exp(-1.0), rel=1e-6)


def test_a_command_delay_moves_the_answer_by_as_many_samples():
    place = 'command_delay_at_command'
    t = np.arange(400) * PERIOD
    u = inputs(len(t), voltage=np.sin(30.0 * t) * (t > 0.01))
    prompt, _ = rolled(two_inertia(), u)
    late, _ = rolled(two_inertia(**{f'{place}__delay': 0.007}), u, only(place))
    assert late[7:, :4] == pytest.approx(prompt[:-7, :4], abs=1e-12)


def test_a_sensor_delay_moves_the_reading_and_nothing_else():
    place = 'sensor_delay_at_load_position'
    t = np.arange(400) * PERIOD
    u = inputs(len(t), voltage=np.sin(30.0 * t))
    prompt, _ = rolled(two_inertia(), u)
    late, _ = rolled(two_inertia(**{f'{place}__delay': 0.0025}), u, only(place))
    between = 0.5 * (prompt[:-1, 1] + prompt[1:, 1])
    assert late[3:, 1] == pytest.approx(between[:-2], abs=1e-12)
    assert np.array_equal(late[:, 0], prompt[:, 0])
