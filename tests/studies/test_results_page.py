"""The page of results: its recordings, figures, pictures and text, on little of each."""

from importlib import import_module
import json
from pathlib import Path

import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.experiment.procedures import Run
from servo_studies.commands.results import COMPARED, of_paper, pages_of
from servo_studies.papers import compared_models, learner_results, model_errors, results_plots
from servo_studies.papers.bench_recordings import LOADS, Part, plan, recorded, SPEEDS
from servo_studies.papers.bench_results import comparison_rows
from servo_studies.papers.paper_comparison import comparison, keep, kept
from servo_studies.papers.paper_systems import machines, SYSTEMS, WRITTEN
from servo_studies.papers.results_page import page
from servo_twin.description.servo_file import dumps, loads
from servo_twin.physics.controllers import PositionLoop

DOCS = Path(__file__).parents[2] / 'docs'


def run(name: str, mode: str, reference: np.ndarray) -> Run:
    return Run(name, name, mode, 1e-3, reference, np.zeros(len(reference)))


@pytest.fixture(scope='module')
def work(tmp_path_factory):
    return tmp_path_factory.mktemp('work')


@pytest.fixture(scope='module')
def bench(work):
    """Short recordings of the emulated bench."""
    time = np.arange(1500) * 1e-3
    push = run('sine_short', 'voltage', 1.7 * np.sin(2.0 * np.pi * time))
    ramp = run('position_ramp_0', 'position', 0.02 * np.minimum(1.0, np.minimum(
        time, 1.5 - time) / 0.5))
    turn = run('turn', 'velocity', np.repeat([0.5, -0.5], 1500))
    return recorded(work, parts=[Part('open', False, (push,), 1), Part('ramp', False, (ramp,), 2),
                                 Part('turn', False, (turn,), 4)])


def test_training_and_test_runs_have_no_set_points_in_common():
    parts = {part.name: part for part in plan()}
    tests = {r.reference.tobytes() for part in parts.values() if not part.trains
             for r in part.runs}
    assert len(parts['open_loop_test'].runs) == 16
    assert len(parts['friction'].runs) == len(SPEEDS) and len(parts['loads'].runs) == len(LOADS)
    assert not tests & {r.reference.tobytes() for part in parts.values() if part.trains
                        for r in part.runs}
    seeds = [part.seed + k for part in parts.values() for k in range(len(part.runs))]
    assert len(set(seeds)) == len(seeds)


@pytest.mark.long
def test_a_recording_is_made_once_and_again_when_it_is_another(work, bench):
    def made(reference: np.ndarray) -> int:
        recorded(work, parts=[Part('once', True, (run('hold', 'voltage', reference),), 3)])
        return next((work / 'once/hold').glob('*.mcap')).stat().st_mtime_ns

    first = made(np.zeros(100))
    assert made(np.zeros(100)) == first
    assert made(np.full(100, 0.1)) != first


@pytest.mark.long
def test_models_run_and_are_drawn_beside_the_rig(bench, tmp_path):
    servos = {'traditional': compared_models.data_sheet(), 'hybrid': compared_models.data_sheet()}
    runs = model_errors.open_loop(servos, bench['open'])
    fit = runs['hybrid'][0].speed_fit
    assert 0.3 < fit < 0.99 and fit == runs['traditional'][0].speed_fit
    results_plots.open_loop(runs, ['sine_short'], tmp_path / 'open.png')
    results_plots.fits({m: [r[0].speed_fit] for m, r in runs.items()}, ['sine_short'],
                  tmp_path / 'fits.png')
    course, = model_errors.reversals(servos, bench['ramp'])
    assert course.errors()['hybrid'] < 2e-3 < np.ptp(course.measured)
    results_plots.reversals([course], tmp_path / 'reversal.png')
    results_plots.velocity_loop(course, tmp_path / 'speed.png')
    results_plots.torque({'forward': course}, tmp_path / 'torque.png')
    assert all((tmp_path / f'{name}.png').stat().st_size > 10_000 for name in (
        'open', 'fits', 'reversal', 'speed', 'torque'))


