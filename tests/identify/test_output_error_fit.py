"""Output-error fitting, on recordings whose truth is known."""

from dataclasses import replace
import json
from pathlib import Path

from bench_recording import bench_recording
import numpy as np
import pytest
from synthetic_recordings import sampled

from servo_identify.cli import main
from servo_identify.fit.output_error import fit
from servo_twin.bag import write_recording
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.controllers import Open
from servo_twin.physics.servo import Placed, ServoError

BENCH = servo_file.load(Path(__file__).parents[2] / 'config/servos/rv_bench.yaml')
TRUTH = {'mechanism.load_inertia': 6.0, 'effects.coulomb.level': 24.0,
         'effects.viscous.slope': 44.0, 'mechanism.stiffness': 4.6e5}
RIG = BENCH.with_values(TRUTH)
TIME = np.arange(6000) * 1e-3


def swings(phase: float = 0.0) -> np.ndarray:
    """Return a command that reverses and shakes, V."""
    return 1.6 * np.sin(5.7 * TIME) + 0.5 * np.sin(44.0 * TIME + phase)


@pytest.fixture(scope='module')
def estimates():
    """Fits of the same machine to six recordings that differ in noise and phase."""
    return [fit(BENCH, [sampled(RIG, swings(seed), seed=seed)], list(TRUTH)) for seed in range(6)]


def test_it_recovers_values_within_their_stated_errors(estimates):
    off = np.array([[(e.values[p] - TRUTH[p]) / e.std[p] for p in TRUTH] for e in estimates])
    assert np.mean(np.abs(off) < 2.0) >= 0.85
    assert np.abs(off).max() < 5.0


def test_it_states_errors_that_are_not_wildly_cautious(estimates):
    off = np.array([[(e.values[p] - TRUTH[p]) / e.std[p] for p in TRUTH] for e in estimates])
    assert np.sqrt(np.mean(off**2)) > 0.15
    assert np.median([e.std[p] / TRUTH[p] for e in estimates for p in TRUTH]) < 1e-3


def test_it_knows_a_scale_that_all_torques_share_no_better_than_the_torque_sensor_does():
    free = ['drive.gain', 'drive.torque_constant', 'mechanism.rotor_inertia', *TRUTH]
    recording = sampled(RIG, swings())
    estimate = fit(BENCH, [recording], free)
    torque = recording['torque']
    least = BENCH.noise('torque') / np.sqrt(np.sum(torque**2))
    for path in ('effects.coulomb.level', 'effects.viscous.slope', 'mechanism.load_inertia'):
        assert estimate.std[path] > 0.5 * least * estimate.values[path]


def test_it_leaves_no_more_than_the_noise_where_no_start_is_caught_in_a_kink(estimates):
    for channel in ('motor_position', 'load_position', 'current'):
        left = [e.rms[channel] / e.noise[channel] for e in estimates]
        assert np.median(left) < 1.1
    assert all(e.cost < e.cost_before for e in estimates)


def test_it_writes_provenance_into_the_servo(estimates):
    said = estimates[0].servo.provenance['mechanism.load_inertia']
    assert said.std == estimates[0].std['mechanism.load_inertia']
    assert said.bags == (f'synthetic 0#{0:012d}',)
    assert servo_file.loads(servo_file.dumps(estimates[0].servo)) == estimates[0].servo


def test_it_saves_what_it_found(estimates, tmp_path):
    estimates[0].save(tmp_path / 'estimate.json')
    told = json.loads((tmp_path / 'estimate.json').read_text())
    assert told['values'] == estimates[0].values
    assert str(estimates[0]).startswith('mechanism.load_inertia')


@pytest.fixture(scope='module')
def cruise():
    """A recording at a constant speed, long after its start."""
    whole = sampled(RIG, np.full(6000, 1.5))
    columns = {name: column[4000:] for name, column in whole.columns.items()}
    return type(whole)('cruise', whole.period, columns)


