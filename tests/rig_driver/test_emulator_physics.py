"""The emulated rig's physics against what is known by other means, and each fault off is off."""

from math import pi, sqrt
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.linalg import expm

from servo_rig_driver.emulated import rig_sampling
from servo_rig_driver.emulated.emulated_bench import Bench, run
from servo_rig_driver.emulated.rig_file import load_rig, rig_settings
from servo_rig_driver.emulated.rig_properties import BY_PATH, PROPERTIES
from servo_rig_driver.emulated.slip_elements import over_the_turn

RIGS = Path(__file__).parents[2] / 'config' / 'rigs'
PLAIN = load_rig(RIGS / 'rv_plain.yaml')
FULL = load_rig(RIGS / 'rv_bench.yaml')
SILENT = {'sensors.noise': 0.0, 'sensors.counts': 0.0, 'sensors.wander': 0.0}
FREE = {'friction.level': 0.0, 'friction.viscous': 0.0, 'mesh.damping': 0.0}
N, J_M, J_L, K = 161.0, 1.14e-4, 5.76, 5e5  # paper 000, table 3
TORQUE_PER_VOLT = 0.49 * 0.4878 * N


def wave(seconds=0.5, amplitude=2.5, frequency=4.0):
    t = np.arange(round(seconds * 1000)) * 1e-3
    return amplitude * np.sin(2.0 * pi * frequency * t)


def energy(bench):
    state = bench.state[0]
    wind_up = state['motor_angle'] / N - state['load_angle']
    return (0.5 * J_M * state['motor_speed'] ** 2 + 0.5 * J_L * state['load_speed'] ** 2
            + 0.5 * K * wind_up ** 2)


def test_free_vibration_has_the_frequency_of_two_masses_and_keeps_its_energy():
    bench = Bench(PLAIN.with_values({**SILENT, **FREE}), period=2e-5)
    bench.state['load_angle'] = 1e-4
    start = energy(bench)
    wind_up = []
    for _ in range(10_000):
        bench.advance()
        wind_up.append(bench.state['motor_angle'][0] / N - bench.state['load_angle'][0])
    wind_up = np.array(wind_up)
    rising = np.flatnonzero((wind_up[:-1] < 0.0) & (wind_up[1:] >= 0.0))
    crossing = rising - wind_up[rising] / (wind_up[rising + 1] - wind_up[rising])
    frequency = (len(crossing) - 1) / ((crossing[-1] - crossing[0]) * 2e-5)
    expected = sqrt(K * (1.0 / J_L + 1.0 / (J_M * N * N))) / (2.0 * pi)  # 80.6 Hz
    assert frequency == pytest.approx(expected, rel=1e-4)
    assert energy(bench) == pytest.approx(start, rel=1e-3)


def test_steady_speed_is_where_the_motor_torque_meets_coulomb_and_viscous_friction():
    columns = run(PLAIN.with_values(SILENT), 'voltage', np.full(4000, 1.5))
    speed = (columns['load_position'][-1] - columns['load_position'][-501]) / 0.5
    coulomb, viscous = 18.0 + 0.03 * N, 14.0 + 1e-4 * N * N
    inertia = J_L + J_M * N * N
    steady = (1.5 * TORQUE_PER_VOLT - coulomb) / viscous
    reached = steady * (1.0 - np.exp(-3.75 * viscous / inertia))  # rigid: linear in speed
    assert speed == pytest.approx(reached, rel=2e-3)


def test_a_linear_rig_answers_a_voltage_as_the_matrix_exponential_says():
    rig = PLAIN.with_values({**SILENT, 'friction.level': 0.0})
    d, b_m, b_l = 60.0, 1e-4, 14.0
    # states: motor angle and speed, load angle and speed; the last column is the input, held
    a = np.zeros((5, 5))
    a[0, 1] = a[2, 3] = 1.0
    a[1] = np.array([-K / N, -d / N - b_m * N, K, d, 0.0]) / (N * J_M)
    a[3] = np.array([K / N, d / N, -K, -d - b_l, 0.0]) / J_L
    a[1, 4] = 0.49 * 0.4878 / J_M
    step = expm(a * 1e-3)
    t = np.arange(1500) * 1e-3
    volts = 2.0 * np.sin(2.0 * pi * (1.0 * t + 30.0 * t ** 2))  # 1 to 91 Hz: past the resonance
    state, expected = np.zeros(5), []
    for volt in volts:
        expected.append(state[:4].copy())
        state[4] = volt
        state = step @ state
    commands = np.column_stack([np.full(1500, rig_sampling.VOLTAGE_MODE), volts, 0.0 * volts])
    answers = Bench(rig).record(commands)
    expected = np.array(expected)
    for column, at in ((0, rig_sampling.MOTOR), (2, rig_sampling.LOAD)):
        error = np.abs(answers[:, at] - expected[:, column]).max()
        assert error < 1e-4 * np.ptp(expected[:, column])


