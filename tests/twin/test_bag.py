"""Bags: what is written is what any reader reads, and what any writer wrote is read."""

from pathlib import Path

from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapWriter
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
import yaml

from servo_twin.bag import (
    read_predictions,
    read_recording,
    write_predictions,
    write_recording,
)
from servo_twin.bag.bag_topics import SAMPLE_TOPICS
from servo_twin.bag.message_definitions import own_types
from servo_twin.recording.recording import (
    BALANCES,
    COLUMNS,
    COMPARED,
    PREDICTED,
    Predictions,
    Recording,
)

FLOATS = st.floats(width=64, allow_nan=True, allow_infinity=True)


def recording(size: int = 1000, seed: int = 1, **fields) -> Recording:
    random = np.random.default_rng(seed)
    columns = {name: random.standard_normal(size) for name in COLUMNS}
    columns['external_torque'] = np.full(size, np.nan)
    return Recording('demo', 1e-3, columns, **{'start': 1_700_000_000.25, 'family': 'speed_ladder',
                                               'replicate': 3, 'servo': 'bench',
                                               'servo_file': 'drive: {}\n', 'note': 'für alle'}
                     | fields)


def same_bits(a: Recording, b: Recording) -> bool:
    return all(np.array_equal(a[name].view('u8'), b[name].view('u8')) for name in COLUMNS)


def message(types, kind: str, sequence: int, stamp: int, size: int, **fields):
    """Return a sample message, ones where nothing is given, and its bytes."""
    name = f'servo_twin_msgs/msg/{kind}'
    header = types.types['std_msgs/msg/Header'](
        types.types['builtin_interfaces/msg/Time'](*divmod(stamp, 10**9)), fields.pop('frame', ''))
    lists = [field for field, _ in types.fielddefs[name][1]][3:]
    values = {field: np.full(size, 1.0) for field in lists} | {'period': 1e-3} | fields
    return bytes(types.serialize_cdr(types.types[name](
        header=header, sequence=sequence, **values), name))


def write_by_rosbags(path: Path, sequences: dict[str, list[int]], size: int = 1,
                     storage: StoragePlugin = StoragePlugin.MCAP, stamp=lambda s: s * 10**6,
                     period=lambda s: 1e-3, prefix: str = '/',
                     compression: CompressionMode | None = None) -> None:
    types = own_types()
    writer = Writer(path, version=9, storage_plugin=storage)
    if compression is not None:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer as bag:
        for topic, order in sequences.items():
            kind = SAMPLE_TOPICS[topic][0]
            channel = bag.add_connection(prefix + topic, f'servo_twin_msgs/msg/{kind}',
                                         typestore=types)
            for number, k in enumerate(order):
                field = SAMPLE_TOPICS[topic][1][0]
                at = stamp[topic] if isinstance(stamp, dict) else stamp
                instant = at[number] if isinstance(at, list) else at(k)
                data = message(types, kind, k, instant, size, period=period(k),
                               **{field: k + np.arange(size) * 1.0})
                bag.write(channel, number, data)


@pytest.mark.parametrize('block_size', [1, 7, 10, 1000, 4096])
def test_it_reads_back_every_bit_at_any_block_size(tmp_path, block_size):
    original = recording(1003)
    write_recording(tmp_path / 'b', original, block_size)
    again = read_recording(tmp_path / 'b')
    assert same_bits(original, again)
    assert (again.period, again.start, again.sequence) == (1e-3, 1_700_000_000.25, 0)
    assert (again.family, again.replicate, again.servo) == ('speed_ladder', 3, 'bench')
    assert (again.servo_file, again.note, again.warnings) == ('drive: {}\n', 'für alle', ())
    assert len(again.digest) == 64
    assert read_recording(tmp_path / 'b', digest=False).digest == ''


@settings(max_examples=30, deadline=None, suppress_health_check=[
    HealthCheck.function_scoped_fixture])
