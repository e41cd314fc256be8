"""The emulated pan-and-tilt against physics known by other means, and its models ranked."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from servo_identify.jobs.harmonic_drive_ranking import coupled_angle, freed, LINEAR, ranked
from servo_identify.learn.free_run import free_runs
from servo_rig_driver.emulated import coupled_axes, coupled_mass, flexspline
from servo_rig_driver.emulated.coupled_axes import run_pair
from servo_rig_driver.emulated.emulated_bench import Bench, run
from servo_rig_driver.emulated.rig_file import load_rig
from servo_studies.papers.pan_tilt import comparison_rows, page
from servo_studies.papers.pan_tilt.pan_tilt_page import CHANNELS
from servo_studies.papers.paper_comparison import KEYS
from servo_studies.papers.paper_systems import SYSTEMS
from servo_twin.description import servo_file
from servo_twin.physics.fixed_inertia import with_fixed_inertia
from servo_twin.physics.harmonic_drive_models import with_harmonic_drive
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import Recording

CONFIG = Path(__file__).parents[2] / 'config'
PAN = load_rig(CONFIG / 'rigs' / 'pan_tilt_azimuth.yaml')
TILT = load_rig(CONFIG / 'rigs' / 'pan_tilt_elevation.yaml')
AZIMUTH = servo_file.load(CONFIG / 'servos' / 'pan_tilt_azimuth.yaml')
LOSSLESS = {'friction.level': 0.0, 'friction.viscous': 0.0, 'mesh.damping': 0.0,
            'mesh.hysteresis': 0.0, 'flexspline.creep': 0.0, 'flexspline.static': 0.0,
            'flexspline.mesh_friction': 0.0, 'motor.cogging': 0.0, 'motor.ripple': 0.0,
            'machine.torque_constant': 1e-6, 'coupling.mass': 0.0}


# --- the emulated gear


def test_the_flexspline_carries_what_its_wind_up_asks_for():
    P = PAN.parameters()[0]
    stiffness, angle, soft = 1.6e4, 1.6e-4, 4.0
    for wind_up in (-2e-3, -1e-4, 0.0, 3e-5, 8e-4, 4e-3):
        expected = brentq(lambda t, w=wind_up: t / stiffness + angle * np.arcsinh(t / soft) - w,
                          -200.0, 200.0, xtol=1e-12)
        for start in (0.0, -20.0, 60.0):
            torque, slope = flexspline.cup(P, wind_up, start)
            assert torque == pytest.approx(expected, abs=1e-6)
            assert slope == pytest.approx(
                1.0 / (1.0 / stiffness + angle / np.hypot(torque, soft)), rel=1e-6)


def test_a_gear_without_losses_keeps_its_energy_through_stiffening_and_kinematic_error():
    bench = Bench(PAN.with_values({**LOSSLESS, 'flexspline.error_amplitude': 3e-4}), period=1e-3)
    state = bench.state[0]
    state['motor_speed'], state['load_speed'] = 120.0, 1.2
    energies, torques = [], []
    for _ in range(300):
        bench.advance()
        torque = float(state['flex_torque'])
        wound = torque**2 / (2.0 * 1.6e4) + 1.6e-4 * (np.hypot(torque, 4.0) - 4.0)
        energies.append(0.5 * 2e-5 * state['motor_speed']**2
                        + 0.5 * 0.45 * state['load_speed']**2 + wound)
        torques.append(torque)
    assert np.ptp(torques) > 4.0, 'the error does not shake the gear'
    assert np.ptp(energies) < 2e-3 * energies[0]


def test_the_static_friction_holds_the_rig_still_about_the_crossing_of_zero():
    t = np.arange(5000) * 1e-3
    sine = 3.0 * np.sin(2.0 * np.pi * 0.2 * t)
    still = {}
    for name, changes in (('as it is', {}), ('without friction', {
            'friction.level': 0.0, 'flexspline.static': 0.0, 'flexspline.mesh_friction': 0.0})):
        columns = run(PAN.with_values(changes), 'voltage', sine)
        speed = np.gradient(columns['load_position'], 1e-3)
        speed = np.convolve(speed, np.ones(20) / 20, 'same')
        still[name] = np.mean(np.abs(speed[500:]) < 0.01)
    assert still['as it is'] > 0.1 and still['without friction'] < 0.03


# --- two axes


def test_the_inertia_of_a_pan_is_that_of_a_mass_on_an_arm():
    P, S = PAN.parameters()[0], Bench(PAN).state[0]
    for angle in np.linspace(-1.5, 1.5, 7):
        S['other_angle'] = angle
        arm = 0.20 * np.cos(angle) - 0.03 * np.sin(angle)
        assert coupled_mass.load_inertia(P, S) == pytest.approx(0.45 + 18.0 * arm**2, rel=1e-12)
        slopes = []
        for way in (1e-6, -1e-6):
            S['other_angle'] = angle + way
            slopes.append(coupled_mass.load_inertia(P, S))
        S['other_angle'] = angle
        assert coupled_mass.inertia_slope(P, S) == pytest.approx(
            (slopes[0] - slopes[1]) / 2e-6, abs=1e-6)


def test_a_moving_tilt_leaves_the_pan_its_angular_momentum():
    P, S = PAN.parameters()[0], Bench(PAN).state[0]
    S['load_speed'], S['other_speed'] = 1.3, 0.9
    momentum = coupled_mass.load_inertia(P, S) * 1.3
    for _ in range(1000):
        coupled_mass.turn_other(P, S, 1e-3)
    assert S['other_angle'] == pytest.approx(0.9)
    assert coupled_mass.load_inertia(P, S) * S['load_speed'] == pytest.approx(momentum, rel=1e-9)


@pytest.fixture(scope='module')
def nodding():
    """Both axes for six seconds: the pan driven to and fro, the tilt nodding."""
    t = np.arange(6000) * 1e-3
    pan = 4.2 * np.sign(np.sin(2.0 * np.pi * 0.4 * t + 1e-9))
    return run_pair(PAN, TILT, 'voltage', pan, 'position', 0.7 * (1.0 - np.cos(1.2 * t)))


@pytest.mark.long
def test_a_twin_that_sees_the_tilt_is_closer_to_the_pan_than_one_that_does_not(nodding):
    pan, tilt = nodding
    assert np.array_equal(pan['coupled_position'], tilt['load_position'])
    columns = {name: column for name, column in pan.items() if name != 't'}
    recording = Recording('nodding', 1e-3, columns)
    seeing, blind = (free_runs(servo, [recording])[0].speed_fit
                     for servo in (AZIMUTH, with_fixed_inertia(AZIMUTH, 0.0)))
    assert seeing > 0.9 and blind < seeing - 0.1


def test_both_axes_are_recorded_by_command(tmp_path, capsys):
    np.savez(tmp_path / 'waves.npz', pan=np.full(200, 4.0), tilt=np.full(200, 0.3))
    tables = [tmp_path / 'pan.csv', tmp_path / 'tilt.csv']
    words = ['--pan', str(CONFIG / 'rigs' / 'pan_tilt_azimuth.yaml'),
             '--tilt', str(CONFIG / 'rigs' / 'pan_tilt_elevation.yaml'),
             '--waves', str(tmp_path / 'waves.npz'), '--pan-mode', 'voltage']
    assert coupled_axes.main([*words, '-o', *map(str, tables)]) == 0
    read = [np.genfromtxt(table, delimiter=',', names=True) for table in tables]
    assert np.allclose(read[0]['coupled_position'], read[1]['load_position'])
    np.savez(tmp_path / 'waves.npz', pan=np.full(200, 4.0), tilt=np.full(100, 0.3))
    assert coupled_axes.main([*words, '-o', *map(str, tables)]) == 1
    assert '200 set-points for the pan, 100 for the tilt' in capsys.readouterr().err


def test_a_pan_that_carries_nothing_is_refused():
    with pytest.raises(ValueError, match='coupling.mass of pan_tilt_elevation is 0'):
        run_pair(TILT, PAN, 'voltage', np.zeros(3), 'voltage', np.zeros(3))


@pytest.mark.long
@pytest.mark.slow
def test_a_servo_whose_other_axis_stands_still_has_the_inertia_of_that_angle():
    u = inputs_of({'voltage': np.full(200, 6.0), 'coupled_position': np.full(200, 0.8),
                   **{name: np.full(200, np.nan) for name in (
                       'current', 'reference_velocity', 'reference_position', 'external_torque',
                       'temperature', 'motor_position', 'load_position')}})
    still = with_fixed_inertia(AZIMUTH, 0.8)
    assert not any(p.effect.port == 'inertia' for p in still.effects)
    low, high = still.tolerance['mechanism.load_inertia']
    assert low < still.values['mechanism.load_inertia'] < high
    answers = [simulate(one, u, 1e-3, initial_state(one)) for one in (AZIMUTH, still)]
    assert np.allclose(*answers, rtol=1e-9)


# --- which model


def made_by(model: str, volts: float, seed: int) -> Recording:
    """Return what a twin with one of the models would have been recorded as."""
    servo = with_harmonic_drive(with_fixed_inertia(AZIMUTH, 0.0), model)
    t = np.arange(3000) * 1e-3
    voltage = volts * np.sin(2.0 * np.pi * 0.5 * t) + 2.0 * np.sin(2.0 * np.pi * (3.0 + seed) * t)
    torque = 4.0 * np.sin(2.0 * np.pi * 0.7 * t)
    nothing = np.full(len(t), np.nan)
    u = inputs_of({'voltage': voltage, 'external_torque': torque, **{name: nothing for name in (
        'current', 'reference_velocity', 'reference_position', 'temperature', 'motor_position',
        'load_position')}})
    y = simulate(servo, u, 1e-3, initial_state(servo))
    noise = np.random.default_rng(seed).standard_normal((len(t), 4))
    motor, load, felt, current = (y[:, k] + size * noise[:, k]
                                  for k, size in enumerate((3e-4, 2e-6, 5e-3, 1e-3)))
    return Recording(f'{model}_{seed}', 1e-3, {
        'voltage': voltage, 'motor_position': motor, 'load_position': load, 'torque': felt,
        'current': current, 'external_torque': torque, 'temperature': nothing},
        family='sine', replicate=seed)


@pytest.mark.long
@pytest.mark.slow
def test_the_model_that_made_the_recordings_is_ranked_first():
    truth = 'tjahjowidodo'
    order = ranked(AZIMUTH, [made_by(truth, 4.0, 1)], [made_by(truth, 5.0, 2)],
                   names=('hashimoto_kiyosawa', truth))
    assert order[0].name == truth and {one.name for one in order} == {
        truth, 'hashimoto_kiyosawa', LINEAR}
    assert order[0].shrink > 0.8 and order[0].gap < 0.3 * order[1].gap
    assert next(one for one in order if one.name == LINEAR).shrink == 0.0
    assert set(CHANNELS) <= set(order[0].errors)  # what the page shows


def test_models_are_not_compared_over_a_moving_axis(nodding):
    columns = {name: column for name, column in nodding[0].items() if name != 't'}
    recording = Recording('nodding', 1e-3, columns)
    with pytest.raises(ValueError, match='the other axis moves over'):
        coupled_angle([recording])
    with pytest.raises(ValueError, match="there is no model 'spring'"):
        ranked(AZIMUTH, [recording], [recording], names=('spring',))


def test_all_that_a_model_says_is_fitted_but_its_orders():
    free = freed(with_harmonic_drive(AZIMUTH, 'ghorbel_gandhi'))
    assert 'effects.kinematic_error.cosine' in free and 'effects.wave_generator.fade' in free
    assert not any(path.endswith(('.order', '.lag')) for path in free)
    assert set(AZIMUTH.tolerance) <= set(free) and len(set(free)) == len(free)


# --- the page


FOUND = {
    'step': {'rig': {'final': 1.5, 'rise': 0.4},
             'linear model': {'final': 2.0, 'rise': 0.5, 'fit': 0.71},
             'twin, B': {'final': 1.51, 'rise': 0.41, 'fit': 0.972}},
    'sine': {'rig': {'still': 0.21, 'top': 1.3, 'flat': 0.17},
             'linear model': {'still': 0.01, 'top': 1.1, 'flat': 0.12, 'fit': 0.5},
             'twin, B': {'still': 0.2, 'top': 1.31, 'flat': 0.16, 'fit': 0.913}},
    'best': 'B',
    'ranking': [
        {'name': 'b', 'title': 'B', 'gap': 0.123, 'shrink': 0.77, 'interval': [0.6, 0.9],
         'errors': {'load_position': 1e-3, 'torque': 0.5, 'torsion': 1e-4, 'current': 2e-3},
         'free': 20, 'seconds': 3.0,
         'values': {'loop.level': [0.5, 'N m'], 'kinematic_error.sine': [[1e-4, 2e-5], 'rad']}},
        {'name': LINEAR, 'title': 'linear', 'gap': 0.9, 'shrink': 0.0, 'interval': [0.0, 0.0],
         'errors': {'load_position': 5e-3, 'torque': 0.9, 'torsion': 2e-4, 'current': 9e-3},
         'free': 12, 'seconds': 2.0, 'values': {}}],
    'diagnosis': {'sentence': 'It lacks something.', 'before': 0.12, 'after': 0.1, 'floor': 0.02,
                  'causes': ['hysteresis at the mesh'],
                  'where': [['load', 3.4, 'gap'], ['motor', 0.9, 'at the noise floor']]},
    'axes': {'tilt': [0.0, 1.4], 'inertia': [1.2, 0.5],
             'fit': {'inertia over elevation': [0.97, 0.95],
                     'elevation taken as level': [0.73, 0.84]},
             'rms': {'inertia over elevation': 0.03, 'elevation taken as level': 0.2}},
}


def test_the_page_says_what_was_measured():
    text = page(FOUND)
    for said in ('12.3 %', '77 % (60 to 90)', 'loop.level 0.5 N m', '(0.0001, 2e-05) rad',
                 'It lacks something.', '| rig | 21.0 | 1.300 | 17.0 |', '0.972',
                 '1.200 kg m2', 'Balances\nwith a gap (in noise floors): load 3.4.'):
        assert said in text, said


def test_every_row_of_the_comparison_is_one_of_the_systems():
    known = {system.name for system in SYSTEMS if system.part == 'pan_tilt'}
    rows = comparison_rows(FOUND)
    assert {row['system'] for row in rows} <= known and len(rows) == 4
    assert all(set(row) == set(KEYS) and all(isinstance(v, str) for v in row.values())
               for row in rows)