def test_it_warns_of_a_parameter_that_is_not_excited(cruise):
    warnings = fit(RIG, [cruise], ['mechanism.load_inertia'], channels=['torque']).warnings
    assert warnings and 'mechanism.load_inertia is not excited' in warnings[0]


def test_it_warns_of_parameters_that_cannot_be_told_apart(cruise):
    pair = ['effects.coulomb.level', 'effects.viscous.slope']
    warnings = fit(RIG, [cruise], pair).warnings
    assert any('cannot be told apart' in w and 'coulomb' in w and 'viscous' in w for w in warnings)
    assert fit(RIG, [sampled(RIG, swings())], pair).warnings == ()


def test_it_holds_an_effect_that_nothing_moves():
    far = BENCH.with_effects(Placed('heavy', find('gravity'), 'load'),
                             values={'effects.heavy.cosine': 0.0, 'effects.heavy.sine': 0.0})
    still = sampled(BENCH, np.zeros(3000))
    warnings = fit(far, [still], ['effects.viscous.slope']).warnings
    assert warnings and 'effects.viscous.slope is not excited' in warnings[0]


def test_it_says_when_a_value_ends_at_its_bound():
    estimate = fit(BENCH, [sampled(RIG, swings())], ['mechanism.load_inertia'],
                   bounds={'mechanism.load_inertia': (5.0, 5.8)})
    assert estimate.values['mechanism.load_inertia'] == pytest.approx(5.8, rel=1e-3)
    assert any('at its bound' in w for w in estimate.warnings)


def test_it_does_not_let_a_late_channel_become_inertia():
    late = sampled(RIG, swings(), late={'load_position': 2.3, 'motor_position': 2.3})
    free = ['mechanism.load_inertia', 'effects.coulomb.level', 'effects.viscous.slope']
    estimate = fit(RIG, [late], free, delays=True)
    assert estimate.delays['load_position'] == pytest.approx(2.3e-3, abs=0.05e-3)
    assert estimate.values['mechanism.load_inertia'] == pytest.approx(6.0, rel=2e-3)


@pytest.mark.long
@pytest.mark.slow
def test_it_frees_a_row_element_by_element():
    wavy = RIG.with_effects(Placed('te', find('transmission_error'), 'mesh'),
                            values={'effects.te.cosine': (4e-5, 0.0),
                                    'effects.te.sine': (0.0, 2e-5)})
    estimate = fit(wavy.with_values({'effects.te.cosine': (1e-5, 1e-5),
                                     'effects.te.sine': (0.0, 1e-5)}),
                   [sampled(wavy, swings())], ['effects.te.cosine', 'effects.te.sine[1]'])
    assert estimate.names == ('effects.te.cosine[0]', 'effects.te.cosine[1]', 'effects.te.sine[1]')
    assert estimate.servo.values['effects.te.cosine'] == pytest.approx((4e-5, 0.0), abs=1e-6)
    assert estimate.values['effects.te.sine[1]'] == pytest.approx(2e-5, abs=1e-6)


@pytest.mark.parametrize('free, said', [
    ([], 'no parameter is free'),
    (['mechanism.inertia'], "there is no parameter 'mechanism.inertia'"),
    (['mechanism.rotor_inertai'], "did you mean 'mechanism.rotor_inertia'"),
    (['mechanism.stiffness[2]'], 'holds 1 number'),
    (['mechanism.stiffness'] * 2, 'freed twice'),
])
def test_it_names_what_cannot_be_freed(free, said):
    with pytest.raises(ServoError, match=said.replace('[', r'\[')):
        fit(BENCH, [sampled(BENCH, np.ones(500))], free)


def test_it_names_the_column_that_a_mode_needs():
    recording = sampled(BENCH, np.full(500, np.nan))
    with pytest.raises(ValueError, match="needs the column 'voltage'"):
        fit(BENCH, [recording], ['mechanism.stiffness'])
    with pytest.raises(ValueError, match="'closed_loop' needs the column 'reference_velocity'"):
        fit(BENCH, [sampled(BENCH, swings())], ['mechanism.stiffness'], mode='closed_loop')


