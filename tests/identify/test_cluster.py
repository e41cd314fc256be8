"""Fits and other tasks over a cluster, with workers that die."""

import json
import os
from pathlib import Path
import socket

from cluster_tasks import listening, told
import numpy as np
import pytest
from synthetic_recordings import sampled

from servo_identify.cli import main
from servo_identify.jobs.cluster import scattered
from servo_identify.jobs.fit_jobs import read_jobs
from servo_studies.blind_check import case_runs
from servo_studies.blind_check.cases import of_plan
from servo_twin.bag import write_recording
from servo_twin.description import servo_file

SERVO = Path(__file__).parents[2] / 'config/servos/rv_bench.yaml'
BENCH = servo_file.load(SERVO)
FREE = ['mechanism.load_inertia', 'effects.coulomb.level']


@pytest.fixture(scope='module')
def answers(tmp_path_factory):
    """Eight tasks on two processes: one always kills its worker, one the first time only."""
    folder = tmp_path_factory.mktemp('tasks')
    tasks = {f'task {n}': (n, folder) for n in range(8)}
    return {done.name: done for done in scattered(told, tasks, workers=2)}


def test_it_finishes_every_other_task_when_workers_die(answers):
    assert {name: done.answer for name, done in answers.items() if not done.problem} == {
        f'task {n}': n**2 for n in (0, 1, 2, 4, 6, 7)}


def test_it_reports_the_task_that_kills_its_worker_twice(answers):
    assert 'worker died' in answers['task 3'].problem


def test_it_runs_a_task_again_that_lost_its_worker(answers):
    assert answers['task 4'].answer == 16


def test_it_reports_a_task_that_fails_by_its_own_words(answers):
    assert answers['task 5'].problem == 'five is refused'


def test_it_listens_on_localhost_only():
    heard = []
    for done in scattered(listening, {'one': (), 'two': ()}, workers=2):
        heard += [*done.answer, *listening()]
    assert heard and set(heard) == {'127.0.0.1'}


def test_it_starts_no_cluster_for_a_single_task(tmp_path):
    assert [done.answer for done in scattered(os.getpid, {'one': ()})] == [os.getpid()]


def test_it_names_an_address_at_which_no_scheduler_answers(monkeypatch):
    monkeypatch.setattr('servo_identify.jobs.cluster.ANSWERS_WITHIN', '1s')
    with socket.socket() as free:
        free.bind(('127.0.0.1', 0))
        address = f'tcp://127.0.0.1:{free.getsockname()[1]}'
        with pytest.raises(ValueError, match=f'no Dask scheduler answers at {address}'):
            list(scattered(told, {'one': (1, Path())}, address=address))


def test_it_uses_the_cluster_at_an_address(tmp_path):
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, host='127.0.0.1',
                      dashboard_address=None) as cluster:
        tasks = {f'task {n}': (n, tmp_path) for n in (1, 2)}
        found = {d.name: d.answer for d in scattered(
            told, tasks, address=cluster.scheduler_address)}
    assert found == {'task 1': 1, 'task 2': 4}


def test_the_blind_check_goes_on_without_a_case_that_is_lost(tmp_path, monkeypatch):
    def fails_once(one, folder, wanted):
        if one is cases[0]:
            raise RuntimeError('out of memory')

    cases, ended = of_plan('reduced')[:3], []
    monkeypatch.setattr(case_runs, 'run_case', fails_once)
    lost = case_runs.run_all(cases, tmp_path, workers=1, done=lambda one, _: ended.append(one))
    assert lost == {cases[0].name: 'RuntimeError: out of memory'}
    assert ended == cases


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """A folder with bags of two rigs that differ in their friction."""
    folder, time = tmp_path_factory.mktemp('bags'), np.arange(4000) * 1e-3
    for rig, level in (('first', 23.0), ('second', 26.0)):
        made = BENCH.with_values({'effects.coulomb.level': level})
        write_recording(folder / rig, sampled(made, 1.6 * np.sin(5.7 * time)))
    return folder


@pytest.mark.long
@pytest.mark.slow
def test_the_command_fits_each_bag_by_itself(bags, tmp_path, capsys):
    status = main(['fit', str(bags / 'first'), str(bags / 'second'), '--each', '--servo',
                   str(SERVO), '--free', *FREE, '--no-delays', '-o', str(tmp_path / 'found')])
    assert status == 0
    for rig, level in (('first', 23.0), ('second', 26.0)):
        servo = servo_file.load(tmp_path / f'found/{rig}.yaml')
        assert servo.values['effects.coulomb.level'] == pytest.approx(level, rel=1e-2)
        report = json.loads((tmp_path / f'found/{rig}.json').read_text())
        assert report['bags'][0].startswith(rig)
    assert '2 fits, 0 failed' in capsys.readouterr().out


def test_a_fit_that_fails_costs_itself_only(bags, tmp_path, capsys):
    (tmp_path / 'rigs.yaml').write_text(
        f'settings: {{delays: false, free: {FREE}}}\n'
        f'fits:\n'
        f'  good: {{servo: {SERVO}, bags: "{bags}/fir*"}}\n'
        f'  bad: {{servo: {SERVO}, bags: ["{bags}/second"], free: [mechanism.mass]}}\n')
    status = main(['fit', '--jobs', str(tmp_path / 'rigs.yaml'), '-o', str(tmp_path / 'found'),
                   '--workers', '1'])
    assert status == 1
    assert sorted(p.name for p in (tmp_path / 'found').iterdir()) == ['good.json', 'good.yaml']
    said = capsys.readouterr().out
    assert '2 fits, 1 failed' in said and "no parameter 'mechanism.mass'" in said


@pytest.mark.parametrize('text, said', [
    ('fits: {}', "no mapping 'fits'"),
    ('fits: {a: {servo: s.yaml}}', "fits.a needs 'servo' and 'bags'"),
    ('fits: {a: {servo: s.yaml, bags: x*}}', 'fits.a: no bag matches'),
    ('fits: {a: {servo: s, bags: b, modus: 1}}', "fits.a has the key 'modus'"),
    ('fits: {a: {servo: s, bags: b, mode: open}}', "fits.a: mode = 'open'"),
    ('fits: {../a: {servo: s, bags: b}}', 'becomes that of a file'),
])
def test_it_says_what_is_wrong_with_a_file_of_jobs(text, said, tmp_path):
    (tmp_path / 'jobs.yaml').write_text(text)
    with pytest.raises(ValueError, match=said):
        read_jobs(tmp_path / 'jobs.yaml')


@pytest.mark.parametrize('options, said', [
    (['b', '--jobs', 'j', '-o', 'f'], '--jobs names servo files and bags itself; leave out bags'),
    (['-o', 'f'], 'bags is missing'),
    (['b', '--servo', 'rv_bench', '-o', 'f', '--cluster', 'tcp://h:1'], 'are for several fits'),
])
def test_the_command_names_options_that_do_not_go_together(options, said, capsys):
    assert main(['fit', *options]) == 2
    assert said in capsys.readouterr().err
