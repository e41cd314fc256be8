"""Bags that end in the middle or are damaged: what is whole is read, the rest is said."""

import hashlib
from pathlib import Path
import shutil

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from servo_twin.bag import BagError, read_changes, read_recording, write_recording
from servo_twin.bag.bag_topics import COUPLED_TOPIC, sample_topics
from servo_twin.bag.bag_writing import BagWriter
from servo_twin.bag.message_definitions import own_types
from servo_twin.recording.recording import COLUMNS, Recording

SIZE = 20_000


def recording(size: int = SIZE) -> Recording:
    random = np.random.default_rng(5)
    return Recording('demo', 1e-3, {name: random.standard_normal(size) for name in COLUMNS})


@pytest.fixture(scope='module')
def whole(tmp_path_factory) -> tuple[bytes, Recording]:
    """Return the bytes of a bag of several chunks a topic, and what is in it."""
    path = tmp_path_factory.mktemp('whole') / 'b'
    original = recording()
    with BagWriter(path) as bag:
        bag.write_info(0, family='speed_ladder')
        topics = sample_topics(original, True)
        for first in range(0, SIZE, 2000):
            part = {topic: type(samples)(samples.message, {
                name: column[first:first + 2000] for name, column in samples.columns.items()})
                for topic, samples in topics.items()}
            bag.write_samples(part, start=first * 10**6, period=1e-3, sequence=first,
                              block_size=10)
    return next(path.glob('*.mcap')).read_bytes(), original


def cut(folder: Path, content: bytes) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    (folder / 'b_0.mcap').write_bytes(content)
    return folder


def assert_is_prefix(part: Recording, original: Recording) -> None:
    first = part.sequence
    for name in COLUMNS:
        mine, theirs = part[name], original[name][first:first + len(part)]
        known = ~np.isnan(mine)
        assert np.array_equal(mine[known], theirs[known])


@settings(max_examples=60, deadline=None)
@given(share=st.floats(0.0, 1.0))
def test_it_reads_a_cut_bag_up_to_the_last_whole_chunk(tmp_path_factory, whole, share):
    content, original = whole
    end = int(share * (len(content) - 1))
    path = cut(tmp_path_factory.getbasetemp() / 'cut', content[:end])
    try:
        part = read_recording(path)
    except BagError as error:
        assert end < len(content) // 8
        assert str(path) in str(error) or 'b_0.mcap' in str(error)
        return
    assert_is_prefix(part, original)
    assert any('the bag was cut: b_0.mcap ends after byte' in warning
               for warning in part.warnings) or len(part) == SIZE
    lost = (SIZE - len(part)) / SIZE
    assert lost <= 1.0 - share + 0.15
    assert part.family == 'speed_ladder'


