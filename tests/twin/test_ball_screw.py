"""The ball screw and what acts on it, against hand calculation and SciPy."""

from __future__ import annotations

from collections import namedtuple
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.mechanisms.ball_screw import BallScrew, compliance, reach
from servo_twin.physics.servo import Placed, ServoError
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS, LOAD_ANGLE

FILE = Path(__file__).parents[2] / 'config' / 'servos' / 'feed_drive.yaml'
FEED = servo_file.load(FILE)
PERIOD = 1e-3


def inputs(samples: int, **columns) -> np.ndarray:
    filled = {name: np.full(samples, np.nan) for name in INPUTS}
    return inputs_of({**filled, **{k: np.asarray(v, float) for k, v in columns.items()}})


def values(**changes):
    v = {n: FEED.values[f'mechanism.{n}'] for n in BallScrew.parameters}
    return namedtuple('Screw', v)(**{**v, **changes})


# --- stiffness


@pytest.mark.parametrize('table, screw', [(0.0, 9.3387e8), (0.3, 1.68096e9), (-0.2, 1.16375e9)])
def test_the_screw_is_as_stiff_along_as_by_hand(table, screw):
    """E A L / (x (L - x)), eq. 6: 2.06e11 x 1.02e-3 x 0.9 = 1.89108e8 N m over 0.2025 m2 ..."""
    p = values()
    nut = 0.8 * 1.1e9 * 0.7 ** (1 / 3)  # preload 2800 N of a tenth of 40 kN: eq. 7
    assert nut == pytest.approx(7.8134e8, rel=1e-4)
    expected = 1.0 / screw + 1.0 / nut + 1.0 / 1.6e9  # eq. 5
    along = (compliance(p, table) - 1.07955e-4) / (0.95 * 392.69908**2)  # less eq. 4
    assert along == pytest.approx(expected, rel=1e-4)


def test_torsion_and_tension_add_up_seen_from_the_motor():
    """Equations 3 and 4 at the middle, in numbers: 1/K_Z 2.97567e-9 m/N, 1/K_T 1.07955e-4."""
    p = values()
    along = 0.95 * 392.69908**2 * (1 / 9.3387e8 + 1 / 7.8134e8 + 1 / 1.6e9)
    assert compliance(p, 0.0) == pytest.approx(along + 1.07955e-4, rel=1e-4)
    assert 1.0 / compliance(p, 0.0) == pytest.approx(1840.0, rel=0.01)


def test_a_nut_that_would_leave_the_screw_stays_at_its_end():
    assert reach(values(), 5.0) == reach(values(), 0.405) == pytest.approx(0.855 * 0.045)


def test_a_force_winds_the_screw_up_by_what_equation_11_says():
    """Table pushed at rest by 800 N against a motor that a heavy rotor holds."""
    servo = still(FEED, **{'mechanism.rotor_inertia': 1e3, 'mechanism.screw_inertia': 2e-3,
                           'mechanism.damping': 4e6, 'mechanism.twist_damping': 5.0})
    x = initial_state(servo)
    y = simulate(servo, inputs(400, external_torque=np.full(400, 800.0)), PERIOD, x)
    p = values()
    torque = 800.0 / (0.95 * p.ratio)  # at the nut, eq. 12
    twist = torque * compliance(p, 0.0)  # eq. 2
    # the flanks, and S' of eq. 11 as an angle
    more = torque * 392.69908**2 / 6.2e8 + torque * compliance(p, 0.0)
    wound = y[-1, 1] - y[-1, 0] / p.ratio
    assert wound == pytest.approx(-(twist + more) / p.ratio, rel=1e-3)


# --- motion


def still(servo, **changes):
    """Return the servo without friction and play, with some values changed."""
    off = {f'effects.{p.name}.{a}': 0.0 for p in servo.effects for a in p.effect.amplitudes()}
    return servo.with_values({**off, **changes})


def by_scipy(p, play, current, constant, seconds):
    """Integrate eq. 1 to 13 as the paper writes them, at a tolerance of 1e-9."""
    inertia = p.coupling_inertia + p.screw_inertia

    def slope(t, state):
        motor, motor_speed, screw, screw_speed, table, table_speed = state
        k = t / PERIOD
        torque = constant * np.interp(k, np.arange(len(current)), current)
        place = p.nut_place + table
        along = 1.0 / (p.modulus * p.section * p.span / (place * (p.span - place)))
        along += 1.0 / (0.8 * p.nut_stiffness * (p.preload / (0.1 * p.preload_rating)) ** (1 / 3))
        along += 1.0 / (p.bearing_stiffness + p.far_bearing_stiffness)
        twist = 1.0 / p.coupling_stiffness + 1.0 / p.screw_stiffness
        combined = 1.0 / (p.ratio**2 * p.efficiency * along + twist)
        carried = combined * (motor - screw)
        free = screw - p.ratio * table
        left = free - np.clip(free, -0.5 * play * p.ratio, 0.5 * play * p.ratio)
        nut = 0.0
        if left != 0.0:  # eq. 9 to 12, solved for the torque: S' is in proportion to it
            nut = p.stiffness / p.ratio**2 * left
            nut += p.damping / p.ratio**2 * (screw_speed - p.ratio * table_speed)
            bend = (along + twist / (p.ratio**2 * p.efficiency)) * p.efficiency * p.ratio
            nut /= 1.0 + p.stiffness / p.ratio * bend
        return [motor_speed, (torque - carried - p.twist_damping * (motor_speed - screw_speed)
                              ) / p.rotor_inertia,
                screw_speed, (carried + p.twist_damping * (motor_speed - screw_speed)
                              - p.screw_damping * screw_speed - nut) / inertia,
                table_speed, p.efficiency * p.ratio * nut / p.load_inertia]

    at = np.arange(round(seconds / PERIOD)) * PERIOD
    return solve_ivp(slope, (0.0, at[-1]), np.zeros(6), 'LSODA', at, rtol=1e-9, atol=1e-12,
                     max_step=2e-4).y


