"""What the check makes of several recordings, and how it prints what it finds: the check ..."""

from dataclasses import replace
import json

from bench_recording import bench_recording, SERVO
from checked_bench import BENCH, changed
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.copies import copies
from servo_identify.data.reading import files_of
from servo_identify.data.recording_check import check
from servo_identify.diagnose.splitting import split
from servo_twin.bag import write_recording


@pytest.fixture(scope='module')
def good():
    return bench_recording(4.0)


def test_it_tells_a_copy_of_a_recording_and_reads_a_file_once(good, tmp_path):
    copy = replace(good, name='copy', columns={name: column.copy()
                                               for name, column in good.columns.items()})
    told = [one.sentence for one in check([good, copy], BENCH) if 'same samples' in one.sentence]
    assert told and told[0].startswith(f'copy holds the same samples as {good.name}')
    other = changed(copy, current=np.where(np.arange(len(copy)) == 7, 0.1, copy['current']))
    assert not any('same samples' in one.sentence for one in check([good, other], BENCH))
    hole = replace(good, columns={})
    assert not list(copies([hole, replace(hole, name='another')]))
    for name in ('run_1.csv', 'run_2.csv'):
        (tmp_path / name).write_text('t,motor_position\n0,0\n0.1,1\n')
    assert [one.name for one in files_of([tmp_path / '*.csv', tmp_path / 'run_1.csv'])] == [
        'run_1.csv', 'run_2.csv']


def test_the_command_prints_findings_as_json_and_fails_where_one_is_red(good, tmp_path, capsys):
    write_recording(tmp_path / 'good', good)
    spoilt = changed(good, current=-good['current'])
    write_recording(tmp_path / 'spoilt', spoilt)
    assert main(['check', str(tmp_path / 'good'), '--servo', str(SERVO), '--json', '-']) == 0
    said = json.loads(capsys.readouterr().out)
    assert 'red' not in {one['level'] for one in said['findings']}
    assert {'path': 'controller.filter', 'value': 0.0, 'unit': 's'} in said['defaults']
    assert main(['check', str(tmp_path / 's*'), '--servo', str(SERVO)]) == 1
    said = capsys.readouterr()
    assert 'turn the sign' in said.out
    assert 'give those that differ' in said.err
    assert '  controller.filter = 0.0 s (Time constant of the speed filter)\n' in said.err


def test_it_says_once_what_is_so_of_several_recordings(good):
    several = [replace(good, name=f'run {k}', warnings=('there is no voltage',))
               for k in range(5)]
    said, = [one for one in check(several, BENCH) if 'no voltage' in one.sentence]
    assert said.sentence == 'run 0, run 1, run 2 and 2 more: there is no voltage'


def test_what_is_red_keeps_the_name_of_its_recording(good):
    still = [changed(replace(good, name=name), current=np.zeros(len(good))) for name in 'ab']
    red = [one for one in check([*still, good], BENCH) if one.level == 'red']
    assert [one.recording for one in red] == ['a', 'b']


def test_it_says_what_is_meant_by_repeats_and_what_to_do(good):
    found = check([replace(good, family='')] * 3, BENCH)
    unnamed, = [one for one in found if 'family' in one.sentence]
    assert 'cannot be told' in unnamed.sentence and '--family' in unnamed.action
    few = check([replace(good, family=name) for name in ('sine', 'sine', 'steps')], BENCH)
    said, = [one for one in few if 'No family has 3' in one.sentence]
    assert 'sine 2, steps 1' in said.sentence
    assert said.action == 'record one motion 3 times'


@pytest.mark.parametrize(('families', 'words'), [
    (('', '', '', ''), ('do not say which of them repeat', 'recordings.yaml')),
    (('sine', 'sine', 'steps', 'slow'), ('no motion was recorded 3 times', 'record one motion'))])
def test_a_diagnosis_says_why_it_holds_out_other_motions(good, families, words):
    told = split([replace(good, family=name) for name in families], [], []).warnings[-1]
    assert all(word in told for word in words)


def test_it_works_out_channels_and_references_once(good, monkeypatch):
    from servo_identify.data import looked_over

    asked, work = [], looked_over.off_references
    monkeypatch.setattr(looked_over, 'off_references',
                        lambda *given: asked.append(given) or work(*given))
    check([good], BENCH)
    assert len(asked) == 1


def test_sentences_that_differ_in_their_numbers_alone_are_one(good):
    several = [replace(good, name=f'run_{k}', warnings=(
        f'times are not even ({k}e-3 to 0.5 s apart): resampled to 0.001 s',)) for k in (1, 2)]
    found, = [one for one in check(several, BENCH) if 'not even' in one.sentence]
    assert found.sentence == ('run_1, run_2: times are not even (1e-3 to 0.5 s apart): resampled '
                              'to 0.001 s (the numbers are of run_1)')
