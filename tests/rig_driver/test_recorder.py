"""The recorder as its users run it: a process beside others, ended by signals."""

from pathlib import Path
import resource
import shutil
import signal
import subprocess
import sys
import time

from driver_bench import wait_for
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.experimental import EventsExecutor
from rclpy.task import Future
from std_msgs.msg import String

from servo_rig_driver.record.growing_bag import RecordingFile
from servo_rig_driver.record.last_messages import take_what_has_come
from servo_rig_driver.record.sequence_loss import block_of, SequenceWatch
from servo_twin.bag import read_recording
from servo_twin_msgs.msg import Prediction

SOURCE = Path(__file__).parents[1] / 'support' / 'sample_source.py'
SERVO = Path(__file__).parents[2] / 'config' / 'servos' / 'rv_bench.yaml'
TOPICS = 'topics:=[encoder, torque, current]'


class Recording:
    """A recorder process; its bag and, once ended, what it said."""

    def __init__(self, folder: Path, *parameters: str, **options) -> None:
        self.bag = folder / 'bag'
        arguments = [f'output:={self.bag}', TOPICS, *parameters]
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'servo_rig_driver.record.recorder_node', '--ros-args',
             *(part for argument in arguments for part in ('-p', argument))],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)

    def end(self, number: int = signal.SIGINT) -> str:
        if self.process.poll() is None:
            self.process.send_signal(number)
        out, err = self.process.communicate(timeout=60.0)
        return out + err

    def __enter__(self) -> 'Recording':
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()


def publish(*arguments: object) -> None:
    subprocess.run([sys.executable, SOURCE, *map(str, arguments)], check=True, timeout=60)


@pytest.mark.ros
@pytest.mark.parametrize('blocks, rate, size', [(3000, 1000.0, 1), (800, 4000.0, 10)])
def test_it_records_every_sample(tmp_path, blocks, rate, size):
    with Recording(tmp_path, f'servo_file:={SERVO}', 'family:=speed_ladder', 'replicate:=2',
                   'note:=short') as recording:
        publish(blocks, rate, size)
        said = recording.end(signal.SIGTERM if size == 10 else signal.SIGINT)
    assert recording.process.returncode == 0
    assert f'/encoder: {blocks} messages, {blocks * size} samples, 0 lost' in said
    assert (recording.bag / 'metadata.yaml').exists()
    again = read_recording(recording.bag)
    assert again.warnings == ()
    assert (again.servo, again.family, again.replicate) == ('rv_bench', 'speed_ladder', 2)
    assert again.servo_file == SERVO.read_text() and again.period == 1.0 / rate
    for name in ('motor_position', 'torque', 'temperature'):
        assert np.array_equal(again[name], np.arange(float(blocks * size)))


@pytest.mark.ros
def test_it_loses_the_last_chunk_only_when_it_is_killed(tmp_path):
    with Recording(tmp_path, 'chunk_seconds:=0.1') as recording:
        with subprocess.Popen([sys.executable, SOURCE, '100000', '1000', '1']) as source:
            try:
                until = time.monotonic() + 60.0
                while not _grown(recording.bag, 60_000) and time.monotonic() < until:
                    time.sleep(0.01)
                before = _samples(recording.bag)
                recording.end(signal.SIGKILL)
            finally:
                source.terminate()
    assert not (recording.bag / 'metadata.yaml').exists()
    again = read_recording(recording.bag)
    assert len(again) >= before > 100
    assert np.array_equal(again['load_position'], again.sequence + np.arange(float(len(again))))
    assert any('was cut' in warning for warning in again.warnings)


def _grown(bag: Path, size: int) -> bool:
    return sum(file.stat().st_size for file in bag.glob('*.mcap')) > size


def _holds(bag: Path, words: bytes) -> bool:
    """Whether a message of a bag that is still written has these bytes."""
    try:
        return any(words in message.data for file in bag.glob('*.mcap')
                   for _, _, message in NonSeekingReader(file.open('rb')).iter_messages(
                       log_time_order=False))
    except (McapError, EOFError):  # its last chunk is not whole yet
        return False


def _samples(bag: Path) -> int:
    """Return what can be read while the recorder still writes."""
    return len(read_recording(bag))


@pytest.mark.ros
def test_it_says_what_was_lost_on_the_way(tmp_path):
    with Recording(tmp_path, 'topics:=[encoder, torque, current, /diagnostics]') as recording:
        publish(1500, 1000.0, 1, 100, 101, 400)
        said = recording.end()
    assert '/torque: 1497 messages, 1497 samples, 3 lost in 2 gaps' in said
    again = read_recording(recording.bag)
    assert list(np.flatnonzero(np.isnan(again['voltage']))) == [100, 101, 400]
    from rosbags.highlevel import AnyReader
    with AnyReader([recording.bag]) as reader:
        first = next(iter(reader.messages()))
        assert first[0].topic == '/recording'
        health = [reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages(
            [c for c in reader.connections if c.topic == '/diagnostics'])]
    assert health[-1].status[0].message.endswith('recording; 9 samples lost')  # it may be long ago
    assert health[-1].status[0].name == '/recorder: recording'
    assert {'lost /encoder': '3 samples in 2 gaps'}.items() <= {
        item.key: item.value for item in health[-1].status[0].values}.items()


