"""A stretch of a recording, by --from and --to: a command ..."""

import json
from math import inf
from pathlib import Path

from bench_recording import bench_recording, SERVO
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data import long_bags
from servo_identify.data.reading import open_one, read_looked_at, read_recordings
from servo_identify.data.stretch import Stretch
from servo_identify.jobs.fit_jobs import read_jobs
from servo_identify.jobs.live import diagnose_job, retrain_job
from servo_twin.bag import write_recording
from servo_twin.recording.parts import parts_of

TABLE = Path(__file__).parents[2] / 'docs' / 'example' / 'runs' / 'multisine_1.csv'


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp('bags') / 'run', bench_recording(4.0))


def told(*words, capsys):
    """Return what `info` says of the recordings that are named."""
    assert main(['info', *map(str, words), '--json', '-', '--quiet']) == 0
    return json.loads(capsys.readouterr().out)['recordings']


def test_takes_the_samples_between_two_instants_of_a_bag_and_says_which(bag, capsys):
    whole, = read_recordings([bag])
    one, = read_recordings([bag], stretch=Stretch(1.0, 2.5))
    assert one.name == 'run[1-2.5 s]'
    assert len(one) == round(1.5 / one.period)
    assert one.start == pytest.approx(whole.start + 1.0, abs=1e-6)
    assert one.digest == whole.digest
    first = round(1.0 / whole.period)
    for name, column in one.columns.items():
        assert np.array_equal(column, whole[name][first:first + len(one)], equal_nan=True)
    facts, = told(bag, '--from', 1, '--to', 2.5, capsys=capsys)
    assert facts['duration'] == pytest.approx(1.5)


def test_takes_a_stretch_of_a_bag_that_is_too_long_to_be_held(bag, monkeypatch):
    whole, = read_recordings([bag])
    monkeypatch.setattr(long_bags, 'LONGEST', len(whole) // 4)
    with open_one(bag, stretch=Stretch(1.0)) as one:
        held = np.concatenate([part['load_position'] for part in parts_of(one, 300)])
        assert np.array_equal(held, whole['load_position'][round(1.0 / whole.period):])
    looked = read_looked_at([bag], stretch=Stretch(1.0))
    assert len(looked) > 1
    assert all(part.start >= whole.start + 1.0 - 1e-6 for part in looked)
    assert looked[0].name.startswith('run[1-4 s][')


def test_takes_a_stretch_of_a_table(capsys):
    whole, = told(TABLE, capsys=capsys)
    facts, = told(TABLE, '--from', 1, capsys=capsys)
    assert facts['duration'] == pytest.approx(whole['duration'] - 1.0)


@pytest.mark.parametrize('command', [
    ['check'], ['diagnose', '-o', 'out'], ['fit', '-o', 'out.yaml'], ['info']])
@pytest.mark.parametrize(('words', 'said'), [
    (('--from', '600', '--to', '660'),
     'from 600 s to 660 s there is nothing; it goes from 0 to 4 s'),
    (('--from', '3', '--to', '2'), 'from 3 s to 2 s there is nothing'),
    (('--from', '9'), 'from 9 s on there is nothing')])
def test_refuses_an_empty_stretch_and_says_what_there_is(command, words, said, bag, tmp_path,
                                                         monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    servo = [] if command == ['info'] else ['--servo', str(SERVO)]
    assert main([*command, str(bag), *servo, *words]) == 2
    assert f'run: {said}' in capsys.readouterr().err


@pytest.mark.parametrize('given', ['-1', 'nan', 'inf'])
def test_refuses_what_is_no_instant(given, bag, capsys):
    with pytest.raises(SystemExit):
        main(['info', str(bag), f'--from={given}'])
    assert 'is no instant of a recording: give 0 s or more' in capsys.readouterr().err


def test_fits_and_checks_the_stretch_alone(bag, tmp_path, capsys):
    out, report = tmp_path / 'new.yaml', tmp_path / 'fit.json'
    assert main(['fit', str(bag), '--servo', str(SERVO), '--free', 'effects.viscous.slope',
                 '--from', '1', '--to', '3', '-o', str(out), '--report', str(report)]) == 0
    assert 'run[1-3 s]#' in out.read_text()


@pytest.mark.parametrize(('stretch', 'status', 'said'), [
    ([1.0, 3.0], 0, ''), ([600.0, inf], 2, 'run: from 600 s on there is nothing; it goes from 0')])
def test_retrains_beside_a_running_rig_from_the_stretch_alone(stretch, status, said, bag, tmp_path,
                                                              capsys):
    spec, out = tmp_path / 'spec.json', tmp_path / 'new.yaml'
    spec.write_text(json.dumps({'servo': str(SERVO), 'learn': ['effects.viscous.slope'],
                                'bags': [str(bag)], 'stretch': stretch, 'output': str(out)}))
    assert retrain_job.main([str(spec)]) == status
    assert said in capsys.readouterr().out
    assert status or 'run[1-3 s]#' in out.read_text()


def test_diagnoses_beside_a_running_rig_the_stretch_alone(bag, tmp_path, monkeypatch):
    taken = []
    monkeypatch.setattr(diagnose_job, 'diagnose', lambda several, *_, **__: taken.extend(several))
    monkeypatch.setattr(diagnose_job, 'write_diagnosis', lambda *_: None)
    words = [str(SERVO), str(tmp_path), str(bag)]
    assert diagnose_job.main(['--stretch', '0', '3.5', *words]) == 0
    assert diagnose_job.main(words) == 0
    assert [one.name for one in taken] == ['run[0-3.5 s]', 'run']


def test_takes_the_stretch_of_each_fit_of_a_file_of_jobs(bag, tmp_path):
    jobs = tmp_path / 'jobs.yaml'
    jobs.write_text(f'fits:\n  one:\n    servo: {SERVO}\n    bags: ["{bag.name}"]\n'
                    '    stretch: [1, 2]\n')
    (tmp_path / bag.name).symlink_to(bag)
    assert read_jobs(jobs)['one'].settings.stretch == Stretch(1.0, 2.0)
    jobs.write_text(jobs.read_text().replace('[1, 2]', '[1]'))
    with pytest.raises(ValueError, match=r'fits\.one: stretch = \[1\]; write two instants'):
        read_jobs(jobs)


def test_does_not_pass_over_a_stretch_beside_many_machines(tmp_path, capsys):
    assert main(['diagnose', '--jobs', 'rigs.yaml', '-o', str(tmp_path), '--from', '1']) == 2
    assert 'leave them out beside --jobs' in capsys.readouterr().err
