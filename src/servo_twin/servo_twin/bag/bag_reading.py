"""
Bags read into columns, whoever wrote them and however they ended.

A bag is open as a recording of any length, of which parts are read as they are asked for. What is
held besides is where the messages lie: some hundred bytes for each chunk of the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
import hashlib
from pathlib import Path

import numpy as np

from ..recording.parts import parts_of
from ..recording.recording import BALANCES, COMPARED, PREDICTED, Predictions, Recording
from .bag_topics import COUPLED_COLUMN, COUPLED_FIELD, COUPLED_TOPIC, SAMPLE_TOPICS, TWIN_TOPICS
from .fits_in_memory import check_fits
from .message_sources import open_source, Source
from .rig_samples import RigSamples
from .rig_topics import info_of, prefix_of, prefixes, present

_REQUIRED = ('encoder', 'current')


class OpenRecording:
    """
    The recording in a bag, of any length, read part by part while the bag is open.

    Names are those of Recording; :meth:`part` returns one.
    """

    def __init__(self, source: Source, namespace: str | None, stretch: int | None) -> None:
        self._source = source
        prefix = prefix_of(source, namespace)
        warnings = list(source.warnings)
        coupled = {COUPLED_TOPIC: ('Encoder', (COUPLED_COLUMN,))}
        topics = present(source, prefix, SAMPLE_TOPICS | coupled, _REQUIRED)
        if 'torque' not in topics:
            warnings.append(f'no topic {prefix}torque: torque and external_torque are NaN')
        self._fields = {prefix + topic: {COUPLED_COLUMN: COUPLED_FIELD} if topic == COUPLED_TOPIC
                        else {name: name for name in names}
                        for topic, (_, names) in topics.items()}
        self._samples = RigSamples(source, list(self._fields), stretch)
        self._told: list[str] = []
        info = info_of(source, prefix, self._told)
        self.name, self.period = source.path.name, self._samples.period
        self.sequence, self.start = self._samples.sequence, seconds(self._samples.stamp)
        self._end = self._samples.end
        self._opened = warnings
        self._facts = {'name': self.name, 'period': self.period, **info}
        self.servo, self.servo_file = info.get('servo', ''), info.get('servo_file', '')
        self.family, self.replicate = info.get('family', ''), info.get('replicate', 0)
        self.note = info.get('note', '')

    def __len__(self) -> int:
        return self._end - self.sequence

    def cut(self, first: int, end: int) -> None:
        """Keep only the samples with running numbers from ``first`` to ``end``."""
        first, self._end = self._clipped(first, end)
        self.start += (first - self.sequence) * self.period
        self.sequence = first

    def _clipped(self, first: int, end: int) -> tuple[int, int]:
        first = min(max(first, self.sequence), self._end)
        return first, max(first, min(end, self._end))

    def rename(self, name: str) -> None:
        """Call the recording, and the parts of it, otherwise than the bag."""
        self.name = self._facts['name'] = name

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the end of the last one."""
        return len(self) * self.period

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be said of the recording; complete once all parts of it were read."""
        return (*self._opened, *self._samples.warnings, *self._told)

    def has(self, column: str) -> bool:
        """Whether the bag has the topic that carries a column."""
        return any(column in names for names in self._fields.values())

    @property
    def digest(self) -> str:
        """SHA-256 of the files, as hexadecimal digits; takes a while."""
        total = hashlib.sha256()
        for path in self._source.files:
            with path.open('rb') as file:
                while block := file.read(1 << 20):
                    total.update(block)
        return total.hexdigest()

    def part(self, first: int, end: int) -> Recording:
        """
        Return the samples with running numbers from ``first`` to ``end``, as far as there are.

        Its warnings and digest are empty: they are those of the whole.
        """
        first, end = self._clipped(first, end)
        found = self._samples.part(first, end)
        columns = {name: found[topic][field] for topic, names in self._fields.items()
                   for name, field in names.items() if field in found[topic]}
        return Recording(columns=columns or {'voltage': np.full(end - first, np.nan)},
                         start=self.start + (first - self.sequence) * self.period,
                         sequence=first, **self._facts)


class OpenPredictions:
    """What the twin answered in a bag, read part by part while the bag is open."""

    def __init__(self, source: Source, namespace: str | None, stretch: int | None) -> None:
        prefix = prefix_of(source, namespace)
        warnings = list(source.warnings)
        parts = {topic: (message, PREDICTED if part == 'prediction' else COMPARED + BALANCES)
                 for part, (topic, message) in TWIN_TOPICS.items()}
        self._fields = {prefix + topic: names for topic, (_, names) in
                        present(source, prefix, parts, tuple(parts)).items()}
        self._samples = {topic: RigSamples(source, [topic], stretch)
                         for topic in self._fields}
        both = list(self._samples.values())
        latest = max(both, key=lambda one: one.sequence)
        self.name, self.period = source.path.name, latest.period
        self.sequence, self.start = latest.sequence, seconds(latest.stamp)
        self._end = min(one.end for one in both)
        self._opened = warnings
        self._constants = {name: value for one in both for name, value in one.constants.items()}

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be said of the answer; complete once all parts of it were read."""
        return (*self._opened, *(said for one in self._samples.values() for said in one.warnings))

    def __len__(self) -> int:
        return max(0, self._end - self.sequence)

    def part(self, first: int, end: int) -> Predictions:
        """Return the answers to samples number ``first`` to ``end``, as far as there are."""
        first = min(max(first, self.sequence), self._end)
        end = max(first, min(end, self._end))
        prediction, residual = (
            {name: found.get(name, np.full(end - first, np.nan)) for name in names}
            for topic, names in self._fields.items()
            for found in [self._samples[topic].part(first, end)[topic]])
        return Predictions(
            name=self.name, period=self.period, sequence=first,
            start=self.start + (first - self.sequence) * self.period,
            prediction=prediction, residual=residual,
            channel_noise=np.asarray(self._constants['channel_noise']),
            balance_noise=np.asarray(self._constants['balance_noise']),
            restarts=int(self._constants['restarts']))