def test_a_torque_below_break_away_moves_nothing_for_good():
    columns = run(PLAIN.with_values(SILENT), 'voltage', np.full(2000, 0.5))
    assert 0.5 * TORQUE_PER_VOLT < 18.0 + 0.03 * N
    assert abs(columns['load_position'][-1] - columns['load_position'][1000]) < 1e-8


def test_static_wind_up_is_the_sum_of_the_tooth_pairs_that_bear():
    rig = PLAIN.with_values({**SILENT, 'friction.level': 0.0, 'mesh.softening': 1.0,
                             'mesh.backlash': 1.0, 'mesh.backlash_load': 0.0,
                             'mesh.backlash_position': 0.0})
    external = np.concatenate([np.linspace(0.0, 80.0, 4000), np.full(500, 80.0)])
    commands = np.column_stack([np.full(4500, rig_sampling.VELOCITY_MODE), np.zeros(4500),
                                external])
    answers = Bench(rig).record(commands)[1000::250]
    wind_up = answers[:, rig_sampling.MOTOR] / N - answers[:, rig_sampling.LOAD]
    pairs = np.array([0.0, 0.15, 0.35, 0.6, 1.0]) * 8e-5 + 1.3e-4
    torque = K / 5 * np.maximum(wind_up[:, None] - pairs, 0.0).sum(axis=1)
    assert np.abs(torque - answers[:, rig_sampling.TORQUE]).max() < 0.1  # the corners are rounded
    assert np.abs(torque - external[1000::250]).max() < 1.5


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(motor=st.floats(-100.0, 100.0), load=st.floats(-1.0, 1.0), twist=st.floats(-5e-4, 5e-4))
def test_left_alone_the_rig_never_has_more_energy_than_at_the_start(motor, load, twist):
    rig = FULL.with_values({'motor.cogging': 0.0, 'drive.current_lag': 0.0, 'mesh.softening': 0.0,
                            'mesh.backlash': 0.0, 'error.tooth': 0.0, 'error.turn': 0.0})
    bench = Bench(rig, period=1e-4)
    bench.state['motor_speed'], bench.state['load_speed'] = motor, load
    bench.state['load_angle'] = twist
    # what swings by semi-implicit Euler: half the step times 500 rad/s, to either side
    most = energy(bench) * (1.0 + 500.0 * rig.step) + 1e-9
    for _ in range(2000):
        bench.advance()
        assert energy(bench) <= most


def test_the_full_rig_comes_to_rest_by_itself():
    bench = Bench(FULL, period=0.01)
    bench.state['motor_speed'], bench.state['load_speed'] = N, 1.0
    for _ in range(200):
        bench.advance()
    assert abs(bench.state['load_speed'][0]) < 1e-4
    assert abs(bench.state['motor_speed'][0]) < 2e-2


def test_friction_over_the_turn_has_no_mean():
    angles = np.linspace(0.0, 2.0 * pi, 1000, endpoint=False)
    assert abs(np.mean([over_the_turn(angle) for angle in angles])) < 1e-4


@pytest.mark.slow
def test_halving_the_step_converges():
    reference = wave()
    final = []
    for step in (2e-5, 1e-5, 5e-6, 2.5e-6):
        rig = rig_settings({'step': step, 'sensors': {'noise': 0.0, 'counts': 0.0}})
        final.append(run(rig, 'voltage', reference)['load_position'])
    errors = [np.abs(some - final[-1]).max() for some in final[:-1]]
    assert errors[0] < 8e-6  # rad, of some 0.05 rad of motion
    assert errors[2] < errors[0]


