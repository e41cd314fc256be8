"""`servo-twin run`: real processes, brought up, watched and taken down."""

from itertools import count
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
from threading import Thread
from time import monotonic, sleep

from bench_recording import bench_recording, SERVO
import numpy as np
import pytest
import rclpy

from servo_twin.bag import read_predictions, read_recording, write_recording
from servo_twin.bringup.processes import BEGINS, ENDS, ProcessError, Processes, wait_until
from servo_twin.bringup.rig_and_twin import let_answer
from servo_twin.cli import main
from servo_twin_msgs.msg import Command

pytestmark = pytest.mark.ros
CONFIG = Path(SERVO).parent.parent
_numbers = count(1)


def run_command(folder, *more):
    """Return the command of a run in a namespace of its own: others stay there for a while."""
    return [sys.executable, '-m', 'servo_twin.cli', 'run', '-o', str(folder), '--namespace',
            f'run{next(_numbers)}', *map(str, more)]


def children_of(folder):
    """Return the processes whose command line names a folder."""
    found = []
    for entry in Path('/proc').iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            try:
                line = (entry / 'cmdline').read_bytes().decode(errors='replace')
            except OSError:
                continue
            if str(folder) in line:
                found.append(line)
    return found


@pytest.mark.long
def test_it_drives_twins_records_and_replays_the_emulated_bench(tmp_path):
    folder = tmp_path / 'bench'
    # four peaks: a machine that stands still for a moment misses one
    done = subprocess.run(run_command(
        folder, '--duration', 2, '--view', '--port', 0, '--setting', 'amplitude=0.4',
        '--setting', 'frequency=2'), capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    assert 'view: http://127.0.0.1:' in done.stdout
    assert 'playing sine: velocity of up to 0.4 rad/s' in done.stdout
    assert 'replay and live run are identical to the last bit' in done.stdout
    assert re.search(r', \d+ lost, ', done.stdout)  # a busy machine may lose some, and says so
    recording, live = read_recording(folder / 'sine'), read_predictions(folder / 'sine')
    assert recording.duration > 2.0
    assert recording.family == 'sine'
    assert recording.servo == 'rv_bench'
    assert len(live) == len(recording)
    assert np.nanmax(abs(recording['reference_velocity'])) == pytest.approx(0.4, rel=0.02)
    assert (folder / 'page.html').stat().st_size > 20_000
    assert children_of(folder) == []


@pytest.mark.long
def test_it_drives_a_drive_that_people_own_by_its_name_alone(tmp_path):
    folder = tmp_path / 'bench'
    done = subprocess.run(run_command(folder, '--driver', 'moteus', '--duration', 2),
                          capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    assert 'replay and live run are identical to the last bit' in done.stdout
    recording = read_recording(folder / 'sine')
    assert recording.servo == 'moteus'
    assert np.nanmax(abs(recording['motor_position'])) > 0.5
    assert children_of(folder) == []


@pytest.mark.long
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGHUP])
def test_it_leaves_no_process_behind_when_it_is_interrupted(tmp_path, number):
    folder = tmp_path / 'bench'
    process = subprocess.Popen(run_command(folder, '--duration', 60), stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True, start_new_session=True)
    bag, until = folder / 'sine', monotonic() + 90.0
    while sum(file.stat().st_size for file in bag.glob('*.mcap')) < 50_000:
        assert monotonic() < until and process.poll() is None, process.communicate()[0]
        sleep(0.05)
    process.send_signal(number)
    said, _ = process.communicate(timeout=60)
    assert 'ending early' in said
    assert 'identical to the last bit' in said
    assert process.returncode == 0, said
    assert children_of(folder) == []


@pytest.mark.long
@pytest.mark.parametrize('words, said', [
    (['--rig', '/nowhere/rig.yaml'], 'emulated_rig ended with status 1'),
    (['--family', 'nonsense'], 'player ended with status 2'),
    (['--rate', '7'], 'driver'),
])
def test_it_says_which_part_did_not_start_and_ends_the_others(tmp_path, words, said):
    folder = tmp_path / 'bench'
    done = subprocess.run(run_command(folder, '--duration', 2, *words), capture_output=True,
                          text=True, timeout=120)
    assert done.returncode == 1, done.stdout
    assert said in done.stderr
    assert children_of(folder) == []


@pytest.mark.parametrize(('words', 'said'), [
    (['run', '--rate', '0'], '0 is outside [1, 10000]'),
    (['run', '--duration', 'nan'], 'nan is outside [0.01, 1e+06]'),
    (['run', '--namespace', 'a//b'], "'a//b' is no namespace of ROS"),
    (['view', '--namespace', '9x'], "'9x' is no namespace of ROS")])
