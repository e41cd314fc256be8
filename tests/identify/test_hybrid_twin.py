"""The parts of the hybrid twin, on machines made of the twin's own laws, whose truth is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_recordings import sampled

from servo_identify.cli import main
from servo_identify.learn.current_loop import learned_current_loop, with_current_loop
from servo_identify.learn.error_scores import Scores
from servo_identify.learn.free_run import free_run, free_runs, refined
from servo_identify.learn.friction.friction_network import Network
from servo_identify.learn.friction.friction_samples import friction_of
from servo_identify.learn.friction.load_share import load_share, with_load_share
from servo_identify.learn.friction.presliding import (
    learned_presliding,
    least_level,
    Presliding,
    with_presliding,
    without_presliding,
)
from servo_identify.learn.friction.resampling import AngleTable, equal_angles
from servo_identify.learn.friction.servo_friction import LearnedFriction, with_friction
from servo_identify.learn.learned_effects import learn
from servo_identify.learn.networks.residual_network import (
    learned_residual,
    with_residual,
    without_residual,
)
from servo_twin.bag import write_recording
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

BENCH = servo_file.load(Path(__file__).parents[2] / 'config/servos/rv_bench.yaml')
TIME = np.arange(6000) * 1e-3
SWAY = 1.7 * np.sin(2.0 * np.pi * 0.8 * TIME)
LOOP = {'effects.back_emf_droop.droop': 8e-5, 'effects.back_emf_droop.electrical': 4e-3,
        'effects.back_emf_droop.closed': 5e-4}


def turns(servo, speed: float, external: float, seed: int = 0) -> Recording:
    """Record half a turn each way under a load that resists."""
    rng = np.random.default_rng(seed)
    samples = int(np.pi / speed * 1000) + 300
    columns = {name: np.full(2 * samples, np.nan) for name in COLUMNS}
    columns['reference_velocity'] = np.repeat([speed, -speed], samples)
    columns['external_torque'] = np.repeat([external, -external], samples)
    y = simulate(servo, inputs_of(columns), 1e-3, initial_state(servo, 0.0, 0.0), 'closed_loop')
    for i, name in enumerate(('motor_position', 'load_position', 'torque', 'current')):
        columns[name] = y[:, i] + servo.noise(name) * rng.standard_normal(2 * samples)
    columns['voltage'] = y[:, 4]
    return Recording(f'turns {speed} {external}', 1e-3, columns)


def flat(level: float) -> LearnedFriction:
    """Networks that resist with one level at any angle and speed."""
    still = Network(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), -level,
                    np.array([np.pi, 0.5]), np.array([np.pi, 0.5]))
    empty = np.array([])
    table = AngleTable(2.0 * np.pi, empty, empty, empty, empty, empty > 0.0)
    scores = Scores(0.0, 0.0, 0.0, 0.0, 1.0)
    return LearnedFriction('load', still, still, table, empty > 0.0, scores, scores, ())


@pytest.fixture(scope='module')
def swaying():
    """The bench with a slow current loop, thrown to and fro in open loop."""
    return sampled(with_current_loop(BENCH, None).with_values(LOOP), 1.6 * np.sign(SWAY))


@pytest.mark.long
def test_the_current_loop_is_found_from_its_current(swaying):
    found = learned_current_loop(BENCH, [swaying])
    droop, *lags = (found.values[path] for path in LOOP)
    assert droop == pytest.approx(8e-5, rel=0.02)
    assert sum(lags) == pytest.approx(4.5e-3, rel=0.1)  # of two lags in a row the sum shows
    assert all(0.0 < found.std[path] < 0.1 * found.values[path] for path in LOOP)
    assert found.values['drive.gain'] == pytest.approx(0.49, rel=1e-3)
    assert found.rms < 1.2 * BENCH.noise('current') < found.rms_without
    servo = with_current_loop(BENCH, found)
    assert servo_file.loads(servo_file.dumps(servo)) == servo
    assert [p.name for p in with_current_loop(servo, found).effects] == [
        p.name for p in servo.effects]


def test_the_current_loop_asks_for_what_it_needs(swaying):
    bare = replace(swaying, columns={**swaying.columns, 'current': np.full(6000, np.nan)})
    with pytest.raises(ValueError, match='current is missing'):
        learned_current_loop(BENCH, [bare])
    geared = servo_file.load(Path(__file__).parents[2] / 'config/servos/geared_dc.yaml')
    with pytest.raises(ValueError, match='voltage_drive'):
        learned_current_loop(geared, [swaying])


def test_the_share_of_the_load_is_found_and_taken_off():
    rig = BENCH.with_effects(Placed('loaded', find('load_dependent_friction'), 'load'),
                             values={'effects.loaded.share': 0.08})
    table = equal_angles(friction_of(BENCH, [turns(rig, 0.9, t, k) for k, t in enumerate(
        (0.0, 40.0))]), 40)
    found = load_share(table)
    assert found.share == pytest.approx(0.08, abs=0.004)
    assert 0.0 < found.share_std < 0.01 and np.isnan(found.back_driven_std)
    rest = found.taken_off(table)
    assert rest.torque == pytest.approx(22.0 + 30.0 * table.speed, abs=0.6)
    servo = with_load_share(with_load_share(BENCH, found), found)
    assert [p.name for p in servo.effects].count('loaded') == 1
    assert servo.provenance['effects.loaded.share'].std == found.share_std


def test_no_share_is_found_where_loads_do_not_differ():
    table = equal_angles(friction_of(BENCH, [turns(BENCH, speed, 0.0) for speed in (0.8, 1.2)]),
                         40)
    assert load_share(table) is None


@pytest.mark.long
@pytest.mark.slow
def test_presliding_is_found_from_free_runs():
    learned = with_friction(BENCH, flat(20.0))
    assert least_level(learned, 'friction') == pytest.approx(20.0)
    truth = Presliding(12.0, 1.5e-4, 0.0, 0.0, ())
    rig = with_presliding(learned, truth)
    assert without_presliding(rig).values == learned.values
    runs = [sampled(rig, scale * SWAY, seed=k) for k, scale in enumerate((0.8, 1.0))]
    found = learned_presliding(learned, runs)
    assert found.after > found.before and found.after > 0.99
    # level and travel trade: the stiffness of the bristles is what shows
    assert found.level / found.breakaway == pytest.approx(12.0 / 1.5e-4, rel=0.3)
    with pytest.raises(ValueError, match='learned friction'):
        learned_presliding(BENCH, runs)


@pytest.mark.long
def test_a_residual_network_adds_what_is_missing():
    rig = BENCH.with_values({'effects.viscous.slope': 60.0})
    run, other = (sampled(rig, scale * SWAY, seed=k) for k, scale in enumerate((1.0, 0.9)))
    learned = learned_residual(BENCH, [run])
    assert learned.network.weight.shape == (10,) and learned.scores.r2 > 0.7
    black = with_residual(BENCH, learned)
    assert servo_file.loads(servo_file.dumps(black)) == black
    assert without_residual(black) == BENCH
    assert free_run(black, other).speed_fit > free_run(BENCH, other).speed_fit + 0.05
    effect = find('network_residual')
    p = type('P', (), {n: (np.array(v) if isinstance(
        v := black.values[f'effects.residual.{n}'], tuple) else v) for n in effect.parameters})
    motion = type('M', (), {'current': 0.3, 'speed': -0.2})
    assert effect.law(p, np.zeros(1), motion, 1e-4) == pytest.approx(
        float(learned.network([0.3], [-0.2])[0]), abs=1e-9)


def test_refining_makes_free_runs_fit():
    rig = BENCH.with_values({'effects.viscous.slope': 45.0, 'effects.coulomb.level': 18.0})
    runs = [sampled(rig, SWAY)]
    free = ('effects.viscous.slope', 'effects.coulomb.level')
    narrow = replace(BENCH, tolerance={free[0]: (20.0, 40.0)})
    servo, mean = refined(narrow, runs, free)
    assert not servo.tolerance and servo_file.loads(servo_file.dumps(servo)) == servo
    assert mean > 0.995 and mean == pytest.approx(free_runs(servo, runs)[0].speed_fit)
    assert [servo.values[p] for p in free] == pytest.approx([45.0, 18.0], rel=0.03)


def test_the_fit_command_learns_a_current_loop_and_a_residual(swaying, tmp_path):
    write_recording(tmp_path / 'bag', swaying)
    for what, effect in (('current_loop', 'back_emf_droop'), ('residual', 'network_residual')):
        out = tmp_path / f'{what}.yaml'
        assert main(['fit', str(tmp_path / 'bag'), '--servo', 'config/servos/rv_bench.yaml', '-o',
                     str(out), '--learn', what]) == 0
        assert effect in {p.effect.name for p in servo_file.load(out).effects}


def test_learning_says_what_was_found_and_how_far_it_is(swaying):
    shares = []
    _, said = learn('current_loop', BENCH, [swaying], lambda share, loss: shares.append(share))
    assert shares[-1] == 1.0 and 'current that is left' in said[0]
    servo = with_friction(BENCH, flat(20.0))
    _, said = learn('presliding', servo, [swaying], lambda share, loss: shares.append(share))
    assert 'presliding friction' in said[0] and max(shares) <= 1.0
