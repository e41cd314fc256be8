"""The page of results: its recordings, figures, pictures and text, on little of each."""

import json

import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.experiment.procedures import Run
from servo_identify.results import figures, models, pictures
from servo_identify.results.page import page
from servo_identify.results.recordings import LOADS, Part, plan, recorded, SPEEDS
from servo_twin.physics.controllers import PositionLoop
from servo_twin.servo_file import dumps, loads


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
    return recorded(work, parts=[Part('open', False, (push,), 1), Part('ramp', False, (ramp,), 2)])


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


def test_a_recording_is_made_once_and_again_when_it_is_another(work, bench):
    def made(reference: np.ndarray) -> int:
        recorded(work, parts=[Part('once', True, (run('hold', 'voltage', reference),), 3)])
        return next((work / 'once/hold').glob('*.mcap')).stat().st_mtime_ns

    first = made(np.zeros(100))
    assert made(np.zeros(100)) == first
    assert made(np.full(100, 0.1)) != first


def test_models_run_and_are_drawn_beside_the_rig(bench, tmp_path):
    servos = {'traditional': models.data_sheet(), 'hybrid': models.data_sheet()}
    runs = figures.open_loop(servos, bench['open'])
    fit = runs['hybrid'][0].speed_fit
    assert 0.3 < fit < 0.99 and fit == runs['traditional'][0].speed_fit
    pictures.open_loop(runs, ['sine_short'], tmp_path / 'open.png')
    pictures.fits({m: [r[0].speed_fit] for m, r in runs.items()}, ['sine_short'],
                  tmp_path / 'fits.png')
    course, = figures.reversals(servos, bench['ramp'])
    assert course.errors()['hybrid'] < 2e-3 < np.ptp(course.measured)
    pictures.reversals([course], tmp_path / 'reversal.png')
    pictures.velocity_loop(course, tmp_path / 'speed.png')
    pictures.torque({'forward': course}, tmp_path / 'torque.png')
    assert all((tmp_path / f'{name}.png').stat().st_size > 10_000 for name in (
        'open', 'fits', 'reversal', 'speed', 'torque'))


def test_the_position_loop_has_the_gains_of_the_speed_loop_inside():
    servo = figures.position_controlled(models.data_sheet())
    assert servo.controller is PositionLoop and servo.values['controller.kv'] == 16.09
    assert loads(dumps(servo)).values == servo.values


def test_the_page_is_made_of_the_figures_that_are_known(tmp_path, capsys):
    assert main(['results', '--work', str(tmp_path), '-o', str(tmp_path / 'results.md'),
                 '--parts', 'emps']) == 2
    assert 'needs the folder DATA' in capsys.readouterr().err
    figure = json.loads('{"fitted": [50.0, 70.0], "measured": [50.5, 70.0], "seconds": 1.0}')
    text = page({'two_mass': figure})
    assert '| antiresonance | 50.00 | 50.50 | -0.99 |' in text and 'Open loop' not in text