@pytest.mark.parametrize('play', [0.0, 17e-6])
def test_the_screw_moves_as_scipy_says(play):
    samples = 300
    t = np.arange(samples) * PERIOD
    current = 3.0 * np.sin(60.0 * t) + np.cos(200.0 * t)
    servo = still(FEED, **{'effects.play.width': play})
    exact = by_scipy(values(), play, current, FEED.values['drive.torque_constant'], t[-1] + PERIOD)
    u = inputs(samples, current=current)
    y = simulate(servo, u, 31.25e-6 * 32, initial_state(servo), 'forced_current')
    assert np.abs(y[:, 0] - exact[0]).max() < 1e-2 * np.ptp(exact[0])
    assert np.abs(y[:, 1] - exact[4]).max() < 1e-2 * np.ptp(exact[4])
    lag, expected = y[:, 1] - y[:, 0] / 392.69908, exact[4] - exact[0] / 392.69908
    assert np.abs(lag - expected).max() < 0.06 * np.ptp(expected)


def test_a_ramp_is_followed_at_the_distance_that_the_position_gain_leaves():
    speed, samples = 0.05, 1500
    reference = speed * np.arange(samples) * PERIOD
    y = simulate(FEED, inputs(samples, reference_position=reference), PERIOD, initial_state(FEED),
                 'closed_loop')
    behind = reference - y[:, 0] / 392.69908
    # the motor is sampled and its speed held: half a millisecond of way more
    assert behind[1300:].mean() == pytest.approx(speed / 120.0, rel=2e-3)
    play = y[:, 0] / 392.69908 - y[:, 1]
    assert 8.5e-6 < play[1300:].mean() < 14e-6  # half the backlash, and what the friction bends


def test_switching_the_inverter_moves_the_table_by_less_than_a_nanometre():
    reference = 0.002 * np.sin(8.0 * np.arange(120) * PERIOD)
    both = [simulate(FEED.with_values({'drive.switching': s}),
                     inputs(120, reference_position=reference), PERIOD, initial_state(FEED),
                     'closed_loop') for s in (0.0, 1.0)]
    assert 0.0 < np.abs(both[0][:, 1] - both[1][:, 1]).max() < 1e-9


# --- effects


def test_the_ways_resist_as_equation_14_says():
    ways = find('slideway_friction')
    p = SimpleNamespace(coefficient=0.01, weight=2000.0, pressing=500.0, slope=600.0, excess=40.0,
                        decay=100.0)
    for speed in (0.02, -0.02):
        motion = SimpleNamespace(speed=speed)
        # 0.01 x 2500 + 600 x 0.02 + 40 exp(-2)
        assert ways.law(p, (), motion, 1e-4) == pytest.approx(25.0 + 12.0 + 5.41341, rel=1e-6)


@pytest.mark.long
def test_a_parallel_network_adds_to_the_analytical_position_and_to_nothing_else():
    rows = {'wanted': (2.0, -1.0, 0.3), 'behind': (0.5, 3.0, -2.0), 'threshold': (0.1, -0.4, 0.0),
            'weight': (4e-6, -3e-6, 5e-6)}
    plain = {'wanted_centre': 0.001, 'wanted_span': 0.05, 'behind_centre': 1e-5,
             'behind_span': 4e-4, 'level': 1e-6}
    lacks = Placed('lacks', find('network_deviation'), 'load_position')
    hybrid = FEED.with_effects(lacks, values={
        f'effects.lacks.{k}': v for k, v in {**rows, **plain}.items()})
    reference = 0.03 * np.sin(6.0 * np.arange(400) * PERIOD)
    u = inputs(400, reference_position=reference)
    alone, both = (simulate(s, u, PERIOD, initial_state(s), 'closed_loop') for s in (FEED, hybrid))
    assert np.array_equal(np.delete(alone, 1, axis=1), np.delete(both, 1, axis=1))
    x1 = (reference - 0.001) / 0.05
    x2 = (alone[:, 1] - reference - 1e-5) / 4e-4
    inside = np.outer(x1, rows['wanted']) + np.outer(x2, rows['behind']) - rows['threshold']
    expected = (1.0 / (1.0 + np.exp(-inside))) @ rows['weight'] - 1e-6
    np.testing.assert_allclose(both[:, 1] - alone[:, 1], expected, rtol=1e-9, atol=1e-15)


# --- the file


def test_the_motor_turns_and_the_table_slides():
    assert FEED.unit('sensors.motor_encoder.noise') == 'rad'
    assert FEED.unit('sensors.load_encoder.noise') == 'm'
    assert FEED.unit('effects.ways.slope') == 'N s/m'
    assert FEED.unit('effects.drag.level') == 'N m'
    assert FEED.unit('mechanism.load_inertia') == 'kg'
    assert FEED.straight('load_position') and not FEED.straight('motor_speed')
    assert servo_file.loads(servo_file.dumps(FEED)) == FEED


def test_a_screw_without_a_length_is_refused():
    with pytest.raises(ServoError, match=r'mechanism.span = 0 m is outside'):
        FEED.with_values({'mechanism.span': 0.0})


def test_a_table_at_rest_stays_where_it_is():
    x = initial_state(FEED, load=0.05)
    y = simulate(FEED, inputs(200, reference_position=np.full(200, 0.05)), PERIOD, x,
                 'closed_loop')
    assert (y[:, 1] == 0.05).all() and x[LOAD_ANGLE] == 0.05