def test_it_closes_no_loop_of_a_servo_without_a_controller():
    bare = replace(BENCH, controller=Open, values={
        path: value for path, value in BENCH.values.items() if 'controller' not in path})
    with pytest.raises(ValueError, match=f'{BENCH.name} has none; other modes are'):
        fit(bare, [sampled(BENCH, swings())], ['mechanism.stiffness'], mode='closed_loop')


def test_it_refuses_recordings_without_motion_and_those_of_a_few_samples():
    still = sampled(BENCH, np.zeros(500))
    still = replace(still, columns={name: np.full(500, column[0])
                                    for name, column in still.columns.items()})
    with pytest.raises(ValueError, match='nothing moves'):
        fit(BENCH, [still], ['mechanism.stiffness'])
    with pytest.raises(ValueError, match='has 5 samples; a fit needs at least 30'):
        fit(BENCH, [sampled(BENCH, np.ones(5))], ['mechanism.stiffness'])


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """A bag of the synthetic rig."""
    path = tmp_path_factory.mktemp('bags') / 'swings'
    write_recording(path, sampled(RIG, swings()))
    return path


def test_the_command_writes_a_servo_file_with_errors_and_hashes(bag, tmp_path, capsys):
    found = tmp_path / 'found.yaml'
    status = main(['fit', str(bag), '--servo', 'config/servos/rv_bench.yaml', '-o', str(found),
                   '--free', *TRUTH, '--no-delays', '--report', str(tmp_path / 'r.json')])
    assert status == 0
    servo = servo_file.load(found)
    assert servo.values['effects.coulomb.level'] == pytest.approx(24.0, rel=1e-2)
    said = servo.provenance['effects.coulomb.level']
    assert said.std > 0.0 and '#' in said.bags[0]
    assert 'standard error' in capsys.readouterr().out


@pytest.mark.parametrize('report, said', [
    ('mine.json', '--force'), ('mine.json/r.json', 'nothing can be written there')])
def test_the_command_judges_the_place_of_the_report_before_it_fits(tmp_path, capsys, report, said):
    mine = tmp_path / 'mine.json'
    mine.write_text('mine')
    bag = tmp_path / 'a.mcap'
    bag.write_text('no bag, as reading it would find')
    assert main(['fit', str(bag), '--servo', 'config/servos/rv_bench.yaml', '-o',
                 str(tmp_path / 'found.yaml'), '--report', str(tmp_path / report)]) == 2
    assert said in capsys.readouterr().err and mine.read_text() == 'mine'


def test_the_command_leaves_nothing_when_it_fails(bag, tmp_path, capsys):
    found = tmp_path / 'found.yaml'
    status = main(['fit', str(bag), '--servo', 'config/servos/rv_bench.yaml', '-o', str(found),
                   '--free', 'mechanism.mass'])
    assert status == 2
    assert "no parameter 'mechanism.mass'" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_command_stops_where_the_data_contradict_the_file_unless_despite_it(tmp_path, capsys):
    whole = bench_recording(2.0)
    bag, found = tmp_path / 'swings', tmp_path / 'found.yaml'
    write_recording(bag, replace(whole, columns={**whole.columns, 'load_position': -whole[
        'load_position']}))
    words = ['fit', str(bag), '--servo', 'config/servos/rv_bench.yaml', '-o', str(found),
             '--free', 'effects.coulomb.level', '--no-delays']
    assert main(words) == 2
    said = capsys.readouterr().err
    assert 'load_position runs against the rest' in said and '--despite-check' in said
    assert not found.exists()
    assert main([*words, '--despite-check']) == 0
    assert 'warning: ' in capsys.readouterr().err and found.exists()