def test_the_torque_of_the_rig_is_read_alike_whatever_the_first_model_found(bench):
    sheet, (recording,) = compared_models.data_sheet(), bench['turn']
    fitted = sheet.with_values({'drive.torque_constant': 0.3})
    courses = model_errors.torque_over_turn({'fitted': fitted, 'sheet': sheet}, recording, 2.0)
    for title, way in ('forward', 1.0), ('reverse', -1.0):
        rows = np.flatnonzero(way * recording['reference_velocity'] > 0.0)[500:-500]
        angle, torque = recording['load_position'][rows], 2.0 * recording['current'][rows]
        cells = np.floor(np.mod(angle, 2.0 * np.pi) * 180.0 / np.pi)
        course = courses[title]
        at = int(cells[len(cells) // 2])
        assert course.measured[at] == pytest.approx(torque[cells == at].mean())


def test_the_position_loop_has_the_gains_of_the_speed_loop_inside():
    servo = model_errors.position_controlled(compared_models.data_sheet())
    assert servo.controller is PositionLoop and servo.values['controller.kv'] == 16.09
    assert loads(dumps(servo)).values == servo.values


def test_the_page_is_made_of_the_figures_that_are_known(tmp_path, capsys):
    assert main(['results', '--work', str(tmp_path), '-o', str(tmp_path / 'results.md'),
                 '--parts', 'emps']) == 2
    assert 'needs the folder DATA' in capsys.readouterr().err
    figure = {'fitted': [50.0, 70.0], 'measured': [50.5, 70.0], 'seconds': 1.0}
    text = page({'two_mass': figure})
    assert '| antiresonance | 50.00 | 50.50 | -0.99 |' in text and 'Open loop' not in text


def test_a_system_that_nobody_has_run_is_said_to_be_not_run():
    lines = [line for line in comparison({}, {}).splitlines() if line.startswith('| 00')]
    assert len(lines) == len(SYSTEMS)
    assert all(line.count('not run') >= 2 and line.endswith('|  |') for line in lines)


def test_measured_rows_take_the_place_of_their_system_and_others_come_below(tmp_path):
    name = next(s.name for s in SYSTEMS if s.part == 'geared_dc')
    row = {'system': name, 'runs': 'all', 'paper': '', 'ours': '0.5 N m', 'command': 'make x'}
    keep(tmp_path, 'geared_dc', [row, {**row, 'system': 'one more', 'paper': '7', 'command': ''}])
    text = comparison(kept(tmp_path), {'geared_dc': 'geared_dc.md'})
    known, extra = (next(line for line in text.splitlines() if said in line)
                    for said in (name, 'one more'))
    assert f'[{name}](geared_dc.md) | all | RMSE 0.012' in known and known.endswith('`make x` |')
    assert '| 7 | 0.5 N m | `servo-identify results --parts geared_dc --force` |' in extra
    assert text.index(name) < text.index('one more') < text.index('| 004 |')
    with pytest.raises(ValueError, match='geared_dc has .* it needs'):
        keep(tmp_path, 'geared_dc', [{'system': name}])


def test_the_bench_gives_a_row_to_each_system_of_its_paper():
    scores = {'mse': 0.1, 'mae': 0.2, 'mape': 0.3}
    both = {'hybrid': 1e-3, 'traditional': 2e-3}
    rows = comparison_rows({
        'names': ['sine_a', 'square_a'], 'friction': {'forward': scores, 'reverse': scores},
        'open_loop': {m: {'speed': [0.9, 0.8]} for m in both}, 'backlash': scores,
        'transmission_error': {'mse': [1e-3, 2e-3]}, 'velocity_loop': {'rms': both},
        'torque': {'forward': {'rms': both}}, 'reversal': {'ramp_0': {'rms': both}}})
    assert [r['system'] for r in rows] == [s.name for s in SYSTEMS if s.paper == '000']
    assert 'hybrid 0.900 (sine) and 0.800 (square)' in rows[0]['ours']
    assert '1.00 mN m forward (traditional 2.00)' in rows[5]['ours']


def test_the_learners_of_the_bench_give_one_row_with_the_best_first():
    scores = [{'name': n, 'test': {'rmse': e, 'mae': e, 'r2': 1.0 - e}} for n, e in (
        ('dahl', 0.5), ('lstm', 0.25))]
    row, = learner_results.comparison_rows({'rows': scores})
    assert row['ours'] == ('lstm RMSE 0.250 N m, MAE 0.250 N m, R2 0.7500; R2 of the others '
                           'dahl 0.500')


@pytest.mark.parametrize('part', COMPARED)
def test_every_part_of_the_comparison_has_rows_for_it(part):
    assert callable(of_paper(part).comparison_rows)


@pytest.mark.parametrize('part', machines())
def test_every_machine_with_a_page_can_be_made_told_and_compared(part):
    module = import_module(f'servo_studies.papers.{part}')
    assert callable(module.make) and callable(module.comparison_rows)
    if part in WRITTEN:
        assert (DOCS / f'{part}.md').exists()
    else:
        assert callable(module.page)


def test_pages_are_written_anew_from_the_figures_that_were_kept(tmp_path, capsys):
    (tmp_path / 'work').mkdir()
    (tmp_path / 'work/two_mass.json').write_text(
        '{"fitted": [50.0, 70.0], "measured": [50.5, 70.0], "seconds": 1.0, '
        '"made": "2026-11-25"}')
    rows = [{'system': 'x', 'runs': 'y', 'paper': '', 'ours': 'z', 'command': ''}]
    keep(tmp_path / 'comparison', 'bench', rows)
    assert main(['results', '--work', str(tmp_path / 'work'), '-o', str(tmp_path / 'results.md'),
                 '--parts']) == 0
    text = (tmp_path / 'results.md').read_text()
    assert 'antiresonance' in text and '*Made on 2026-11-25, in 1 s.*' in text
    assert '| 000 | [x](results.md) | y |' in (tmp_path / 'comparison.md').read_text()
    assert kept(tmp_path / 'comparison') == {'bench': rows}


def test_a_page_that_is_written_by_hand_is_linked_and_never_written(tmp_path, capsys):
    (tmp_path / 'work').mkdir()
    found = {'step': 30.0, 'travel': 0.2, 'versions': {
        '2': {'motor': 1e-14, 'table': 2e-16, 'step': 60.0}}}
    (tmp_path / 'work/fmu.json').write_text(json.dumps(found))
    assert main(['results', '--work', str(tmp_path / 'work'), '-o', str(tmp_path / 'results.md'),
                 '--parts']) == 0
    line = next(line for line in (tmp_path / 'comparison.md').read_text().splitlines()
                if '(fmu.md)' in line)
    assert line.endswith('| `servo-identify results --parts fmu --force` |')
    assert '2.0 (FMI 2) times the 30 ns' in line
    assert not (tmp_path / 'fmu.md').exists()


def test_the_shipped_comparison_is_made_of_the_rows_that_were_measured():
    assert (DOCS / 'comparison.md').read_text() == comparison(
        kept(DOCS / 'comparison'), pages_of('results.md')), 'servo-identify results --parts'
