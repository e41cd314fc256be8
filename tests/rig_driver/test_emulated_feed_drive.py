"""The emulated feed drive: its parts against other formulas, and what every property does."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
import yaml

from servo_rig_driver.emulated.emulated_bench import Bench, run
from servo_rig_driver.emulated.excitation_families import family
from servo_rig_driver.emulated.feed_drive import screw, stator_frame
from servo_rig_driver.emulated.feed_drive.feed_properties import PROPERTIES
from servo_rig_driver.emulated.feed_drive.feed_state import fresh_state
from servo_rig_driver.emulated.rig_file import load_rig, rig_settings, RigFileError

RIG = Path(__file__).parents[2] / 'config' / 'rigs' / 'feed_drive.yaml'
PERIOD = 1e-3
IDEAL = ('drive.imperfection=0', 'screw.pitch=0', 'screw.expansion=0', 'sensors.noise=0',
         'sensors.load_cyclic=0')


def sine(seconds=0.4, speed=0.05, amplitude=0.004):
    t = np.arange(round(seconds / PERIOD)) * PERIOD
    return family('feed_sine').waves(t, {'amplitude': amplitude, 'speed': speed, 'ease': 0.05})[0]


def record(reference, *turned, mode='position', **more):
    return run(load_rig(RIG, turned), mode, reference, **more)


def parts(*turned):
    """Return the record of properties and a fresh state, as the compiled parts take them."""
    rig = load_rig(RIG, turned)
    return rig.parameters()[0], fresh_state(rig.values)[0]


# --- the file


def test_the_shipped_axis_states_every_property_with_its_default():
    content = yaml.safe_load(RIG.read_text())
    stated = {f'{section}.{name}': value for section, values in content.items()
              if isinstance(values, dict) for name, value in values.items()}
    assert stated == {item.path: item.default for item in PROPERTIES}
    for item in PROPERTIES:
        assert item.meaning.endswith('.') and item.low <= item.default <= item.high


@pytest.mark.parametrize('content, words', [
    ({'physics': 'steam'}, "physics = 'steam' is unknown; it is one of"),
    ({'physics': 'feed_drive', 'mesh': {}}, "no section 'mesh'"),
    ({'physics': 'feed_drive', 'nut': {'gap': 1}},
     r"no property 'nut.gap'; did you mean 'nut.play'"),
    ({'physics': 'feed_drive', 'nut': {'play': 1}}, r'nut.play = 1 m is outside \[0, 0.01\]'),
])
def test_nonsense_in_its_rig_file_is_named(content, words):
    with pytest.raises(RigFileError, match=words):
        rig_settings(content)


# --- parts


def test_the_back_emf_makes_the_torque_constant_of_a_q_current():
    P, S = parts('drive.imperfection=0')
    for angle in (0.1, 1.0, -2.3):
        e = np.array(stator_frame.flux_shape(P, angle))
        q = np.array([-np.sin(4.0 * angle), np.cos(4.0 * angle)])
        assert 1.5 * e @ (3.0 * q) == pytest.approx(3.0 * 1.0182)
        assert e @ np.array([q[1], -q[0]]) == pytest.approx(0.0, abs=1e-12)


def test_the_winding_is_that_of_scipy():
    P, S = parts('drive.imperfection=0')
    S['voltages'][:] = 40.0, -10.0, -30.0
    S['motor_speed'] = 20.0

    def slope(t, i):
        e = np.array(stator_frame.flux_shape(P, 20.0 * t))
        return (np.array([40.0, 20.0 / np.sqrt(3.0)]) - P['drive_resistance'] * i - 20.0 * e
                ) / P['drive_inductance']

    h, steps = 6.25e-6, 800
    for _ in range(steps):
        stator_frame.advance_current(P, S, h)
        S['motor_angle'] += h * 20.0
    exact = solve_ivp(slope, (0.0, steps * h), [0.0, 0.0], rtol=1e-9, atol=1e-9).y[:, -1]
    assert (S['current_alpha'], S['current_beta']) == pytest.approx(tuple(exact), rel=1e-4)


def test_the_slope_of_the_pitch_error_is_its_slope():
    P, _ = parts()
    for angle in (-30.0, 0.3, 41.0):
        ahead, behind = (screw.pitch_error(P, angle + d)[0] for d in (1e-4, -1e-4))
        assert screw.pitch_error(P, angle)[1] == pytest.approx((ahead - behind) / 2e-4, rel=1e-4)
    assert screw.pitch_error(P, 0.0)[0] == 0.0


@pytest.mark.parametrize('over', [1e-6, 4e-6])
def test_the_balls_press_as_hertz_says(over):
    P, _ = parts()
    assert screw.press(P, 7.5e-6 + over, 0.0) == pytest.approx(2e11 * over**1.5)
    assert screw.press(P, -7.5e-6 - over, 0.0) == pytest.approx(-2e11 * over**1.5)
    assert screw.press(P, 7.4e-6, 0.3) == 0.0
    assert screw.press(P, 7.5e-6 + over, -1e3) == 0.0  # balls never pull


# --- the whole


@pytest.mark.slow
def test_half_the_substep_moves_the_table_by_nanometres():
    rig = load_rig(RIG, IDEAL)
    fine = load_rig(RIG, IDEAL)
    object.__setattr__(fine, 'step', rig.step / 2.0)
    one, other = (run(r, 'position', sine())['load_position'] for r in (rig, fine))
    assert np.abs(one - other).max() < 3e-7


def test_a_ramp_is_followed_at_the_distance_of_the_gain_less_the_age_of_the_angle():
    speed = 0.05
    t = np.arange(1500) * PERIOD
    columns = record(speed * np.maximum(0.0, t - 0.01), *IDEAL)
    behind = columns['reference_position'] - columns['motor_position'] / 392.69908
    assert behind[1300:].mean() == pytest.approx(speed * (1.0 / 120.0 - 42e-6), rel=3e-3)


def test_the_table_loses_the_play_when_it_turns_round():
    lost = {}
    for play in (0.0, 15e-6):
        columns = record(sine(0.8), *IDEAL, f'nut.play={play}')
        apart = columns['motor_position'] / 392.69908 - columns['load_position']
        speed = np.gradient(columns['motor_position'], PERIOD)
        late = np.arange(len(speed)) > 300
        lost[play] = (apart[late & (speed > 12.0)].mean() - apart[late & (speed < -12.0)].mean())
    assert 0.0 < lost[0.0] < 6e-6
    assert lost[15e-6] - lost[0.0] == pytest.approx(15e-6, abs=1.5e-6)


def test_a_cutting_force_bends_the_table_away():
    force = np.where(np.arange(600) > 200, 500.0, 0.0)
    columns = record(np.zeros(600), *IDEAL, 'nut.play=0', external_torque=force)
    assert columns['external_torque'][-1] == pytest.approx(500.0, abs=1.0)
    assert -12e-6 < columns['load_position'][-1] - columns['load_position'][150] < -1e-6


def test_in_current_mode_the_current_is_what_is_wanted():
    columns = record(np.full(80, 3.0), 'drive.imperfection=0', 'sensors.noise=0', mode='current')
    # the back EMF grows all the while: the integral of the loop is that much behind
    rate = 2.0 / 3.0 * 1.0182 * 3.0 * 1.0182 / 0.0095  # V/s
    short = rate * 9.8e-3 / 11.5
    assert columns['current'][30:] == pytest.approx(3.0 - short, abs=0.06)
    assert (np.diff(columns['motor_position'][5:]) > 0.0).all()


def test_a_rig_that_is_off_stays_where_it_is():
    bench = Bench(load_rig(RIG, IDEAL))
    for _ in range(50):
        out = bench.answer(0.0, 0.0, 0.0)
        bench.advance()
    assert abs(out[1]) < 1e-7 and abs(out[4]) < 1e-6


SCALES = [item.path for item in PROPERTIES if item.unit == '' and item.default == 1.0
          and item.path != 'drive.current_loop']


@pytest.mark.parametrize('path', [*SCALES, 'screw.expansion', 'drive.latency', 'nut.loss',
                                  'drive.velocity_filter', 'load.lag'])
def test_a_fault_that_is_off_makes_another_recording(path):
    external = np.where(np.arange(250) > 100, 300.0, 0.0)
    plain, without = (record(sine(0.25), *turned, external_torque=external)
                      for turned in ((), (f'{path}=0',)))
    assert not np.array_equal(plain['load_position'], without['load_position'], equal_nan=True) \
        or not np.array_equal(plain['temperature'], without['temperature'])


def test_it_warms_up_and_the_screw_grows():
    columns = [record(np.full(30, 0.0), f'thermal.start={warm}', 'sensors.noise=0')
               for warm in (20.0, 45.0)]
    assert columns[1]['temperature'][0] == pytest.approx(45.0, abs=0.01)
    moved = [record(0.1 * np.clip(np.arange(1500) / 1000.0, 0.0, 1.0), *IDEAL[:2],
                    f'thermal.start={warm}', 'sensors.noise=0')['load_position'][-1]
             for warm in (20.0, 45.0)]
    assert moved[1] - moved[0] == pytest.approx(25.0 * 1.15e-5 * 0.1, rel=0.1)
