"""Friction learned: balance, resampling, network, learners, export, on known truths."""

import json
from pathlib import Path
import subprocess
import sys

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.learn.error_scores import goodness_of_fit, scores_of
from servo_identify.learn.friction import learners
from servo_identify.learn.friction.friction_dataset import dataset_of, SEQUENCE
from servo_identify.learn.friction.friction_network import trained
from servo_identify.learn.friction.friction_samples import differences, friction_of
from servo_identify.learn.friction.learner_comparison import compared, markdown
from servo_identify.learn.friction.learners import learner, names
from servo_identify.learn.friction.resampling import equal_angles
from servo_identify.learn.friction.servo_friction import (
    learned_friction,
    with_friction,
    with_motor_friction,
)
from servo_twin.bag import write_recording
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

BENCH = servo_file.load(Path(__file__).parents[2] / 'config/servos/rv_bench.yaml')
WAVY = BENCH.with_effects(
    Placed('wave', find('position_dependent_friction'), 'load'),
    Placed('skewed', find('asymmetric_friction'), 'load'),
    Placed('rotor', find('coulomb_friction'), 'motor'),
    values={'effects.wave.cosine': (2.0,), 'effects.skewed.difference': 1.0,
            'effects.skewed.slope': 0.0,
            'effects.rotor.level': 0.03})


def truth(angle, speed, forward):
    """Return what WAVY resists with at the load, N m."""
    return 22.0 + 30.0 * speed + 2.0 * np.cos(angle) + np.where(forward, 1.0, -1.0)


def turns(speed: float, seed: int = 0) -> Recording:
    """Record one turn each way under the speed loop."""
    rng = np.random.default_rng(seed)
    samples = int(2.0 * np.pi / speed * 1000) + 300
    columns = {name: np.full(2 * samples, np.nan) for name in COLUMNS}
    columns['reference_velocity'] = np.repeat([speed, -speed], samples)
    y = simulate(WAVY, inputs_of(columns), 1e-3, initial_state(WAVY, 0.0, 0.0), 'closed_loop')
    for i, name in enumerate(('motor_position', 'load_position', 'torque', 'current')):
        columns[name] = y[:, i] + WAVY.noise(name) * rng.standard_normal(2 * samples)
    columns['voltage'] = y[:, 4]
    return Recording(f'turns {speed}', 1e-3, columns, digest='0' * 64)


@pytest.fixture(scope='module')
def ladder():
    """Turns at three speeds."""
    return [turns(speed) for speed in (0.6, 0.9, 1.3)]


@pytest.fixture(scope='module')
def learned(ladder):
    """The networks of paper 000, of the ladder."""
    return learned_friction(BENCH, ladder, cells=90)


def test_the_balance_gives_the_friction_that_was_there(ladder):
    samples = friction_of(BENCH, ladder)
    steady = np.abs(samples.acceleration) < 0.05
    expected = np.sign(samples.speed) * truth(samples.angle, np.abs(samples.speed),
                                              samples.speed > 0.0)
    off = (samples.torque - expected)[steady & (np.abs(samples.speed) > 0.3)]
    assert np.sqrt(np.mean(off**2)) < 0.3


def test_the_balance_takes_off_gravity():
    heavy = BENCH.with_effects(Placed('arm', find('gravity'), 'load'),
                               values={'effects.arm.cosine': 0.0, 'effects.arm.sine': -5.0})
    samples = friction_of(heavy, [turns(0.9)])
    plain = friction_of(BENCH, [turns(0.9)])
    assert samples.torque - plain.torque == pytest.approx(-5.0 * np.sin(plain.angle), abs=1e-9)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_the_differences_are_exact_for_parabolas(a, b, c):
    t = np.arange(20) * 0.01
    speed, acceleration = differences(a + b * t + c * t**2, 0.01)
    assert speed[1:-1] == pytest.approx((b + 2.0 * c * t)[1:-1], abs=1e-9)
    assert acceleration[1:-1] == pytest.approx(np.full(18, 2.0 * c), abs=1e-7)


def test_the_table_has_equal_angles_and_both_directions(ladder):
    table = equal_angles(friction_of(BENCH, ladder), 120)
    width = 2.0 * np.pi / 120
    cell = table.angle / width - 0.5
    assert cell == pytest.approx(np.round(cell), abs=1e-9)
    assert table.forward.any() and not table.forward.all()
    assert (table.speed > 0.0).all()


def test_a_turn_there_and_back_is_split_in_each_direction(ladder):
    data = dataset_of(friction_of(BENCH, ladder))
    for part in (data.train, data.validation, data.test):
        forward = (data.features[part, 0] > 0.0).mean()
        assert 0.4 < forward < 0.6
    assert not set(data.train) & set(data.validation) | set(data.validation) & set(data.test)


def test_the_network_learns_a_surface():
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0.0, 6.28, 600), rng.uniform(0.1, 1.0, 600)
    z = 20.0 + 3.0 * np.sin(x) + 8.0 * y + np.exp(-y / 0.2)
    held = np.arange(600) % 5 == 0
    network = trained(x, y, z, held=held, iterations=40)
    assert scores_of(z[held], network(x[held], y[held])).r2 > 0.999
    assert network.size == 121
    again = trained(x, y, z, held=held, iterations=40)
    assert np.array_equal(network.weight, again.weight)


