"""An elasticity of which one encoder alone tells: the other shaft swings beside it."""

from numba import njit
import numpy as np
from one_encoder import counted, head_of, servo_of
import pytest
from synthetic_recordings import run_of

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.mechanisms.builder import Builder
from servo_identify.diagnose.mechanisms.unseen_shaft import unseen_shaft
from servo_identify.diagnose.residuals.nuisance import nuisance_of
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained

ROTOR, LOAD, RATIO, CONSTANT, RUBS = 4e-5, 0.12, 50.0, 0.1, 0.5
PERIOD, FINE, NOISE = 2e-3, 100, 0.02
COUNTS = {'motor_position': 2.0 * np.pi / 16384, 'load_position': 2.0 * np.pi / 2**20}
SOFT, STIFF = 900.0, 4e5  # N m/rad: the load swings at 14 Hz, or not to be seen
FILE = head_of('joint', CONSTANT, (ROTOR, LOAD), RATIO, NOISE) + f"""
effects:
  rubs: {{effect: coulomb_friction, at: load, level: {RUBS}}}
  drag: {{effect: viscous_friction, at: motor, slope: 3e-4}}
tolerance:
  mechanism.load_inertia: 4 %
  effects.rubs.level: 10 %
"""


@njit
def turned(asked, added, stiffness, damping):
    """Integrate two bodies on a spring: angles of both shafts and the current, each row."""
    h = PERIOD / FINE
    motor = load = motor_speed = load_speed = 0.0
    rows = np.zeros((len(asked), 3))
    for k in range(len(asked)):
        current = 1.0 * (asked[k] - motor) - 0.05 * motor_speed + added[k]
        rows[k] = motor, load, current
        for _ in range(FINE):
            torque = stiffness * (motor / RATIO - load) + damping * (
                motor_speed / RATIO - load_speed)
            motor_speed += h * (CONSTANT * current - torque / RATIO - 3e-4 * motor_speed) / ROTOR
            load_speed += h * (torque - RUBS * np.tanh(load_speed / 0.005)) / LOAD
            motor += h * motor_speed
            load += h * load_speed
    return rows


def recorded(shaft, stiffness, damping, seconds=16.0, runs=2):
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    several = []
    for number in range(runs):
        chance = np.random.default_rng(number)
        asked, added = (np.minimum(time, 1.0) * size * sum(
            np.sin(2.0 * np.pi * tone * time + chance.uniform(0.0, 6.0)) / tone for tone in tones)
            for size, tones in ((RATIO * 0.3, (0.4, 0.9, 1.7)),
                                (6.0, (4.1, 7.3, 11.7, 16.3, 23.0))))
        *angles, current = turned(asked, added, stiffness, damping).T
        known = {shaft: counted(shaft, COUNTS, angles), 'voltage': current,
                 'current': current + NOISE * chance.standard_normal(len(time))}
        several.append(run_of(number, PERIOD, known, 'multisine'))
    return several


def servo(shaft, mechanism='rigid'):
    return servo_of(FILE, shaft, COUNTS, mechanism)


@pytest.mark.slow
@pytest.mark.parametrize('shaft', COUNTS)
@pytest.mark.parametrize('damping', [0.5, 2.0])
def test_its_stiffness_is_told_by_either_shaft(shaft, damping):
    samples = residual_samples(recorded(shaft, SOFT, damping, runs=1), servo(shaft))
    builder = Builder(samples, nuisance=nuisance_of(samples))
    one = unseen_shaft(builder, samples.base)
    column, left = one.columns.whole()[:, 0], samples.base
    compliance = -(column @ left) / (column @ column)
    assert 1.0 / compliance == pytest.approx(SOFT, rel=0.1)
    assert np.sum((left + compliance * column) ** 2) < 0.05 * np.sum(left**2)


@pytest.mark.slow
@pytest.mark.parametrize('shaft', COUNTS)
def test_a_stiff_transmission_is_given_none(shaft):
    found = explained(residual_samples(recorded(shaft, STIFF, 100.0), servo(shaft)))
    assert [one.mechanism.name for one in found.chosen] == []


def named(shaft, file):
    """Diagnose against a servo file; return the answer after the checks that all share."""
    found = diagnose(recorded(shaft, SOFT, 1.0, runs=3), file)
    known = [(one.effect, one.mechanism['site']) for one in found.report.which]
    assert known == [('stiffness_error', 'mesh')]
    assert found.augmented.numbers['mechanism.stiffness'] == pytest.approx(SOFT, rel=0.1)
    assert found.report.gap['shrink'] > 0.8
    return found


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('shaft', COUNTS)
def test_a_rigid_file_is_given_the_spring(shaft):
    found = named(shaft, servo(shaft))
    assert found.augmented.mechanism.compliant


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('stiffness', [0.5 * SOFT, 2.0 * SOFT])
@pytest.mark.parametrize('shaft', COUNTS)
def test_a_file_with_another_spring_is_given_the_right_one(shaft, stiffness):
    named(shaft, servo(shaft, f'two_inertia, stiffness: {stiffness}, damping: 1.0'))


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('shaft', COUNTS)
def test_a_file_with_the_right_spring_lacks_nothing(shaft):
    file = servo(shaft, f'two_inertia, stiffness: {SOFT}, damping: 1.0')
    found = explained(residual_samples(recorded(shaft, SOFT, 1.0), file))
    assert [one.mechanism.name for one in found.chosen] == []