@given(values=st.lists(FLOATS, min_size=1, max_size=40), block_size=st.integers(1, 12),
       period=st.floats(1e-6, 10.0), sequence=st.integers(0, 2**50),
       start=st.integers(0, 2 * 10**18), text=st.text(max_size=20).filter(lambda s: '\0' not in s))
def test_it_keeps_any_number_and_any_text(tmp_path_factory, values, block_size, period, sequence,
                                          start, text):
    path = tmp_path_factory.mktemp('bag') / 'b'
    columns = {name: np.array(values) for name in COLUMNS}
    original = Recording('x', period, columns, start=start / 1e9, sequence=sequence, note=text)
    write_recording(path, original, block_size)
    again = read_recording(path)
    assert same_bits(original, again)
    assert again.period == period and again.sequence == sequence and again.note == text
    assert abs(again.start - original.start) <= 1e-9


def test_rosbags_reads_the_same_bits_and_stamps(tmp_path):
    original = recording(1003)
    write_recording(tmp_path / 'b', original, 10)
    found = {name: [] for name in COLUMNS}
    stamps = []
    with AnyReader([tmp_path / 'b']) as reader:
        first = next(iter(reader.messages()))
        assert first[0].topic == '/recording'
        for connection, time, raw in reader.messages():
            item = reader.deserialize(raw, connection.msgtype)
            if connection.topic == '/recording':
                continue
            if connection.topic == '/coupled/encoder':
                found['coupled_position'].append(item.load_position)
                continue
            for name in SAMPLE_TOPICS[connection.topic[1:]][1]:
                found[name].append(getattr(item, name))
            if connection.topic == '/encoder':
                stamps.append(item.header.stamp.sec * 10**9 + item.header.stamp.nanosec)
                assert item.sequence == 10 * (len(stamps) - 1) and time == stamps[-1]
    for name in COLUMNS:
        assert np.array_equal(np.concatenate(found[name]).view('u8'), original[name].view('u8'))
    assert np.array_equal(np.diff(stamps), np.full(100, 10**7))


def test_the_mcap_library_reads_what_is_written(tmp_path):
    write_recording(tmp_path / 'b', recording(1003), 10)
    [file] = (tmp_path / 'b').glob('*.mcap')
    with file.open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary.statistics.message_count == 1 + 4 * 101
        assert {s.name for s in summary.schemas.values()} == {
            f'servo_twin_msgs/msg/{kind}' for kind in ('RecordingInfo', 'Encoder', 'Torque',
                                                       'Current')}
        assert all('float64' in s.data.decode() or 'servo_file' in s.data.decode()
                   for s in summary.schemas.values())
        messages = list(reader.iter_messages())
        assert messages[0][1].topic == '/recording'
        assert [m[2].log_time for m in messages] == sorted(m[2].log_time for m in messages)
        with AnyReader([tmp_path / 'b']) as other:
            assert sorted(m[2].data for m in messages) == sorted(
                bytes(raw) for _, _, raw in other.messages())


@pytest.mark.parametrize('storage, compression', [
    (StoragePlugin.MCAP, None), (StoragePlugin.MCAP, CompressionMode.STORAGE),
    (StoragePlugin.MCAP, CompressionMode.MESSAGE), (StoragePlugin.MCAP, CompressionMode.FILE),
    (StoragePlugin.SQLITE3, None)])
def test_it_reads_what_rosbags_wrote_in_any_storage(tmp_path, storage, compression):
    order = list(range(0, 600, 3))
    write_by_rosbags(tmp_path / 'b', dict.fromkeys(SAMPLE_TOPICS, order), 3, storage,
                     compression=compression)
    again = read_recording(tmp_path / 'b')
    assert np.array_equal(again['motor_position'], np.arange(600.0))
    assert np.array_equal(again['current'], np.arange(600.0))
    assert 'no message on /recording' in again.warnings[0]


@pytest.mark.parametrize('options', [
    {'compression': CompressionType.NONE}, {'compression': CompressionType.LZ4},
    {'compression': CompressionType.ZSTD, 'index_types': IndexType.NONE},
    {'use_chunking': False}, {'chunk_size': 1000, 'enable_crcs': False},
    {'repeat_channels': False, 'repeat_schemas': False}])
