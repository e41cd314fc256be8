"""A kinematic error of the gear of which one encoder alone tells: the other shaft waves along."""

from numba import njit
import numpy as np
from one_encoder import counted, head_of, servo_of
import pytest
from synthetic_recordings import run_of

from servo_identify.diagnose.diagnose import diagnose

ROTOR, LOAD, RATIO, CONSTANT, RUBS, DRAG = 1.5e-3, 14.0, 60.0, 0.6, 0.15, 1.2e-3
STIFF, DAMPS = 2.4e5, 160.0
PERIOD, FINE, NOISE = 1e-3, 20, 0.03
ERROR = 170e-6  # rad, once a turn of the motor
FILE = head_of('turret', CONSTANT, (ROTOR, LOAD), RATIO, NOISE) + f"""
step: 5.0e-5
effects:
  rubs: {{effect: coulomb_friction, at: motor, level: {RUBS}}}
  drag: {{effect: viscous_friction, at: motor, slope: {DRAG}}}
tolerance: {{mechanism.load_inertia: 5 %, mechanism.rotor_inertia: 5 %}}
"""
COUNTS = {'motor_position': 2.0 * np.pi / 2**14, 'load_position': 2.0 * np.pi / 2**22}


@njit
def turned(goal, speeds, stiffness):
    """Integrate rotor and load on a spring behind an error of the gear: angles and current."""
    h = PERIOD / FINE
    motor = load = motor_speed = load_speed = 0.0
    rows = np.zeros((len(goal), 3))
    for k in range(len(goal)):
        current = 6.0 * (goal[k] - motor) + 0.3 * (speeds[k] - motor_speed)
        rows[k] = motor, load, current
        for _ in range(FINE):
            lost, slope = ERROR * np.cos(motor + 0.8), -ERROR * np.sin(motor + 0.8)
            torque = stiffness * (motor / RATIO - lost - load) + DAMPS * (
                motor_speed / RATIO - slope * motor_speed - load_speed)
            motor_speed += h / ROTOR * (
                CONSTANT * current - torque * (1.0 / RATIO - slope) - DRAG * motor_speed
                - RUBS * np.tanh(motor_speed / 0.05))
            load_speed += h / LOAD * torque
            motor += h * motor_speed
            load += h * load_speed
    return rows


def recorded(shaft, stiffness=STIFF, runs=3, seconds=16.0):
    """Return slow ramps and moves that reverse, by one encoder and the current."""
    time, several = np.arange(0.0, seconds, PERIOD), []
    for seed in range(1, runs + 1):
        chance = np.random.default_rng(seed)
        goal = RATIO * sum(size * np.sin(2.0 * np.pi * f * time + chance.uniform(0.0, 6.0))
                           for size, f in ((1.0, 0.07), (0.12, 0.31)))
        goal -= goal[0]
        *angles, current = turned(goal, np.gradient(goal, PERIOD) * (time > 0.5), stiffness).T
        several.append(run_of(seed, PERIOD, {
            shaft: counted(shaft, COUNTS, angles), 'voltage': current,
            'current': current + NOISE * chance.standard_normal(len(time))}, 'moves'))
    return several


def servo(shaft, mechanism):
    return servo_of(FILE, shaft, COUNTS, mechanism)


ELASTIC = f'two_inertia, stiffness: {STIFF}, damping: {DAMPS}'


def answered(shaft, mechanism):
    several = recorded(shaft, STIFF if mechanism == ELASTIC else 3e6)
    return diagnose(several[:1], servo(shaft, mechanism), several[1:2], several[2:])


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('mechanism', [ELASTIC, 'rigid'])
def test_the_encoder_of_the_load_tells_its_order_and_size(mechanism):
    answer = answered('load_position', mechanism)
    assert [one.effect for one in answer.report.which] == ['transmission_error']
    values = {path.rpartition('.')[2]: value for path, value in answer.augmented.values.items()
              if 'transmission_error' in path}
    assert values['order'] == RATIO
    assert np.hypot(values['cosine'][0], values['sine'][0]) == pytest.approx(ERROR, rel=0.05)
    assert answer.augmented.mechanism.compliant


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('mechanism', [ELASTIC, 'rigid'])
def test_that_of_the_motor_may_itself_be_off_by_such_a_wave(mechanism):
    first, *others = answered('motor_position', mechanism).report.which
    assert {first.effect, *(one.effect for one in first.alternatives)} == {
        'transmission_error', 'motor_encoder_eccentricity'}
    assert not others
