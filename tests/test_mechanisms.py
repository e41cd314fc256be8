"""The mechanisms and the laws in them, against oracles from elsewhere."""

from __future__ import annotations

import control
import every_effect
from every_effect import inputs, only, parameters
import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp

from servo_twin.physics.catalogue import find
from servo_twin.physics.controllers import Open
from servo_twin.physics.delay_line import delayed, ROOM
from servo_twin.physics.drives import CurrentDrive, VoltageDrive
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.servo import Placed, Servo
from servo_twin.physics.simulate import initial_state, simulate
from servo_twin.physics.state import LOAD_ANGLE, LOAD_SPEED, MOTOR_ANGLE, MOTOR_SPEED, ZERO

UNIT_DRIVE = {'drive.gain': 1.0, 'drive.torque_constant': 1.0, 'mechanism.ratio': 1.0}
PERIOD = 1e-3


def two_inertia(motor=0.02, load=0.05, stiffness=200.0, damping=0.0, step=1e-4, **values):
    """Return the servo of every effect, switched off, as a plain two-inertia machine."""
    return every_effect.servo({
        **UNIT_DRIVE, 'mechanism.rotor_inertia': motor, 'mechanism.load_inertia': load,
        'mechanism.stiffness': stiffness, 'mechanism.damping': damping,
        **{f'effects.{k.replace("__", ".")}': v for k, v in values.items()}}, step)


def rigid(inertia=0.05, step=1e-4, **values):
    """Return one inertia on a spring with Coulomb, Stribeck and LuGre friction."""
    effects = tuple(Placed(name, find(f'{name}{kind}'), site) for name, kind, site in (
        ('coulomb', '_friction', 'load'), ('stribeck', '_friction', 'load'),
        ('presliding', '_friction', 'load'), ('spring', '_load', 'load')))
    off = {f'effects.{p.name}.{a}': 0.0 for p in effects for a in p.effect.amplitudes()}
    return Servo('rigid', CurrentDrive, Rigid, Open, (), effects, {
        **UNIT_DRIVE, **off, 'mechanism.rotor_inertia': 0.0, 'mechanism.load_inertia': inertia,
        **{f'effects.{k.replace("__", ".")}': v for k, v in values.items()}}, step=step)


def rolled(servo, u, on=None, motor=0.0, load=0.0, torque=0.0, motor_speed=0.0, load_speed=0.0):
    """Run a servo from a state and return what its sensors read and the state after it."""
    on = only() if on is None else on
    x = initial_state(servo, motor, load, torque, on=on)
    x[MOTOR_SPEED], x[LOAD_SPEED] = motor_speed, load_speed
    return simulate(servo, u, PERIOD, x, on=on), x


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
    assert states[-1] < 0.5 * states[0]


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


# --- friction against event-located and stiff integration


def stick_slip(push, until, inertia, coulomb, excess, fade, spring):
    """Integrate one inertia with stiction, each phase up to its event; return the angle of t."""
    def free(t, angle):
        return push(t) - spring * angle

    def level(speed):
        return coulomb + excess * np.exp(-(speed / fade) ** 2)

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


def test_stiction_sticks_and_slips_as_event_located_integration_says():
    t = np.arange(2000) * PERIOD
    force = 0.8 * np.sin(5.0 * t)

    def push(now):  # the drive holds each sample: half a period late
        return 0.8 * np.sin(5.0 * (now - 0.5 * PERIOD))

    angle = stick_slip(push, t[-1] + PERIOD, 0.05, 0.3, 0.2, 0.1, 4.0)(t)
    servo = rigid(coulomb__level=0.3, stribeck__excess=0.2, stribeck__fade=0.1,
                  spring__stiffness=4.0, step=1e-5)
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


# --- delays


@pytest.mark.parametrize('delay', [0.0, 1e-4, 3.7e-4, 1e-3, 0.02, 0.3])
def test_a_delayed_ramp_is_the_ramp_of_before(delay):
    s, h = np.zeros(ROOM), 1e-4
    late = np.array([delayed(s, k * h, delay, h) for k in range(8000)])
    at = np.arange(8000) * h - delay
    assert late == pytest.approx(np.maximum(at, 0.0), abs=1e-12 if delay < 0.025 else 2e-3)
    assert late[4000:] == pytest.approx(at[4000:], abs=1e-12)


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