def test_a_smooth_rig_converges_with_the_square_of_the_step():
    final = []
    for step in (1e-4, 5e-5, 2.5e-5, 3.125e-6):
        bench = Bench(PLAIN.with_values({**SILENT, 'friction.level': 0.0}), period=0.02)
        object.__setattr__(bench.rig, 'step', step)
        bench.state['load_angle'] = 1e-4
        bench.advance()
        final.append(float(bench.state['load_angle'][0]))
    errors = np.abs(np.array(final[:-1]) - final[-1])
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.2)


# a scale, and a quantity that must not matter once the scale is 0
GOVERNS = [
    ('friction.level', 'friction.load_coulomb'), ('friction.load_level', 'friction.load_coulomb'),
    ('friction.motor_level', 'friction.motor_coulomb'),
    ('friction.viscous', 'friction.load_viscous'), ('friction.viscous', 'friction.motor_viscous'),
    ('friction.thinning', 'friction.shear_speed'), ('friction.weakening', 'friction.fade_speed'),
    ('friction.weakening', 'friction.renewal_angle'),
    ('friction.load', 'friction.load_coefficient'),
    ('friction.temperature', 'thermal.start'), ('mesh.backlash', 'mesh.gap'),
    ('mesh.backlash', 'mesh.backlash_position'), ('mesh.backlash_load', 'mesh.opening_torque'),
    ('mesh.softening', 'mesh.stagger'), ('mesh.hysteresis', 'mesh.slip_torque'),
    ('mesh.hysteresis', 'mesh.slip_angle'), ('mesh.damping', 'machine.damping'),
    ('error.tooth', 'error.amplitude'), ('error.tooth', 'error.order'),
    ('error.tooth', 'error.direction'), ('error.turn', 'error.turn_amplitude'),
    ('motor.cogging', 'motor.cogging_torque'), ('load.lag', 'load.bandwidth'),
    ('drive.current_lag', 'drive.bandwidth'), ('sensors.noise', 'sensors.motor_noise'),
    ('sensors.noise', 'sensors.load_noise'), ('sensors.noise', 'sensors.torque_noise'),
    ('sensors.noise', 'sensors.current_noise'), ('sensors.wander', 'sensors.torque_wander'),
    ('sensors.counts', 'sensors.motor_counts'), ('sensors.counts', 'sensors.load_counts'),
    ('sensors.lag', 'sensors.torque_bandwidth'), ('thermal.heating', 'friction.temperature'),
]


def outcome(values):
    rig = FULL.with_values({**values, **({'thermal.start': 25.0} | values)})
    bench = Bench(rig, seed=3)
    reference = wave()
    commands = np.column_stack([np.full(500, rig_sampling.VOLTAGE_MODE), reference,
                                8.0 * reference])
    return bench.record(commands)[:, :6]


@pytest.mark.parametrize('scale, quantity', GOVERNS)
def test_a_fault_that_is_off_no_longer_depends_on_its_size(scale, quantity):
    known = BY_PATH[quantity]
    # friction that grows with the load is rounded off by the level, so it must not be there
    base = {'friction.load': 0.0} if quantity == 'friction.load_coulomb' else {}
    base = {**base, 'thermal.room': 25.0}
    default = base.get(quantity, known.default)
    changed = {**base, quantity: default * 1.7 if default else 1.0}
    if scale == 'thermal.heating':
        changed['friction.temperature'] = 1.7
    off = outcome({**base, scale: 0.0}), outcome({**changed, scale: 0.0})
    on = outcome(base), outcome(changed)
    columns = slice(0, 5)
    assert np.array_equal(off[0][:, columns], off[1][:, columns])
    assert not np.array_equal(on[0][:, columns], on[1][:, columns])


WITHHELD = {
    'gravity': 10.0, 'spring_load': 50.0, 'quadratic_drag': 20.0, 'payload_inertia': 1.0,
    'friction_drift': 0.3, 'local_spot': 20.0, 'rest_ageing': 3.0, 'command_delay': 0.002,
    'drive_dead_band': 0.3, 'drive_gain': 0.1, 'drive_offset': 0.1, 'supply_sag': 280.0,
    'torque_constant': -0.1, 'torque_saturation': 0.5, 'torque_ripple': 0.03, 'cogging': 0.02,
    'motor_drag': 0.02, 'load_drag': 5.0, 'load_sensor_delay': 0.002, 'load_eccentricity': 1e-4,
    'motor_eccentricity': 1e-3, 'torque_sensor_gain': 0.05, 'torque_sensor_offset': 1.0,
    'current_sensor_gain': 0.05, 'current_sensor_offset': 0.02, 'slosh': 2.0,
}
IN_A_LOOP = {'controller_gain': -0.3, 'controller_integral': -0.5}
SHAPES = {'gravity_angle', 'payload_frequency', 'friction_drift_time', 'local_spot_angle',
          'local_spot_width'}


