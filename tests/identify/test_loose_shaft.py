"""A clearance of which one encoder alone tells: the other shaft is loose in the gap."""

from numba import njit
import numpy as np
import pytest
from synthetic_recordings import run_of

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.mechanisms.builder import Builder
from servo_identify.diagnose.mechanisms.loose_shaft import loose_shaft
from servo_identify.diagnose.residuals.nuisance import nuisance_of
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained
from servo_twin.description import servo_file

ROTOR, LOAD, RATIO, CONSTANT, RUBS = 2e-5, 0.1, 50.0, 0.1, 0.6
PERIOD, FINE, COUNTS, NOISE = 2e-3, 100, 16384, 0.01
FINEST = 2.0 * np.pi / 2**20  # count of the load's encoder
STIFFNESS, DAMPING = 16000.0, 8.0
TWO = f'{{type: two_inertia, stiffness: {STIFFNESS}, damping: {DAMPING}, '
FILE = f"""
servo: joint
drive: {{type: current, gain: 1.0, torque_constant: {CONSTANT}}}
mechanism: SHAFTS rotor_inertia: {ROTOR}, load_inertia: {LOAD}, ratio: {RATIO}}}
sensors:
  ENCODER
  current_sensor: {{noise: {NOISE}}}
effects:
  rubs: {{effect: coulomb_friction, at: load, level: {RUBS}}}
"""
ENCODERS = {
    'motor': f'motor_encoder: {{noise: {2.0 * np.pi / COUNTS / np.sqrt(12.0)}}}',
    'load': f'load_encoder: {{noise: {FINEST / np.sqrt(12.0)}}}'}
FILES = {'rigid': '{type: rigid, ', 'two_inertia': TWO}


@njit
def turned(asked, gap, weight):
    """Integrate two bodies and the teeth between them: the motor's counts and the current."""
    h, count = PERIOD / FINE, 2.0 * np.pi / COUNTS
    motor = load = motor_speed = load_speed = 0.0
    rows = np.zeros((len(asked), 3))
    for k in range(len(asked)):
        seen = np.floor(motor / count + 0.5) * count
        current = 1.2 * (asked[k] - seen) - 0.035 * motor_speed
        rows[k] = seen, np.floor(load / FINEST + 0.5) * FINEST, current
        for _ in range(FINE):
            twist = motor / RATIO - load
            over = twist - min(max(twist, -0.5 * gap), 0.5 * gap)
            torque = 0.0
            if over != 0.0 or gap == 0.0:
                torque = STIFFNESS * over + DAMPING * (motor_speed / RATIO - load_speed)
                if gap > 0.0 and torque * over < 0.0:
                    torque = 0.0
            motor_speed += h * (CONSTANT * current - torque / RATIO) / ROTOR
            load_speed += h * (torque - RUBS * np.tanh(load_speed / 0.005)
                               - weight * np.sin(load)) / LOAD
            motor += h * motor_speed
            load += h * load_speed
    return rows


def recorded(gap, seconds=16.0, runs=2, weight=0.0, shaft='motor'):
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    several = []
    for number in range(runs):
        chance = np.random.default_rng(number)
        asked = RATIO * np.minimum(time, 1.0) * sum(
            0.2 / tone * np.sin(2.0 * np.pi * tone * time + chance.uniform(0.0, 6.0))
            for tone in (0.4, 0.9, 1.7, 3.1))
        motor, load, current = turned(asked, gap, weight).T
        known = {f'{shaft}_position': motor if shaft == 'motor' else load, 'voltage': current,
                 'current': current + NOISE * chance.standard_normal(len(time))}
        several.append(run_of(number, PERIOD, known, 'multisine'))
    return several


def servo(shafts='rigid', shaft='motor'):
    return servo_file.loads(FILE.replace('SHAFTS', FILES[shafts]).replace(
        'ENCODER', ENCODERS[shaft]))


@pytest.mark.slow
@pytest.mark.parametrize('shaft', ENCODERS)
@pytest.mark.parametrize('gap', [0.003, 0.012])
def test_the_width_is_told_by_when_the_other_flank_is_met(gap, shaft):
    samples = residual_samples(recorded(gap, runs=1, shaft=shaft), servo(shaft=shaft))
    builder = Builder(samples, nuisance=nuisance_of(samples))
    one = loose_shaft(builder, samples.base)
    column, left = (builder.apart(x) for x in (one.columns.whole()[:, 0], samples.base))
    width = -(column @ left) / (column @ column)
    assert width == pytest.approx(gap, rel=0.2)
    assert np.sum((left + width * column) ** 2) < 0.4 * np.sum(left**2)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('shaft', ENCODERS)
def test_a_transmission_without_a_gap_is_given_none(shaft):
    found = explained(residual_samples(recorded(0.0, shaft=shaft), servo('two_inertia', shaft)))
    assert [one.mechanism.name for one in found.chosen] == []


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('shaft', ENCODERS)
@pytest.mark.parametrize('shafts', FILES)
def test_it_is_named_and_handed_over_with_the_teeth_that_meet(shafts, shaft):
    several = recorded(0.006, runs=3, shaft=shaft)
    answer = diagnose(several[:1], servo(shafts, shaft), several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['backlash']
    numbers = answer.augmented.numbers
    assert numbers['effects.backlash.width'] == pytest.approx(0.006, rel=0.2)
    if shafts == 'two_inertia':
        assert numbers['mechanism.stiffness'] == STIFFNESS
    elif shaft == 'motor':  # the load hardly tells how stiff the teeth are that the motor meets
        assert numbers['mechanism.stiffness'] == pytest.approx(STIFFNESS, rel=0.5)
    assert answer.report.gap['solved'] > 0.5


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('shaft', ENCODERS)
def test_it_is_told_beside_a_weight_that_the_file_does_not_have(shaft):
    several = recorded(0.006, runs=3, weight=1.2, shaft=shaft)
    answer = diagnose(several[:1], servo('two_inertia', shaft), several[1:2], several[2:])
    assert {one.effect for one in answer.report.which} == {'backlash', 'gravity'}
    numbers = answer.augmented.numbers
    assert numbers['effects.backlash.width'] == pytest.approx(0.006, rel=0.2)
    assert numbers['effects.gravity.sine'] == pytest.approx(-1.2, rel=0.15)
    assert answer.report.gap['solved'] > 0.6