def test_the_network_refuses_fewer_rows_than_weights():
    with pytest.raises(ValueError, match='121 weights'):
        trained(np.arange(50.0), np.arange(50.0), np.arange(50.0))


def test_learned_friction_is_close_to_the_truth(learned):
    for forward, network in ((True, learned.forward), (False, learned.reverse)):
        angle = np.linspace(0.3, 6.0, 50)
        for speed in (0.7, 0.9, 1.2):
            assert network(angle, np.full(50, speed)) == pytest.approx(
                truth(angle, speed, forward), abs=0.5)
    assert learned.forward_scores.mape < 0.5 and learned.reverse_scores.mape < 0.5


def test_the_exported_effect_gives_what_the_networks_give(learned):
    servo = with_friction(BENCH, learned)
    assert servo_file.loads(servo_file.dumps(servo)) == servo
    assert [p.name for p in servo.effects] == ['friction']
    effect = find('network_friction')
    p = type('P', (), {n: (np.array(v) if isinstance(
        v := servo.values[f'effects.friction.{n}'], tuple) else v) for n in effect.parameters})
    for angle, speed, way in ((1.0, 0.5, 1.0), (4.0, 1.1, -1.0)):
        motion = type('M', (), {'angle': angle, 'speed': way * speed, 'direction': way})
        network = learned.forward if way > 0.0 else learned.reverse
        assert effect.law(p, np.zeros(effect.memory), motion, 1e-4) == pytest.approx(
            float(network([angle], [speed])[0]), abs=1e-9)


def test_motor_friction_comes_from_the_motor_balance(ladder):
    servo, sentence = with_motor_friction(BENCH, ladder)
    assert servo.values['effects.motor_coulomb.level'] == pytest.approx(0.03, abs=0.003)
    assert 'friction at the motor' in sentence


def test_the_parts_of_a_dataset_do_not_share_samples(ladder):
    data = dataset_of(friction_of(BENCH, ladder))
    seen = [set((rows[:, None] + np.arange(1 - SEQUENCE, 1)).ravel().tolist())
            for rows in (data.train, data.validation, data.test)]
    assert not seen[0] & seen[1] and not seen[1] & seen[2] and not seen[0] & seen[2]
    assert np.abs(data.features[data.beyond, 0]).min() > np.abs(
        data.features[data.train, 0]).max()


def test_every_learner_is_there():
    assert len(names()) == 10
    with pytest.raises(ValueError, match="no learner 'forest'"):
        learner('forest')


def test_a_learner_whose_library_is_missing_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr(learners, 'find_spec', lambda name: None)
    assert learners.lacking('lugre') == '' and learners.lacking('lstm') == 'torch'
    with pytest.raises(ValueError, match="'lstm' needs torch.*make training"):
        learner('lstm')


def test_simple_learners_are_compared_on_one_table(ladder):
    data = dataset_of(friction_of(BENCH, ladder))
    rows, _ = compared(data, ['coulomb_viscous', 'stribeck', 'dahl', 'lugre', 'sindy'])
    by_name = {row.name: row for row in rows}
    assert by_name['coulomb_viscous'].test.mae < 3.0
    assert all(row.beyond is not None and row.sentence for row in rows)
    assert markdown(rows).count('\n') == 7


@pytest.mark.long
@pytest.mark.slow
def test_exported_networks_answer_as_torch_does(ladder):
    pytest.importorskip('torch')
    data = dataset_of(friction_of(BENCH, ladder), period=0.05)
    for name in ('feedforward', 'cnn', 'lstm', 'transformer'):
        model = learner(name)(data, 0, 0.5, None)
        assert model.once() == pytest.approx(float(model.predict(data, data.test[:1])[0]),
                                             rel=1e-4, abs=1e-3)


def test_the_command_line_starts_without_torch():
    code = ('import sys; from servo_identify.cli import main; '
            'import servo_identify.commands.friction, servo_identify.commands.fit; '
            'sys.exit("torch" in sys.modules)')
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0


def test_the_command_writes_tables_and_pictures(ladder, tmp_path, capsys):
    bags = [str(tmp_path / f'bag{i}') for i in range(len(ladder))]
    for bag, recording in zip(bags, ladder, strict=True):
        write_recording(bag, recording)
    out = tmp_path / 'out'
    assert main(['friction', *bags, '--servo', 'config/servos/rv_bench.yaml', '-o', str(out),
                 '--learners', 'coulomb_viscous', 'sindy', '--cells', '60']) == 0
    assert {f.name for f in out.iterdir()} == {
        'table.md', 'table.json', 'friction_speed.png', 'friction_angle.png', 'network.json',
        'servo.yaml'}
    assert json.loads((out / 'network.json').read_text())['forward']['mape'] < 1.0
    assert 'coulomb_viscous' in capsys.readouterr().out


@settings(max_examples=30)
@given(st.lists(st.floats(0.1, 10.0), min_size=3, max_size=20))
def test_scores_are_those_of_their_definitions(values):
    y = np.array(values)
    s = scores_of(y, y + 0.5)
    assert s.mse == pytest.approx(0.25) and s.mae == pytest.approx(0.5)
    assert goodness_of_fit(y, y) == 1.0 and goodness_of_fit(y, 0.0 * y) == pytest.approx(0.0)
