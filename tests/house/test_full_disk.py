"""On a disk that is full: a command ..."""

from contextlib import suppress
import os
from pathlib import Path
import subprocess
import sys
from types import SimpleNamespace

import pytest

from servo_identify.cli import main
from servo_identify.fit.estimate import Estimate
from servo_rig_driver.record.growing_bag import RecordingFile
from servo_twin.cli import main as twin
from servo_twin.description.whole_file import write_whole

EXAMPLE = Path(__file__).parents[2] / 'docs' / 'example'
RUN, FAN = str(EXAMPLE / 'runs' / 'multisine_1.csv'), str(EXAMPLE / 'fan.yaml')


@pytest.fixture
def small(tmp_path):
    """Yield a folder with room for 1 MiB, and a function that fills it."""
    folder = tmp_path / 'small'
    folder.mkdir()
    if os.geteuid() or subprocess.run(['mount', '-t', 'tmpfs', '-o', 'size=1m', 'tmpfs', folder],
                                      capture_output=True).returncode:
        pytest.skip('only root may mount a small disk')

    def fill():
        with pytest.raises(OSError, match='No space left'):
            with (folder / 'fill').open('wb', buffering=0) as file:
                while True:
                    file.write(bytes(4096))

    yield folder, fill
    subprocess.run(['umount', folder], check=True)


@pytest.mark.parametrize(('command', 'words'), [
    (main, ['fit', RUN, '--servo', FAN, '-o', '{}/new.yaml']),
    (main, ['diagnose', RUN, '--servo', FAN, '-o', '{}/report']),
    (main, ['import', RUN, '--servo', FAN, '-o', '{}/bag']),
    (main, ['check', RUN, '--servo', FAN, '--json', '{}/found.json']),
    (twin, ['run', '-o', '{}/run'])])
def test_says_so_before_the_work_is_done(command, words, small, capsys, monkeypatch):
    folder, fill = small
    fill()
    monkeypatch.setattr('servo_twin.recording.recording.Recording.__post_init__', None)
    assert command([word.format(folder) for word in words]) == 2
    assert 'nothing can be written there (No space left on device)' in capsys.readouterr().err


def test_leaves_a_file_as_it_was_where_there_is_no_room_for_the_new_one(small):
    folder, fill = small
    old = folder / 'report.json'
    old.write_text('the old one')
    fill()
    with pytest.raises(OSError, match=f'{old} cannot be written: No space left on device'):
        write_whole(old, 'x' * 100_000)
    assert old.read_text() == 'the old one'
    assert sorted(one.name for one in folder.iterdir()) == ['fill', 'report.json']


@pytest.mark.parametrize('write', [
    lambda old: main(['info', RUN, '--json', str(old), '--force']),
    lambda old: Estimate.save(SimpleNamespace(as_dict=dict), old)])
def test_leaves_the_json_of_a_command_as_it_was_where_the_room_ends(write, tmp_path, monkeypatch,
                                                                    capsys):
    def ends(path, text, *_):
        with path.open('w') as file:
            file.write(text[:1])
        raise OSError(28, 'No space left on device')

    old = tmp_path / 'old.json'
    old.write_text('the old one')
    monkeypatch.setattr(Path, 'write_text', ends)
    with suppress(OSError):
        assert write(old) == 2
        assert f'{old} cannot be written: No space left' in capsys.readouterr().err
    assert old.read_text() == 'the old one'


def test_writes_what_is_no_file_as_it_is_and_through_a_link(tmp_path):
    pipe, link, file = (tmp_path / name for name in ('pipe', 'link', 'file'))
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_whole(pipe, 'told')
    assert os.read(reader, 10) == b'told'
    os.close(reader)
    assert pipe.is_fifo()
    link.symlink_to(file)
    write_whole(link, 'told')
    assert link.is_symlink() and file.read_text() == 'told'


def test_names_the_file_of_a_bag_that_finds_no_room(small):
    folder, fill = small
    bag = RecordingFile(folder / 'bag', {'/note': 'std_msgs/msg/String'}, [])
    fill()
    with pytest.raises(OSError, match=f'No space left on device.*{folder}/bag'):
        for k in range(100):
            bag.write('/note', k, os.urandom(10_000))
            bag.flush(now=True)
    assert bag.pending > 0.0
    bag.abort()


@pytest.mark.ros
def test_a_recorder_ends_with_the_file_and_the_time_that_is_lost(small):
    folder, fill = small
    fill()
    ended = subprocess.run(
        [sys.executable, '-m', 'servo_rig_driver.record.recorder_node', '--ros-args', '-p',
         f'output:={folder}/bag'], capture_output=True, text=True, timeout=60.0)
    assert ended.returncode == 2 and 'Traceback' not in ended.stderr
    assert f"recorder: [Errno 28] No space left on device: '{folder}/bag" in ended.stderr
