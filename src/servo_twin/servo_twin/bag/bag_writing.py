"""Bags written from columns: rosbag2 directories that any rosbag2 tool reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import yaml

from ..recording.recording import MAY_BE_EMPTY
from .bag_topics import Samples
from .cdr_layout import HEADER, lay_out, Layout
from .mcap_writing import ChannelEntry, McapFile, MESSAGE_HEAD
from .message_definitions import commented, own_types, PACKAGE

CHUNK_BYTES = 1 << 22
"""Uncompressed size that a chunk aims at."""

_QOS = {
    'history': 'keep_last', 'depth': 1000, 'reliability': 'reliable', 'durability': 'volatile',
    'deadline': {'sec': 9223372036, 'nsec': 854775807},
    'lifespan': {'sec': 9223372036, 'nsec': 854775807}, 'liveliness': 'automatic',
    'liveliness_lease_duration': {'sec': 9223372036, 'nsec': 854775807},
    'avoid_ros_namespace_conventions': False,
}


class BagError(ValueError):
    """A bag that cannot be read or written as asked."""


class BagWriter:
    """
    Writes a rosbag2 directory with MCAP storage, zstd chunks and embedded definitions.

    A context manager: on a clean exit it writes the summary and metadata.yaml; after an exception
    the bag stays as if its writer had been killed, and can be recovered; one without any message
    is removed. Raises BagError when ``path`` exists already.
    """

    def __init__(self, path: Path | str, namespace: str = '') -> None:
        self.path = Path(path)
        self.prefix = '/' + namespace.strip('/') + '/' if namespace.strip('/') else '/'
        if self.path.exists():
            raise BagError(f'{self.path} exists already; choose another name or remove it')
        self.path.mkdir(parents=True)
        self._file = McapFile(self.path / f'{self.path.name}_0.mcap')
        self._types = own_types()
        self._channels: dict[str, ChannelEntry] = {}
        self._topics: list[dict[str, Any]] = []

    def write_info(self, start: int, **fields: Any) -> None:
        """Write RecordingInfo at ``start`` (ns); ``fields`` are those of the message."""
        self._check_time(start)
        types = self._types
        message = types.types[f'{PACKAGE}/msg/RecordingInfo'](
            header=types.types['std_msgs/msg/Header'](stamp=self._stamp(start), frame_id=''),
            **{'servo': '', 'servo_file': '', 'family': '', 'replicate': 0, 'note': ''} | fields)
        payload = bytes(types.serialize_cdr(message, f'{PACKAGE}/msg/RecordingInfo'))
        records = np.zeros(1, np.dtype([('head', MESSAGE_HEAD), ('payload', f'V{len(payload)}')]))
        records['payload'] = np.void(payload)
        channel = self._channel('recording', 'RecordingInfo', 'transient_local')
        self._file.write_chunk([(channel, np.array([start]), records)])

    def write_samples(self, topics: Mapping[str, Samples], *, start: int, period: float,
                      sequence: int = 0, block_size: int = 100, first: int = 0) -> None:
        """
        Write a run of samples on several topics.

        ``start``: ns, instant of the run's first sample; ``period``: s; ``sequence``: its running
        number; ``first``: how many samples of the run were written before. The last message is
        shorter when the samples do not fill its block.
        Raises BagError when the columns differ in length or the time is outside of what a stamp
        can hold.
        """
        sizes = {len(column) for samples in topics.values() for column in samples.columns.values()}
        if len(sizes) != 1:
            raise BagError(f'{self.path}: columns of different lengths {sorted(sizes)}')
        size = sizes.pop()
        self._check_time(start)
        self._check_time(start + nanoseconds((first + size) * period))
        widest = max(len(self._types.fielddefs[f'{PACKAGE}/msg/{s.message}'][1])
                     for s in topics.values())
        per_chunk = max(1, CHUNK_BYTES // (100 + 8 * widest * block_size)) * block_size
        for topic, samples in topics.items():
            self._channel(topic, samples.message)
        for at in range(0, size, per_chunk):
            last = min(size, at + per_chunk)
            whole = at + (last - at) // block_size * block_size
            for topic, samples in topics.items():
                pieces = []
                for begin, end, length in ((at, whole, block_size), (whole, last, last - whole)):
                    if end > begin:
                        steps = first + np.arange(begin, end, length)
                        columns = {name: column[begin:end].reshape(-1, length)
                                   for name, column in samples.columns.items()}
                        pieces.append(self._records(
                            topic, replace(samples, columns=columns), sequence + steps,
                            start + instants(steps, period), period))
                self._file.write_chunk(pieces)

    def _records(self, topic: str, samples: Samples, numbers: np.ndarray, times: np.ndarray,
                 period: float) -> tuple[ChannelEntry, np.ndarray, np.ndarray]:
        """Return messages of equal length, their columns of shape (messages, samples each)."""
        length = next(iter(samples.columns.values())).shape[1]
        layout = self._layout(samples, length)
        shift = MESSAGE_HEAD.itemsize
        records = np.zeros(len(numbers), layout.dtype(shift + layout.size, shift))
        raw = records.view(np.uint8).reshape(len(numbers), -1)
        raw[:, shift:shift + 4] = np.frombuffer(HEADER, np.uint8)
        for offset, (_, count) in layout.lengths.items():
            word = np.frombuffer(np.uint32(count).tobytes(), np.uint8)
            raw[:, shift + offset:shift + offset + 4] = word
        records['header.stamp.sec'], records['header.stamp.nanosec'] = np.divmod(times, 10**9)
        records['sequence'] = numbers
        records['period'] = period
        for path, (kind, _) in layout.fields.items():
            if path in samples.columns:
                records[path] = samples.columns[path]
            elif path in samples.constants:
                records[path] = samples.constants[path]
            elif kind.subdtype and kind.base.kind == 'f':
                records[path] = np.nan
        return self._channels[topic], times, records

    def _layout(self, samples: Samples, length: int) -> Layout:
        name = f'{PACKAGE}/msg/{samples.message}'
        sizes = {'header.frame_id': 1} | {
            path: 0 for path in MAY_BE_EMPTY if path not in samples.columns}
        layout = lay_out(self._types, name, lambda path, _: sizes.get(path, length))
        unknown = sorted({*samples.columns, *samples.constants} - set(layout.fields))
        if unknown:
            raise BagError(f'{name} has no fields {unknown}; it has {list(layout.fields)}')
        return layout

    def _channel(self, topic: str, message: str, durability: str = 'volatile') -> ChannelEntry:
        if topic not in self._channels:
            name = f'{PACKAGE}/msg/{message}'
            qos = [_QOS | {'durability': durability}]
            self._channels[topic] = self._file.add_channel(
                self.prefix + topic, name, commented(name),
                yaml.safe_dump(qos, sort_keys=False).strip())
            self._topics.append({
                'name': self.prefix + topic, 'type': name, 'serialization_format': 'cdr',
                'offered_qos_profiles': qos,
                'type_description_hash': self._types.hash_rihs01(name)})
        return self._channels[topic]

    def _check_time(self, time: int) -> None:
        if not 0 <= time < 2**31 * 10**9:
            raise BagError(f'{self.path}: time {time / 1e9:.6g} s is outside of '
                           '[0, 2147483648) s, which is what a ROS stamp holds')

    def _stamp(self, nanoseconds: int) -> Any:
        seconds, rest = divmod(nanoseconds, 10**9)
        return self._types.types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=rest)

    def close(self) -> None:
        """Write the summary and metadata.yaml."""
        self._file.flush()
        start = min(self._file.start, self._file.end)
        span = {'starting_time': {'nanoseconds_since_epoch': start},
                'duration': {'nanoseconds': self._file.end - start},
                'message_count': sum(entry.count for entry in self._file.channels)}
        name = f'{self.path.name}_0.mcap'
        counts = [entry.count for entry in self._file.channels]
        information = {
            'version': 9, 'storage_identifier': 'mcap', 'relative_file_paths': [name], **span,
            'topics_with_message_count': [
                {'topic_metadata': topic, 'message_count': count}
                for topic, count in zip(self._topics, counts, strict=True)],
            'compression_format': '', 'compression_mode': '',
            'files': [{'path': name, **span}], 'custom_data': None, 'ros_distro': 'jazzy'}
        self._file.close(_dump(information))
        partial = self.path / 'metadata.yaml.tmp'
        partial.write_text(_dump({'rosbag2_bagfile_information': information}), 'utf8')
        partial.replace(self.path / 'metadata.yaml')

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.close()
        else:
            self._file.abort()
            if not self._file.channels:
                self._file.path.unlink()
                self.path.rmdir()


class _Plain(getattr(yaml, 'CSafeDumper', yaml.SafeDumper)):
    """YAML without anchors, which some rosbag2 readers do not resolve."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _dump(content: Any) -> str:
    return yaml.dump(content, Dumper=_Plain, sort_keys=False)


def instants(steps: np.ndarray, period: float) -> np.ndarray:
    """Return ns from the first sample to samples number ``steps``, int64, exact to 1 ns."""
    whole = round(period * 1e9)
    return steps * whole + np.rint(steps * (period * 1e9 - whole)).astype(np.int64)


def nanoseconds(seconds: float) -> int:
    """Return seconds as whole nanoseconds, without the rounding of a product of 1e18."""
    whole = int(seconds // 1.0)
    return whole * 10**9 + round((seconds - whole) * 1e9)
