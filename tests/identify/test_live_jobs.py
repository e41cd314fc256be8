"""What the identify node is made of, without ROS: it ..."""

from dataclasses import replace
import json
import os
from pathlib import Path
import subprocess
import sys
from time import monotonic, sleep

from bench_recording import bench_recording, SERVO
from hypothesis import given, strategies
import numpy as np
import pytest

from servo_identify.jobs.live.compare_job import judge
from servo_identify.jobs.live.job_process import Job
from servo_identify.jobs.live.retrain_job import wanted
from servo_identify.jobs.live.sample_ring import Ring
from servo_identify.jobs.live.servo_versions import Models, Trial
from servo_twin.description import servo_file
from servo_twin.physics.servo import Provenance
from servo_twin.recording.joined_samples import CHANNELS


def rows(first, count):
    """Return samples that carry their own running number."""
    return np.repeat(np.arange(first, first + count, dtype=float)[:, None], len(CHANNELS), axis=1)


@given(strategies.lists(strategies.integers(1, 700), min_size=1, max_size=12))
def test_it_keeps_the_last_samples_in_order_however_they_come(sizes):
    ring, at = Ring(1.0), 0
    for size in sizes:
        ring.put(at, at * 1_000_000, 1e-3, rows(at, size))
        at += size
    kept = min(at, 1000)
    assert (len(ring), ring.next) == (kept, at)
    assert ring.rows(at - kept, kept)[:, 0].tolist() == list(range(at - kept, at))
    outside = ring.rows(at - kept - 5, 10)[:, 0]
    assert np.isnan(outside[:5]).all() and outside[5] == at - kept
    assert ring.since(at - 100) == pytest.approx(min(at, 100) * 1e-3)


def test_it_marks_a_few_missing_samples_and_begins_anew_after_many():
    ring = Ring(10.0)
    ring.put(0, 0, 1e-3, rows(0, 1500))
    ring.put(1550, 0, 1e-3, rows(1550, 50))
    recording = ring.recording(10.0, 'running', 'servo', 'text')
    assert (len(recording), recording.sequence) == (1600, 0)
    assert np.isnan(recording['torque'][1500:1550]).all()
    ring.put(9000, 9_000_000_000, 1e-3, rows(9000, 10))
    assert len(ring) == 10
    with pytest.raises(ValueError, match='has been heard for 0.01 s'):
        ring.recording(10.0, 'running', 'servo', 'text')


def test_it_keeps_what_came_before_a_hole_as_a_recording_of_its_own():
    ring = Ring(20.0)
    for first, count in ((0, 5000), (5300, 2000), (7500, 4000)):
        ring.put(first, first * 1_000_000, 1e-3, rows(first, count))
    assert (len(ring), ring.since(0)) == (4000, 4.0)
    found = ring.recordings('running', 'servo', 'text')
    assert [(one.name, one.sequence, len(one), round(one.start, 6)) for one in found] == [
        ('running_1', 0, 5000, 0.0), ('running_2', 7500, 4000, 7.5)]  # 2 s are too little
    for one in found:
        assert one['torque'].tolist() == list(range(one.sequence, one.sequence + len(one)))
    assert len(ring.recording(20.0, 'trial', 'servo', 'text')) == 4000
    ring.put(11500, 11_500_000_000, 1e-3, rows(11500, 11_500))  # the first stretch is gone by now
    assert [one.sequence for one in ring.recordings('running', 'servo', 'text')] == [7500]
    ring.put(10, 0, 1e-3, rows(10, 1500))  # a driver that begins again
    assert [len(one) for one in ring.recordings('running', 'servo', 'text')] == [1500]


def finished(job):
    until = monotonic() + 60.0
    while job.status is None and monotonic() < until:
        sleep(0.02)
    return job.status


def test_it_hears_what_a_job_reports_and_why_it_failed(tmp_path):
    path = tmp_path / 'spec.json'
    path.write_text('{"servo": "/nowhere.yaml", "learn": [], "bags": [], "output": "x"}')
    job = Job('servo_identify.jobs.live.retrain_job', str(path))
    assert finished(job) == 2
    assert job.reports() == [{'stage': 'reading', 'progress': 0.0}]
    assert '/nowhere.yaml' in job.last_words()


def test_a_job_that_is_refused_tells_all_of_the_reason(tmp_path, monkeypatch):
    (tmp_path / 'says_no.py').write_text(
        'import sys\nfrom servo_identify.jobs.live.job_process import refused\n'
        'print("a warning")\n'
        'sys.exit(refused(ValueError("the data contradict the file:\\n  a leap\\ngo on?")))\n')
    monkeypatch.setenv('PYTHONPATH', f'{tmp_path}{os.pathsep}{os.environ.get("PYTHONPATH", "")}')
    job = Job('says_no')
    assert finished(job) == 2 and job.reports() == []
    assert job.last_words() == 'the data contradict the file:\n  a leap\ngo on?'


SLEEPER = """
import subprocess, sys
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
print(child.pid, flush=True)
child.wait()
"""
STARTER = """
from time import sleep
from servo_identify.jobs.live.job_process import Job
job = Job('sleeper')
while not job.last_words().isdigit():
    sleep(0.02)
print(job.last_words(), flush=True)
sleep(600)
"""


def has_ended(pid):
    """Wait until a process has ended (Linux)."""
    stat, until = Path(f'/proc/{pid}/stat'), monotonic() + 30.0
    while stat.exists() and ' Z ' not in stat.read_text() and monotonic() < until:
        sleep(0.02)
    return not stat.exists() or ' Z ' in stat.read_text()


@pytest.fixture
def sleeper(tmp_path, monkeypatch):
    (tmp_path / 'sleeper.py').write_text(SLEEPER)
    monkeypatch.setenv('PYTHONPATH', f'{tmp_path}:{os.environ.get("PYTHONPATH", "")}')