def test_every_withheld_fault_is_off_by_default_and_known_to_these_tests():
    names = {item.path.partition('.')[2] for item in PROPERTIES
             if item.path.startswith('withheld.')}
    assert names == set(WITHHELD) | set(IN_A_LOOP) | SHAPES
    assert all(BY_PATH[f'withheld.{name}'].default == 0.0 for name in [*WITHHELD, *IN_A_LOOP])


@pytest.mark.parametrize('name', WITHHELD)
def test_a_withheld_fault_shows_where_it_should(name):
    base = {**SILENT, 'thermal.heating': 0.0}
    plain, changed = (outcome({**base, **more}) for more in
                      ({}, {f'withheld.{name}': WITHHELD[name], 'withheld.local_spot_angle': 0.0}))
    moved = {column for column, at in (('motor', rig_sampling.MOTOR), ('load', rig_sampling.LOAD),
                                       ('torque', rig_sampling.TORQUE),
                                       ('current', rig_sampling.CURRENT))
             if not np.array_equal(plain[:, at], changed[:, at])}
    reading = {'load_sensor_delay': 'load', 'load_eccentricity': 'load',
               'motor_eccentricity': 'motor', 'torque_sensor_gain': 'torque',
               'torque_sensor_offset': 'torque', 'current_sensor_gain': 'current',
               'current_sensor_offset': 'current'}
    if name in reading:
        assert moved == {reading[name]}
    else:
        assert {'motor', 'load', 'torque'} <= moved


@pytest.mark.parametrize('name', IN_A_LOOP)
def test_a_withheld_controller_error_shows_in_the_command_only_in_a_loop(name):
    changed = FULL.with_values({f'withheld.{name}': IN_A_LOOP[name]})
    reference = wave(amplitude=0.2, frequency=1.0)
    for mode, differs in (('velocity', True), ('voltage', False)):
        commands = [run(rig, mode, reference)['voltage'] for rig in (FULL, changed)]
        assert np.array_equal(*commands) != differs


def test_friction_that_heats_the_gearbox_falls():
    rig = FULL.with_values({'sensors.noise': 0.0, 'thermal.capacity': 10.0})
    columns = run(rig, 'velocity', np.full(20_000, 0.5))
    assert columns['temperature'][-1] > columns['temperature'][3000] + 5.0
    assert columns['current'][-3000:].mean() < 0.97 * columns['current'][1000:4000].mean()


def test_lost_motion_grows_with_the_load():
    def lost(torque):
        rig = FULL.with_values({**SILENT, 'friction.level': 0.0, 'error.tooth': 0.0,
                                'error.turn': 0.0, 'load.ripple': 0.0})
        external = torque * np.sin(2.0 * pi * np.arange(4000) / 2000)
        columns = run(rig, 'velocity', np.zeros(4000), external)
        wind_up = columns['motor_position'] / N - columns['load_position']
        torques = columns['torque'] / K
        return np.ptp((wind_up - torques)[2000:])
    assert lost(60.0) > 1.1 * lost(20.0)


@pytest.mark.parametrize('amplitude', [1.5, 1.8])
def test_the_open_loop_runs_of_paper_000_move_by_tens_of_degrees_a_second(amplitude):
    t = np.arange(4000) * 1e-3
    columns = run(FULL, 'voltage', amplitude * np.sin(2.0 * pi * t))
    speed = np.degrees(np.gradient(columns['load_position'], 1e-3))[2000:]
    assert 15.0 < np.percentile(speed, 98) < 100.0


def test_velocity_follows_the_reference_of_paper_000():
    t = np.arange(4000) * 1e-3
    reference = np.radians(10.0) * np.sin(2.0 * pi * t)
    columns = run(FULL, 'velocity', reference)
    speed = np.gradient(columns['load_position'], 1e-3)
    error = (speed - reference)[1000:]
    assert np.sqrt(np.mean(error ** 2)) < 0.1 * np.radians(10.0)