def test_it_says_what_a_rate_a_time_or_a_namespace_cannot_be(words, said, capsys):
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


@pytest.mark.long
def test_it_begins_nothing_in_a_namespace_where_another_run_is(tmp_path):
    folder = tmp_path / 'bench'
    rclpy.init()
    there = [rclpy.create_node(name, namespace='both') for name in ('driver', 'player', 'view')]
    there[1].create_publisher(Command, 'command', 10)
    named = 'driver runs; ', 'player runs; ', 'command is published by /both/player. '
    try:
        for _ in range(5):  # DDS may tell of some of them later than of the first
            done = subprocess.run(run_command(folder, '--namespace', 'both'), capture_output=True,
                                  text=True, timeout=60)
            assert done.returncode == 1, done.stdout
            if all(said in done.stderr for said in named):
                break
    finally:
        for node in there:
            node.destroy_node()
        rclpy.try_shutdown()
    for said in ('/both is taken: ', *named):
        assert said in done.stderr
    assert 'another --namespace, or another ROS_DOMAIN_ID' in done.stderr
    assert not (folder / 'logs' / 'player.log').exists()
    assert children_of(folder) == []


@pytest.mark.long
def test_it_says_that_a_bus_is_not_there(tmp_path):
    shipped = (CONFIG / 'driver.yaml').read_text()
    driver = tmp_path / 'driver.yaml'
    driver.write_text(shipped.replace('interface: unix_bus', 'interface: socketcan')
                      .replace('channel: servo_rig.can', 'channel: can_nowhere'))
    done = subprocess.run(run_command(tmp_path / 'rig', '--no-emulator', '--driver', driver),
                          capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert 'the driver cannot be configured' in done.stderr
    assert 'can_nowhere' in done.stderr


@pytest.mark.long
def test_it_says_what_a_real_drive_needs_where_the_driver_file_is_of_the_emulated_one(tmp_path):
    done = subprocess.run(run_command(tmp_path / 'rig', '--no-emulator', '--driver', 'odrive'),
                          capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert 'set bus.interface to socketcan and bus.channel to its device, such as can0' in (
        ' '.join(done.stderr.split()))


def test_it_refuses_a_servo_file_that_is_wrong_before_it_starts_anything(tmp_path, capsys):
    bad = tmp_path / 'bad.yaml'
    bad.write_text(SERVO.read_text().replace('ratio: {value: 161.0', 'ratio: {value: -1.0'))
    assert main(['run', '--servo', str(bad), '-o', str(tmp_path / 'out')]) == 2
    assert 'mechanism.ratio = -1 is outside' in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


def test_it_looks_at_a_bag_instead_of_a_rig(tmp_path, capsys):
    bag = write_recording(tmp_path / 'bag', bench_recording(0.5))
    assert main(['run', '--bag', str(bag), '-o', str(tmp_path / 'out')]) == 0
    assert (tmp_path / 'out' / 'page.html').exists()
    assert len(read_predictions(tmp_path / 'out' / 'answer')) == 500
    assert 'load_speed' in capsys.readouterr().out


def test_it_imports_a_table_and_looks_at_it(tmp_path, capsys):
    recording = bench_recording(0.5)
    table = tmp_path / 'own.csv'
    names = ('voltage', 'motor_position', 'load_position', 'torque', 'reference_velocity')
    rows = [f'{t:.6f},' + ','.join(repr(float(recording[n][k])) for n in names)
            for k, t in enumerate(recording.time)]
    table.write_text('\n'.join(['t,' + ','.join(names), *rows]) + '\n')
    assert main(['run', '--bag', str(table), '-o', str(tmp_path / 'none')]) == 2
    assert '--servo must say of which machine' in capsys.readouterr().err
    assert main(['run', '--bag', str(table), '--servo', str(SERVO), '-o',
                 str(tmp_path / 'out')]) == 0
    assert (tmp_path / 'out' / 'page.html').exists()


@pytest.mark.long
def test_it_takes_a_shipped_machine_by_its_name(tmp_path, shared_data, capsys):
    table = shared_data / 'emps' / 'DATA_EMPS.mat'
    out = str(tmp_path / 'out')
    assert main(['run', '--bag', str(table), '--servo', 'emps', '-o', out]) == 0
    assert 'torque_balance' in capsys.readouterr().out
    assert main(['run', '--bag', str(table), '--servo', 'none', '-o', out + '2']) == 2
    said = capsys.readouterr().err
    assert "'none' is neither a file nor shipped; shipped are [" in said and "'emps'" in said


def test_a_path_that_is_not_there_is_one_clear_line(tmp_path, capsys):
    assert main(['run', '--bag', '/nowhere.csv', '-o', str(tmp_path / 'out')]) == 2
    assert '/nowhere.csv does not exist' in capsys.readouterr().err


def test_processes_are_killed_when_they_do_not_listen(tmp_path, monkeypatch):
    monkeypatch.setattr('servo_twin.bringup.processes._PATIENCE', 0.2)
    deaf = ('import signal,time; signal.signal(2, signal.SIG_IGN); '
            'signal.signal(15, signal.SIG_IGN); print("deaf", flush=True); time.sleep(600)')
    with Processes(tmp_path) as processes:
        processes.start('deaf', [sys.executable, '-c', deaf])
        wait_until(lambda: 'deaf' in processes.said('deaf'), 'it listens', 60.0, processes)
        pid = processes.pids()['deaf']
    assert not Path(f'/proc/{pid}').exists()


def test_a_process_that_is_too_young_to_hear_is_ended_in_silence(tmp_path):
    with Processes(tmp_path) as processes:
        processes.start('young', [sys.executable, '-c', 'import time; print("here", flush=True); '
                                  'time.sleep(600)'])  # what any Python is until it imports us
        wait_until(lambda: 'here' in processes.said('young'), 'it runs', 60.0, processes)
    assert processes.said('young') == 'here\n'


ENDING = """
import signal, sys, time
from pathlib import Path
name, folder, *others = sys.argv[1:]
def end(*_):
    (folder / name).touch()
    if not others:
        time.sleep(0.5)
    while not all((folder / other).exists() for other in others):
        time.sleep(0.01)
    print(*sorted(told.name for told in folder.iterdir()), flush=True)
    sys.exit()
folder = Path(folder)
signal.signal(15, end)
print('ready', flush=True)
time.sleep(600)
"""
"""Ends once others were told to end as well, and says who was; alone after half a second."""


def test_what_holds_a_motor_ends_first_and_the_others_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr('servo_twin.bringup.processes._PATIENCE', 60.0)
    told, others = tmp_path / 'told', ('bus', 'rig', 'recorder', 'twin')
    told.mkdir()
    with Processes(tmp_path) as processes:
        for name in ('bus', 'driver', 'rig', 'recorder', 'twin'):
            processes.start(name, [sys.executable, '-c', ENDING, name, str(told), *(
                () if name == 'driver' else others)], first=name == 'driver')
        for name in ('driver', *others):
            wait_until(lambda name=name: 'ready' in processes.said(name), name, 60.0, processes)
    assert processes.said('driver').split() == ['ready', 'driver']
    for name in others:  # one after the other, the first would wait for the rest in vain
        assert processes.said(name).split() == ['ready', *sorted(('driver', *others))]


def test_a_process_that_ends_early_is_told_with_its_last_words(tmp_path):
    with Processes(tmp_path) as processes:
        processes.start('short', [sys.executable, '-c', 'print("no rig here"); exit(3)'])
        with pytest.raises(ProcessError, match='short ended with status 3:\n  no rig here'):
            wait_until(lambda: False, 'it runs', 10.0, processes)


VIEW = """
import sys, time
from pathlib import Path
print(sys.argv[1], flush=True)
while not Path(sys.argv[2]).exists():
    time.sleep(0.01)
print(*sys.argv[3:], flush=True)
time.sleep(600 * len(sys.argv[3:]))
"""


@pytest.mark.parametrize('answer', [f'{ENDS}: it lacks gravity', ''], ids=['ends', 'dies'])
def test_it_waits_at_its_end_for_a_diagnosis_that_runs(answer, tmp_path, capsys):
    asked = tmp_path / 'now'
    with Processes(tmp_path) as processes:
        processes.start('view', [sys.executable, '-c', VIEW, BEGINS, str(asked), *[answer][:bool(
            answer)]], may_end=True)
        wait_until(lambda: BEGINS in processes.said('view'), 'it begins', 60.0, processes)
        waiting = Thread(target=let_answer, args=[processes])
        waiting.start()
        waiting.join(1.0)
        assert waiting.is_alive()
        asked.touch()
        waiting.join(60.0)
        assert not waiting.is_alive()
        let_answer(processes)  # none runs any more: at once
    said = capsys.readouterr().out
    assert said.startswith('waiting for the diagnosis that the page asked for')
    assert said.splitlines()[1].strip() == (answer or BEGINS)


def test_waiting_names_what_did_not_happen():
    with pytest.raises(ProcessError, match='the sun is up: not within 0.05 s'):
        wait_until(lambda: False, 'the sun is up', 0.05)
