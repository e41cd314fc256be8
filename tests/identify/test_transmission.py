"""Backlash and transmission error learned from turns, on known truths."""

from pathlib import Path

import numpy as np
import pytest

from servo_identify.jobs.live.compare_job import judge
from servo_identify.learn.learned_effects import learn
from servo_identify.learn.transmission.backlash_map import learned_backlash, with_backlash
from servo_identify.learn.transmission.order_spectrum import (
    amplitudes,
    dominant,
    invariance,
    rebuilt,
)
from servo_identify.learn.transmission.transmission_harmonics import (
    ARCMIN,
    learned_error,
    with_error,
)
from servo_identify.learn.transmission.turn_passes import angles
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed, Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

BENCH = servo_file.load(Path(__file__).parents[2] / 'config/servos/rv_bench.yaml')
GAP = 3e-4
RIG = BENCH.with_effects(
    Placed('teeth', find('transmission_error'), 'mesh'), Placed('gap', find('backlash'), 'mesh'),
    values={'effects.teeth.order': 40.0, 'effects.teeth.cosine': (6e-5, 2e-5),
            'effects.teeth.sine': (0.0, 1e-5), 'effects.teeth.cosine_change': (1e-5, 0.0),
            'effects.teeth.sine_change': (0.0, 0.0), 'effects.gap.width': GAP})


def turns(speed: float, external: float = 0.0, seed: int = 0, servo: Servo = RIG) -> Recording:
    """Record one turn each way under the speed loop and a constant load."""
    rng = np.random.default_rng(seed)
    samples = int(2.0 * np.pi / speed * 1000) + 300
    columns = {name: np.full(2 * samples, np.nan) for name in COLUMNS}
    columns['reference_velocity'] = np.repeat([speed, -speed], samples)
    columns['external_torque'] = np.full(2 * samples, external)
    y = simulate(servo, inputs_of(columns), 1e-3, initial_state(servo, 0.0, 0.0), 'closed_loop')
    for i, name in enumerate(('motor_position', 'load_position', 'torque', 'current')):
        columns[name] = y[:, i] + servo.noise(name) * rng.standard_normal(2 * samples)
    columns['voltage'] = y[:, 4]
    return Recording(f'turns {speed} {external}', 1e-3, columns)


@pytest.fixture(scope='module')
def speeds():
    """Turns at three speeds."""
    return [turns(speed, seed=i) for i, speed in enumerate((0.8, 1.0, 1.3))]


def test_the_spectrum_gives_back_its_harmonics():
    at = angles(360)
    lost = 3e-5 * np.cos(4 * at) - 2e-5 * np.sin(11 * at)
    spectrum = amplitudes(lost)
    assert spectrum[4] == pytest.approx(3e-5, abs=1e-9)
    assert spectrum[11] == pytest.approx(-2e-5j, abs=1e-9)
    assert rebuilt(spectrum, [4, 11], 360) == pytest.approx(lost, abs=1e-12)


def test_the_number_of_orders_is_chosen_by_the_data():
    rng = np.random.default_rng(1)
    at = angles(360)
    passes = [5e-5 * np.cos(40 * at) + 1e-5 * np.sin(80 * at) + 1e-6 * rng.normal(size=360)
              for _ in range(4)]
    assert dominant(passes) == [40, 80]
    steady = invariance(passes, [40, 80, 7])
    assert steady[40] > 0.99 and steady[7] < 0.95


def test_it_finds_the_orders_of_the_rig(speeds):
    learned = learned_error(BENCH, speeds)
    assert set(learned.orders) == {40, 80}
    assert abs(learned.forward[learned.orders.index(40)]) == pytest.approx(6e-5, rel=0.05)
    assert abs(learned.reverse[learned.orders.index(40)]) == pytest.approx(7e-5, rel=0.05)
    assert min(learned.steadiness.values()) > 0.98
    assert max(s.mse for s in learned.scores) < 4e-3
    servo = with_error(BENCH, learned)
    assert servo.values['effects.teeth_error.order'] == 40.0
    assert servo_file.loads(servo_file.dumps(servo)) == servo
    assert 'orders repeat' in learned.sentences()[0]


def test_it_finds_the_gap_over_load():
    recordings = [turns(1.0, q, seed=i) for i, q in enumerate((0.0, 20.0, -20.0))]
    learned = learned_backlash(BENCH, recordings, cells=240, iterations=30)
    assert len(learned.loads) >= 2
    assert learned.gaps == pytest.approx(np.full(learned.gaps.shape, GAP), abs=0.1 * GAP)
    servo = with_backlash(BENCH, learned)
    assert servo_file.loads(servo_file.dumps(servo)) == servo
    assert float(learned.network([1.0], [learned.loads[0]])[0]) == pytest.approx(GAP, rel=0.1)
    assert learned.scores.mae < 0.02 * GAP / ARCMIN


def test_it_says_what_experiment_is_missing(speeds):
    with pytest.raises(ValueError, match='two loads at least'):
        learn('backlash', BENCH, speeds[:1])
    short = turns(1.0)
    columns = {name: column[:2000] for name, column in short.columns.items()}
    with pytest.raises(ValueError, match='whole turns'):
        learn('transmission_error', BENCH, [Recording('short', 1e-3, columns)])


@pytest.mark.long
@pytest.mark.slow
def test_a_twin_that_learned_the_teeth_is_judged_better_though_it_runs_elsewhere(speeds):
    crude = BENCH.with_effects(Placed('gap', find('backlash'), 'mesh'), values={
        'effects.gap.width': GAP, 'effects.viscous.slope': 24.0})
    judgement = judge(crude, with_error(crude, learned_error(BENCH, speeds)), speeds[1])
    before, after = judgement.balances['transmission']
    assert after < 0.5 * before and judgement.new < judgement.old


def test_what_differs_by_direction_is_told_once_gap_or_harmonics(speeds):
    loads = [turns(1.0, external, seed=7, servo=RIG) for external in (-40.0, 0.0, 40.0)]
    gap, error = learned_backlash(BENCH, loads), learned_error(BENCH, speeds)
    low = RIG.with_values({'effects.teeth.order': 2.0})
    for servo in (with_backlash(low, gap), with_error(with_backlash(BENCH, gap), error)):
        for placed in servo.effects:
            if placed.effect.name == 'transmission_error':
                path = f'effects.{placed.name}'
                low_orders = int(8 / servo.values[f'{path}.order'])
                assert not any(servo.values[f'{path}.cosine_change'][:low_orders])
    folded = with_backlash(low, gap).values['effects.teeth.cosine']
    assert folded == pytest.approx((6.5e-5, 2e-5))
    assert with_error(BENCH, error).values['effects.teeth_error.cosine_change'][0] != 0.0