def test_it_leaves_a_cut_bag_as_it_is(tmp_path, whole):
    path = cut(tmp_path / 'b', whole[0][:len(whole[0]) // 2])
    file = path / 'b_0.mcap'
    before = hashlib.sha256(file.read_bytes()).hexdigest(), file.stat().st_mtime_ns
    read_recording(path)
    assert (hashlib.sha256(file.read_bytes()).hexdigest(), file.stat().st_mtime_ns) == before
    assert [entry.name for entry in path.iterdir()] == ['b_0.mcap']


def test_it_reads_what_rosbags_left_when_it_was_killed(tmp_path):
    types = own_types()
    original = recording(30_000)
    topics = sample_topics(original, True)
    del topics[COUPLED_TOPIC]  # a rig of one axis
    kinds = {topic: samples.message for topic, samples in topics.items()}
    writer = Writer(tmp_path / 'b', version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    writer.open()
    channels = {topic: writer.add_connection(f'/{topic}', f'servo_twin_msgs/msg/{kind}',
                                             typestore=types) for topic, kind in kinds.items()}
    header = types.types['std_msgs/msg/Header']
    time = types.types['builtin_interfaces/msg/Time']
    for k in range(0, 30_000, 10):
        for topic, samples in topics.items():
            name = f'servo_twin_msgs/msg/{kinds[topic]}'
            writer.write(channels[topic], k, types.serialize_cdr(types.types[name](
                header=header(time(*divmod(k * 10**6, 10**9)), 'rig'), sequence=k, period=1e-3,
                **{n: c[k:k + 10] for n, c in samples.columns.items()}), name))
    writer.storage.bio.flush()
    content = next((tmp_path / 'b').glob('*.mcap')).read_bytes()
    writer.abort()
    part = read_recording(cut(tmp_path / 'c', content))
    assert_is_prefix(part, original)
    assert len(part) > 10_000
    assert np.isfinite(part['voltage']).all()
    assert any('was cut' in warning for warning in part.warnings)


@pytest.fixture(scope='module')
def eventful(tmp_path_factory):
    """Give the folder of a bag that holds changes of a twin."""
    types, kind = own_types(), 'servo_twin_msgs/msg/Event'
    path = tmp_path_factory.mktemp('eventful') / 'b'
    header = types.types['std_msgs/msg/Header']
    time = types.types['builtin_interfaces/msg/Time']
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        channel = writer.add_connection('/rig/events', kind, typestore=types)
        for k in range(40):
            writer.write(channel, k, types.serialize_cdr(types.types[kind](
                header=header(time(k, 0), 'rig'), source='/rig/twin', kind='parameters',
                text='gain' * (k % 3), sequence=k + 1, content='{"drive.gain": 0.2}'), kind))
    return path


@pytest.mark.parametrize('metadata', [None, b'', b'- 1\n', b'\xff\xfe'])
def test_changes_are_read_whatever_a_killed_recorder_left_of_the_metadata(
        metadata, eventful, tmp_path):
    bag = shutil.copytree(eventful, tmp_path / 'b')
    (bag / 'metadata.yaml').unlink()
    if metadata is not None:
        (bag / 'metadata.yaml').write_bytes(metadata)
    assert [one.sequence for one in read_changes(bag)] == list(range(1, 41))
    assert read_changes(bag, 'other') == []


def test_changes_are_read_of_a_bag_without_its_end_and_none_of_what_is_no_bag(eventful, tmp_path):
    content = next(eventful.glob('*.mcap')).read_bytes()
    assert len(read_changes(cut(tmp_path / 'c', content[:-200]))) == 40
    assert read_changes(cut(tmp_path / 'c', content[:60])) == []
    assert read_changes(cut(tmp_path / 'c', b'')) == []


def test_it_leaves_a_damaged_chunk_out_and_says_so(tmp_path, whole):
    content, original = whole
    damaged = bytearray(content)
    place = len(content) // 2
    damaged[place:place + 50] = bytes(50)
    part = read_recording(cut(tmp_path / 'b', bytes(damaged)))
    assert len(part) == SIZE
    assert_is_prefix(part, original)
    assert any('is damaged and left out' in warning for warning in part.warnings)
    assert any('2000 samples lost in 1 gaps' in warning for warning in part.warnings)


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_it_never_fails_otherwise_than_with_a_sentence(tmp_path_factory, data):
    folder = tmp_path_factory.getbasetemp() / 'fuzz'
    if not (folder / 'source').exists():
        folder.mkdir(exist_ok=True)
        write_recording(folder / 'source', recording(64), 10)
    content = bytearray(next((folder / 'source').glob('*.mcap')).read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        content[place] = data.draw(st.integers(0, 255))
    path = cut(folder / 'b', bytes(content))
    try:
        part = read_recording(path)
    except BagError as error:
        assert str(error)
    else:
        assert len(part) <= 10 * 64


@pytest.mark.parametrize('deep', ['[' * 100_000, '{a: ' * 100_000, '- ' * 100_000])
def test_metadata_that_nests_without_end_is_as_good_as_none(deep, tmp_path, whole):
    content, _ = whole
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'own.mcap').write_bytes(content)
    (tmp_path / 'bag' / 'metadata.yaml').write_text(f'rosbag2_bagfile_information: {deep}')
    assert len(read_recording(tmp_path / 'bag')) == SIZE


def test_it_says_when_nothing_whole_is_left(tmp_path, whole):
    with pytest.raises(BagError, match='no topic /encoder.*no topic|was cut'):
        read_recording(cut(tmp_path / 'b', whole[0][:200]))
    with pytest.raises(BagError, match='is no MCAP file: it is empty'):
        read_recording(cut(tmp_path / 'b', b''))