@pytest.mark.ros
def test_it_names_the_nodes_that_publish_what_one_alone_should(tmp_path):
    context = Context()
    rclpy.init(context=context)
    try:
        nodes = [rclpy.create_node(name, context=context) for name in ('left', 'right')]
        for node in nodes:
            node.create_publisher(Prediction, 'twin/prediction', 10)
        with Recording(tmp_path, 'topics:=[twin/prediction, /diagnostics]',
                       'chunk_seconds:=0.1') as recording:
            wait_for(lambda: _holds(recording.bag, b"/twin/prediction is published by ['/left', "
                                    b"'/right']: what they say is mixed"), 'it names them', 60.0)
            recording.end()
    finally:
        rclpy.try_shutdown(context=context)


@pytest.mark.ros
def test_what_has_come_is_taken_down_before_it_ends():
    context, heard = Context(), []
    rclpy.init(context=context)
    try:
        node, executor = rclpy.create_node('last', context=context), EventsExecutor(
            context=context)
        executor.add_node(node)
        node.create_subscription(String, 'words', heard.append, 1000)
        talker = node.create_publisher(String, 'words', 1000)
        wait_for(talker.get_subscription_count, 'the reader is there')
        for k in range(300):
            talker.publish(String(data=str(k)))
        assert talker.wait_for_all_acked(Duration(seconds=60.0))
        assert not heard
        take_what_has_come(executor, Future())
        assert [one.data for one in heard] == [str(k) for k in range(300)]
        executor.remove_node(node)
        node.destroy_node()
    finally:
        rclpy.try_shutdown(context=context)


@pytest.mark.ros
def test_it_warns_that_no_sample_comes_and_finds_a_shipped_servo(tmp_path):
    from rosbags.highlevel import AnyReader
    with Recording(tmp_path, 'topics:=[encoder, /diagnostics]', 'chunk_seconds:=0.1',
                   'servo_file:=rv_plain') as recording:
        wait_for(lambda: _holds(recording.bag, b'no sample came since it began'), 'it warns', 60.0)
        recording.end()
    with AnyReader([recording.bag]) as reader:
        said = {c.topic: reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages()}
    assert said['/recording'].servo == 'rv_plain'
    assert said['/diagnostics'].status[0].level == 1
    assert 'no sample came since it began' in said['/diagnostics'].status[0].message


@pytest.mark.ros
@pytest.mark.parametrize('parameter, text', [
    ('topics:=[pressure]', "'pressure' has no type; write 'name:package/msg/Type'"),
    ('topics:=["x:no_msgs/msg/X"]', 'no_msgs'),
    ('servo_file:=/nowhere.yaml', '/nowhere.yaml'),
    ('servo_file:=/bin/true', '/bin/true is no text'),
    ('output:=/tmp', '/tmp exists already'), ('output:=~', f'{Path.home()} exists already')])
def test_it_refuses_what_it_cannot_record(tmp_path, parameter, text):
    with Recording(tmp_path, parameter) as recording:
        _, said = recording.process.communicate(timeout=60.0)
    assert recording.process.returncode == 2
    assert text in said and 'Traceback' not in said


@pytest.mark.ros
def test_it_keeps_what_is_on_disk_when_the_disk_is_full(tmp_path):
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))

    with Recording(tmp_path, 'chunk_seconds:=0.1', preexec_fn=limit) as recording:
        with subprocess.Popen([sys.executable, SOURCE, '100000', '2000', '1']) as source:
            try:
                out, err = recording.process.communicate(timeout=60)
            finally:
                source.terminate()
    assert recording.process.returncode == 1
    assert 'recorded' in out and 'File too large' in err and 'Traceback' not in err
    assert len(read_recording(recording.bag)) > 100


@pytest.mark.ros
@pytest.mark.parametrize('moved', [True, False])
def test_it_ends_and_says_so_when_its_folder_is_moved_or_removed(tmp_path, moved):
    with Recording(tmp_path, 'chunk_seconds:=0.1') as recording:
        with subprocess.Popen([sys.executable, SOURCE, '100000', '1000', '1']) as source:
            try:
                wait_for(lambda: _grown(recording.bag, 60_000), 'a grown bag')
                if moved:
                    recording.bag.rename(tmp_path / 'elsewhere')
                else:
                    shutil.rmtree(recording.bag)
                err = recording.process.communicate(timeout=30)[1]
            finally:
                source.terminate()
    assert recording.process.returncode == 1
    assert 'was removed or moved while it was written' in err and 'Traceback' not in err
    assert not moved or len(read_recording(tmp_path / 'elsewhere')) > 100