def test_it_reads_what_the_mcap_library_wrote(tmp_path, options):
    types = own_types()
    with (tmp_path / 'b.mcap').open('wb') as stream:
        writer = McapWriter(stream, **options)
        writer.start()
        for k in range(-1, 400):
            for topic in ('encoder', 'current'):
                name = f'servo_twin_msgs/msg/{SAMPLE_TOPICS[topic][0]}'
                if k < 0:
                    text = types.generate_msgdef(name, ros_version=2)[0]
                    schema = writer.register_schema(name, 'ros2msg', text.encode())
                    writer.register_channel(f'/{topic}', 'cdr', schema)
                    continue
                field = SAMPLE_TOPICS[topic][1][0]
                data = message(types, SAMPLE_TOPICS[topic][0], k, k * 10**6, 1,
                               **{field: np.full(1, float(k))})
                writer.add_message(1 + (topic == 'current'), k, data, k)
        writer.finish()
    again = read_recording(tmp_path / 'b.mcap')
    assert np.array_equal(again['motor_position'], np.arange(400.0))
    assert np.array_equal(again['current'], np.arange(400.0))


def test_it_reads_a_bag_in_several_files(tmp_path):
    folder = tmp_path / 'b'
    for part in range(12):
        order = list(range(50 * part, 50 * part + 50))
        write_by_rosbags(tmp_path / str(part), dict.fromkeys(SAMPLE_TOPICS, order))
        folder.mkdir(exist_ok=True)
        (tmp_path / str(part) / f'{part}.mcap').rename(folder / f'b_{part}.mcap')
    again = read_recording(folder)
    assert np.array_equal(again['torque'], np.arange(600.0))
    names = [f'b_{part}.mcap' for part in range(13)]
    (folder / 'metadata.yaml').write_text(
        yaml.safe_dump({'rosbag2_bagfile_information': {'relative_file_paths': names}}))
    again = read_recording(folder)
    assert len(again) == 600
    assert "metadata.yaml names files that are not there: ['b_12.mcap']" in again.warnings


def test_it_reads_the_twins_answer(tmp_path):
    rig = recording(505, sequence=20)
    random = np.random.default_rng(3)
    answer = Predictions(
        'p', 1e-3, {name: random.standard_normal(505) for name in PREDICTED},
        {name: random.standard_normal(505) for name in COMPARED + BALANCES},
        np.arange(4.0), np.arange(float(len(BALANCES))), rig.start, 20, 2)
    write_predictions(tmp_path / 'b', answer, rig, 10, namespace='rig1')
    again = read_predictions(tmp_path / 'b')
    for name in PREDICTED:
        assert np.array_equal(again.prediction[name], answer.prediction[name])
    for name in COMPARED + BALANCES:
        assert np.array_equal(again.residual[name], answer.residual[name])
    assert np.array_equal(again.channel_noise, answer.channel_noise)
    assert np.array_equal(again.balance_noise, answer.balance_noise)
    assert (again.sequence, again.restarts, len(again)) == (20, 2, 505)
    assert same_bits(rig, read_recording(tmp_path / 'b', 'rig1'))


def test_it_reads_a_message_with_a_frame_and_of_changing_length(tmp_path):
    types = own_types()
    with Writer(tmp_path / 'b', version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        for topic in ('encoder', 'current'):
            kind = SAMPLE_TOPICS[topic][0]
            channel = bag.add_connection(f'/{topic}', f'servo_twin_msgs/msg/{kind}',
                                         typestore=types)
            k = 0
            for number in range(60):
                size = 1 + number % 3
                bag.write(channel, number, message(
                    types, kind, k, k * 10**6, size, frame='rig' * (number % 2),
                    **{SAMPLE_TOPICS[topic][1][0]: k + np.arange(size) * 1.0}))
                k += size
    again = read_recording(tmp_path / 'b')
    assert np.array_equal(again['motor_position'], np.arange(120.0))