@pytest.mark.usefixtures('sleeper')
def test_a_job_and_all_that_it_started_die_with_who_started_it():
    node = subprocess.Popen([sys.executable, '-c', STARTER], stdout=subprocess.PIPE, text=True)
    child = node.stdout.readline().strip()
    assert Path('/proc', child).exists()
    node.kill()
    node.wait()
    assert has_ended(child)


@pytest.mark.usefixtures('sleeper')
def test_it_kills_a_job_with_all_that_it_started():
    job, until = Job('sleeper'), monotonic() + 30.0
    while not job.last_words().isdigit() and monotonic() < until:
        sleep(0.02)
    child = job.last_words()
    assert Path('/proc', child).exists()
    job.kill()
    assert has_ended(child)
    assert finished(job) != 0


def test_it_knows_what_names_of_things_to_learn_mean():
    servo = servo_file.load(SERVO)
    assert wanted(servo, []) == ([], list(servo.tolerance))
    assert wanted(servo, ['friction', 'coulomb', 'drive.gain']) == (
        ['friction'], ['effects.coulomb.level', 'drive.gain'])
    with pytest.raises(ValueError, match="'luck' is not to be learned"):
        wanted(servo, ['luck'])


def test_it_judges_a_worse_servo_worse_and_says_where():
    servo = servo_file.load(SERVO)
    worse = servo.with_values({'effects.coulomb.level': 45.0})
    judgement = judge(servo, worse, bench_recording(2.0))
    assert judgement.new > 1.1 * judgement.old
    assert judgement.balances['load'][1] > judgement.balances['load'][0]
    same = judge(servo, servo, bench_recording(2.0))
    assert same.old == same.new


def test_it_goes_back_only_from_a_servo_file_that_is_worse():
    models = Models('first', 0.02)
    models.loaded('second', 'first', 1000)
    assert (models.running, models.previous, models.trial.since) == ('second', 'first', 1000)
    assert not models.judged(10.0, 10.1, {'load': (10.0, 10.1)}, 60.0)
    assert models.trial is None and 'stays' in models.sentence
    models.loaded('third', 'second', 2000)
    assert models.judged(10.0, 12.0, {'motor': (9.0, 9.0), 'load': (11.0, 14.0)}, 60.0)
    assert models.sentence.endswith('worst is load')
    models.returned('second', 'third', 'it is worse')
    assert (models.running, models.previous, models.returns) == ('second', 'third', 1)


GIVEN = SERVO.read_text()  # as people write it: another text than a twin tells
TOLD = servo_file.dumps(servo_file.loads(GIVEN))
OWN = GIVEN.replace('servo: rv_bench', 'servo: own')
OWN_TOLD = servo_file.dumps(servo_file.loads(OWN))


def test_it_knows_its_own_file_by_what_stands_in_it_whenever_the_twin_tells_of_it():
    assert len({GIVEN, TOLD, OWN, OWN_TOLD}) == 4
    for told_at in ('before the answer', 'after the answer'):
        models = Models(GIVEN, 0.02)
        assert not models.follows('began', json.dumps({'servo_file': TOLD}))
        assert models.running == GIVEN
        models.asks(OWN)
        if told_at == 'before the answer':
            assert not models.follows('servo_file', OWN_TOLD)
        models.loaded(OWN, TOLD, 1000)
        if told_at == 'after the answer':
            assert not models.follows('servo_file', OWN_TOLD)
        assert models.trial == Trial(TOLD, OWN, 1000), told_at
        assert (models.running, models.previous) == (OWN, TOLD)
        assert not models.follows('began', json.dumps({'servo_file': OWN_TOLD}))
        models.asks(TOLD)
        assert not models.follows('servo_file', TOLD)
        models.returned(TOLD, OWN_TOLD, 'it is worse')
        assert (models.running, models.previous, models.returns) == (TOLD, OWN_TOLD, 1)


def test_nothing_is_on_trial_once_others_have_changed_what_the_twin_runs():
    models = Models(GIVEN, 0.02)
    models.loaded(OWN, TOLD, 1000)
    assert models.follows('parameters', '{"drive.gain": 0.45}')
    assert models.trial is None and 'not loaded from here' in models.sentence
    assert models.previous == OWN
    changed = servo_file.loads(models.running)
    assert (changed.name, changed.values['drive.gain']) == ('own', 0.45)
    # the twin also says then where the value comes from
    told = servo_file.dumps(replace(changed, provenance={'drive.gain': Provenance('a slider')}))
    assert not models.follows('began', json.dumps({'servo_file': told}))

    models.asks(OWN)
    assert not models.follows('servo_file', OWN_TOLD)
    assert models.follows('servo_file', TOLD)  # at once, before the answer
    models.loaded(OWN, TOLD, 2000)
    assert models.running == TOLD and models.trial is None


def test_there_is_no_way_back_to_a_file_that_the_twin_never_ran():
    models = Models(GIVEN, 0.02)
    assert models.follows('began', json.dumps({'servo_file': OWN_TOLD}))
    assert (models.running, models.previous) == (OWN_TOLD, '')


@pytest.mark.parametrize('content', ['', '[1]', '[' * 100_000, '{"drive.gain": "x"}', '{"a": 1}',
                                     '{"drive.gain": 1e400}', '{"servo_file": "nothing"}'])
@pytest.mark.parametrize('kind', ['parameters', 'servo_file', 'began'])
def test_what_no_twin_says_changes_nothing(kind, content):
    models = Models(GIVEN, 0.02)
    with pytest.raises(ValueError, match=r'\w'):
        models.follows(kind, content)
    assert models.running == GIVEN