@pytest.mark.ros
@pytest.mark.parametrize('error', ['MemoryError', 'growing_bag.zstd.ZstdError'])
def test_it_keeps_what_is_on_disk_and_says_so_when_no_memory_is_left_at_its_end(tmp_path, error):
    short = ('import sys\nfrom servo_rig_driver.record import growing_bag, recorder_node\n'
             f'def close(_):\n    raise {error}("no room for a chunk")\n'
             'growing_bag.RecordingFile.close = close\nsys.exit(recorder_node.main())')
    bag = tmp_path / 'bag'
    with subprocess.Popen(
            [sys.executable, '-c', short, '--ros-args', '-p', f'output:={bag}', '-p', TOPICS, '-p',
             'chunk_seconds:=0.1'],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert 'recording to' in process.stdout.readline()
        with subprocess.Popen([sys.executable, SOURCE, '100000', '2000', '1']) as source:
            file = bag / 'bag.mcap'
            wait_for(lambda: file.exists() and file.stat().st_size > 60_000, 'a grown bag')
            process.send_signal(signal.SIGINT)
            err = process.communicate(timeout=60)[1]
            source.terminate()
    assert process.returncode == 1
    assert f'recording to {bag} stopped: no room for a chunk' in err and 'Traceback' not in err
    assert len(read_recording(bag)) > 100


def test_it_reads_the_sequence_off_the_bytes():
    from servo_twin.bag.message_definitions import own_types
    types = own_types()
    for frame in ('', 'rig', 'a_longer_frame'):
        header = types.types['std_msgs/msg/Header'](
            types.types['builtin_interfaces/msg/Time'](3, 4), frame)
        data = types.serialize_cdr(types.types['servo_twin_msgs/msg/Torque'](
            header, 2**40 + 7, 1e-3, np.zeros(5), np.zeros(5)), 'servo_twin_msgs/msg/Torque')
        assert block_of(bytes(data)) == (2**40 + 7, 5)


def test_it_counts_gaps_and_restarts():
    watch = SequenceWatch()
    for first in (10, 15, 30, 35, 0, 5):
        watch.take(first, 5)
    assert (watch.samples, watch.lost, watch.gaps, watch.restarts) == (30, 10, 1, 1)


def test_its_bags_tell_the_unit_of_each_field_and_number_the_messages(tmp_path):
    import os

    from mcap.reader import make_reader

    from servo_rig_driver.record.growing_bag import RecordingFile
    from servo_twin.bag.message_definitions import own_types
    types = own_types()
    header = types.types['std_msgs/msg/Header'](
        types.types['builtin_interfaces/msg/Time'](3, 4), '')
    data = bytes(types.serialize_cdr(types.types['servo_twin_msgs/msg/Torque'](
        header, 7, 1e-3, np.zeros(5), np.zeros(5)), 'servo_twin_msgs/msg/Torque'))
    shares = [Path(prefix) / 'share' for prefix in os.environ['AMENT_PREFIX_PATH'].split(':')]
    bag = RecordingFile(tmp_path / 'bag', {
        '/torque': 'servo_twin_msgs/msg/Torque', '/joint_states': 'sensor_msgs/msg/JointState'},
        shares, chunk_bytes=4096)
    for k in range(200):
        bag.write('/torque', k, data)
    bag.close()
    with (tmp_path / 'bag' / 'bag.mcap').open('rb') as file:
        reader = make_reader(file)
        schemas = {s.name: s.data.decode() for s in reader.get_summary().schemas.values()}
        numbers = [message.sequence for _, _, message in reader.iter_messages(['/torque'])]
    assert 'N m, on the load, at the load shaft' in schemas['servo_twin_msgs/msg/Torque']
    assert 'Nm or N' in schemas['sensor_msgs/msg/JointState']
    assert 'MSG: std_msgs/Header\n' in schemas['sensor_msgs/msg/JointState']
    assert numbers == list(range(200))


def test_its_memory_does_not_grow_with_what_it_has_written(tmp_path):
    import tracemalloc

    from mcap.reader import make_reader

    from servo_rig_driver.record.growing_bag import RecordingFile
    bag = RecordingFile(tmp_path / 'bag', {'/joint_states': 'sensor_msgs/msg/JointState'}, [])
    chunks = 6000  # an hour has 7200

    def write(first, last):
        for k in range(first, last):
            bag.write('/joint_states', k, b'of no matter')
            bag.flush(now=True)
    write(0, 1000)
    tracemalloc.start()
    try:
        write(1000, chunks)
        grown = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    bag.close()
    assert grown < 20 * (chunks - 1000)  # bytes; it had been 400 a chunk
    with (tmp_path / 'bag' / 'bag.mcap').open('rb') as file:
        indexes = make_reader(file).get_summary().chunk_indexes
    assert [one.message_start_time for one in indexes] == list(range(chunks))


def test_what_another_recorder_made_meanwhile_is_left_to_that_one(tmp_path, monkeypatch):
    bag = tmp_path / 'bag'
    bag.mkdir()
    monkeypatch.setattr(Path, 'exists', lambda _: False)  # as when both have looked
    with pytest.raises(FileExistsError, match='exists already; choose another output'):
        RecordingFile(bag, {'/note': 'std_msgs/msg/String'}, [])
    assert not list(bag.iterdir())