@contextmanager
def open_recording(path: Path | str, namespace: str | None = None,
                   stretch: int | None = None) -> Iterator[OpenRecording]:
    """
    Open a bag as a recording of any length.

    ``namespace`` picks one rig of several. ``stretch`` (0, 1, ...) picks a part of a bag whose
    driver was restarted; left out, the longest is read, with a warning. A bag whose writer was
    killed is read up to its last whole chunk, with a warning. Raises BagError for what is no bag,
    for missing topics, for several rigs without a namespace, and for time that runs backwards.
    """
    with open_source(Path(path)) as source:
        yield OpenRecording(source, namespace, stretch)


@contextmanager
def open_predictions(path: Path | str, namespace: str | None = None,
                     stretch: int | None = None) -> Iterator[OpenPredictions]:
    """Open what the twin answered; errors and arguments are those of :func:`open_recording`."""
    with open_source(Path(path)) as source:
        yield OpenPredictions(source, namespace, stretch)


def read_recording(path: Path | str, namespace: str | None = None,
                   stretch: int | None = None, digest: bool = True) -> Recording:
    """
    Read a bag into a recording; arguments and errors are those of :func:`open_recording`.

    ``digest``: whether to take the SHA-256 of the files, which takes a sixth as long again.
    Raises BagError as well where the memory that is free cannot hold all samples.
    """
    with open_recording(path, namespace, stretch) as bag:
        head = bag.part(bag.sequence, bag.sequence)
        columns = _room(path, head.columns, len(bag))
        for part in parts_of(bag):
            _put(part.columns, columns, part.sequence - bag.sequence)
        return replace(head, columns=columns, warnings=bag.warnings,
                       digest=bag.digest if digest else '')


def read_predictions(path: Path | str, namespace: str | None = None,
                     stretch: int | None = None) -> Predictions:
    """Read what the twin answered; errors and arguments are those of :func:`read_recording`."""
    with open_predictions(path, namespace, stretch) as bag:
        head = bag.part(bag.sequence, bag.sequence)
        prediction = _room(path, head.prediction, len(bag))
        residual = _room(path, head.residual, len(bag))
        for part in parts_of(bag):
            _put(part.prediction, prediction, part.sequence - bag.sequence)
            _put(part.residual, residual, part.sequence - bag.sequence)
        return replace(head, prediction=prediction, residual=residual, warnings=bag.warnings)


def _room(path: Path | str, names: Iterable[str], size: int) -> dict[str, np.ndarray]:
    """Return columns to be filled, in one piece; raises BagError where there is no room."""
    several = list(names)
    check_fits(Path(path), 8 * len(several) * size)
    return dict(zip(several, np.empty((len(several), size)), strict=True))


def _put(part: dict[str, np.ndarray], whole: dict[str, np.ndarray], at: int) -> None:
    for name, values in part.items():
        whole[name][at:at + len(values)] = values


def namespaces(path: Path | str) -> list[str]:
    """Return the namespaces of the rigs in a bag, '' for one without."""
    with open_source(Path(path)) as source:
        return [prefix.strip('/') for prefix in prefixes(source)]


def seconds(nanoseconds: int) -> float:
    """Return whole nanoseconds as the nearest float, which division of 1e18 by 1e9 is not."""
    whole, rest = divmod(nanoseconds, 10**9)
    return whole + rest / 1e9
