"""Bags read into columns, whoever wrote them and however they ended."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
import hashlib
import os
from pathlib import Path
from typing import Any

import numpy as np

from ..recording.recording import BALANCES, COMPARED, PREDICTED, Predictions, Recording
from .bag_topics import COUPLED_COLUMN, COUPLED_FIELD, COUPLED_TOPIC, SAMPLE_TOPICS, TWIN_TOPICS
from .bag_writing import BagError
from .mcap_reading import DAMAGE
from .message_columns import decode, Run
from .message_definitions import deserialize, embedded_types, PACKAGE
from .message_sources import open_source, Source
from .sample_grid import join, stretches, TimeError, Track, track

_REQUIRED = ('encoder', 'current')


def read_recording(path: Path | str, namespace: str | None = None,
                   stretch: int | None = None, digest: bool = True) -> Recording:
    """
    Read a bag into a recording.

    ``namespace`` picks one rig of several. ``stretch`` (0, 1, ...) picks a part of a bag whose
    driver was restarted; left out, the longest is read, with a warning. A bag whose writer was
    killed is read up to its last whole chunk, with a warning. ``digest``: whether to take the
    SHA-256 of the files, which takes a sixth as long again. Raises BagError for what is no bag,
    for missing topics, for several rigs without a namespace, and for time that runs backwards.
    """
    with open_source(Path(path)) as source:
        prefix = _prefix(source, namespace)
        warnings = list(source.warnings)
        coupled = {COUPLED_TOPIC: ('Encoder', (COUPLED_COLUMN,))}
        topics = _present(source, prefix, SAMPLE_TOPICS | coupled, _REQUIRED)
        if 'torque' not in topics:
            warnings.append(f'no topic {prefix}torque: torque and external_torque are NaN')
        first, stamp, period, columns, _ = _read(source, prefix, topics, stretch, warnings)
        info = _info(source, prefix, warnings)
        return Recording(
            name=source.path.name, period=period, columns=columns, start=_seconds(stamp),
            sequence=first, digest=_digest(source.files) if digest else '',
            warnings=tuple(warnings), **info)


def read_predictions(path: Path | str, namespace: str | None = None,
                     stretch: int | None = None) -> Predictions:
    """Read what the twin answered; errors and arguments are those of :func:`read_recording`."""
    with open_source(Path(path)) as source:
        prefix = _prefix(source, namespace)
        warnings = list(source.warnings)
        parts = {topic: (message, PREDICTED if part == 'prediction' else COMPARED + BALANCES)
                 for part, (topic, message) in TWIN_TOPICS.items()}
        topics = _present(source, prefix, parts, tuple(parts))
        prediction_topic, residual_topic = (topic for topic, _ in TWIN_TOPICS.values())
        answers = {}
        for topic in topics:
            answers[topic] = _read(source, prefix, {topic: topics[topic]}, stretch, warnings)
        first = max(answer[0] for answer in answers.values())
        end = min(answer[0] + len(next(iter(answer[3].values()))) for answer in answers.values())
        cut = {topic: {name: value[first - answer[0]:end - answer[0]]
                       for name, value in answer[3].items()} for topic, answer in answers.items()}
        _, stamp, period, _, _ = next(a for a in answers.values() if a[0] == first)
        said = answers[residual_topic][4]
        return Predictions(
            name=source.path.name, period=period, start=_seconds(stamp), sequence=first,
            prediction=cut[prediction_topic], residual=cut[residual_topic],
            channel_noise=np.asarray(said['channel_noise']),
            balance_noise=np.asarray(said['balance_noise']),
            restarts=int(answers[prediction_topic][4]['restarts']), warnings=tuple(warnings))


def namespaces(path: Path | str) -> list[str]:
    """Return the namespaces of the rigs in a bag, '' for one without."""
    with open_source(Path(path)) as source:
        return [prefix.strip('/') for prefix in _prefixes(source)]


def _prefixes(source: Source) -> list[str]:
    kinds = {f'{PACKAGE}/msg/{message}': topic for topic, (message, _) in SAMPLE_TOPICS.items()}
    return sorted({
        channel.topic[:-len(kinds[channel.kind])] for channel in source.channels
        if channel.kind in kinds and channel.topic.endswith('/' + kinds[channel.kind])
        and not channel.topic.endswith('/' + COUPLED_TOPIC)})


def _prefix(source: Source, namespace: str | None) -> str:
    found = _prefixes(source)
    if namespace is not None:
        prefix = '/' + namespace.strip('/') + '/' if namespace.strip('/') else '/'
        if prefix not in found:
            raise BagError(f'{source.path}: no rig in namespace {namespace!r}; the bag has '
                           f'{[name.strip("/") for name in found]}')
        return prefix
    if len(found) > 1:
        raise BagError(f'{source.path}: rigs in several namespaces '
                       f'{[name.strip("/") for name in found]}; say which by namespace')
    return found[0] if found else '/'


def _present(source: Source, prefix: str, topics: dict[str, tuple[str, Iterable[str]]],
             required: tuple[str, ...]) -> dict[str, tuple[str, Iterable[str]]]:
    have = {(channel.topic, channel.kind) for channel in source.channels}
    found = {topic: entry for topic, entry in topics.items()
             if (prefix + topic, f'{PACKAGE}/msg/{entry[0]}') in have}
    for topic in required:
        if topic not in found:
            listed = ', '.join(f'{name} ({kind})' for name, kind in sorted(have)) or 'no topic'
            raise BagError(f'{source.path}: no topic {prefix}{topic} '
                           f'({PACKAGE}/msg/{topics[topic][0]}); the bag has {listed}')
    return found


def _read(source: Source, prefix: str, topics: dict[str, tuple[str, Iterable[str]]],
          stretch: int | None, warnings: list[str],
          ) -> tuple[int, int, float, dict[str, np.ndarray], dict[str, Any]]:
    """Return (first sequence, its ns, period, columns, constants) of topics of one rig."""
    tracks = _tracks(source, [prefix + topic for topic in topics], warnings)
    for item in tracks:
        if item.topic == prefix + COUPLED_TOPIC:
            item.values = {COUPLED_COLUMN: item.values[COUPLED_FIELD]}
    try:
        parts = {item.topic: stretches(item) for item in tracks}
        chosen = _choose(parts, stretch, warnings)
        first, stamp, columns = join(chosen, warnings)
    except TimeError as error:
        raise BagError(f'{source.path}: {error}') from None
    size = len(next(iter(columns.values())))
    wanted = [name for _, names in topics.values() for name in names]
    columns = {name: columns.get(name, np.full(size, np.nan)) for name in wanted}
    constants = {name: value for item in chosen for name, value in item.constants.items()}
    return first, stamp, chosen[0].period, columns, constants


def _choose(parts: dict[str, list[Track]], stretch: int | None,
            warnings: list[str]) -> list[Track]:
    counts = {topic: len(items) for topic, items in parts.items()}
    if len(set(counts.values())) > 1:
        raise TimeError(f'sequence numbers start again a different number of times: {counts}')
    count = max(counts.values())
    if stretch is not None and not 0 <= stretch < count:
        raise TimeError(f'stretch = {stretch} is outside of [0, {count - 1}]')
    if count == 1:
        return [items[0] for items in parts.values()]
    sizes = [min(int(items[k].length.sum()) for items in parts.values()) for k in range(count)]
    if stretch is None:
        stretch = int(np.argmax(sizes))
        warnings.append(f'the driver was restarted while recording: stretches of {sizes} samples; '
                        f'number {stretch} is read')
    return [items[stretch] for items in parts.values()]


def _tracks(source: Source, topics: list[str], warnings: list[str]) -> list[Track]:
    """Return the topics' messages, decompressed and turned into columns on all cores."""
    def unpack(piece: Any) -> list[tuple[str, list[Run]]] | str:
        try:
            return [(channel.topic, [
                run for payloads in rows for run in decode(
                    embedded_types(channel.kind, channel.encoding, channel.definition),
                    channel.kind, payloads)]) for channel, rows in source.load(piece, topics)]
        except DAMAGE as error:
            return f'{source.describe(piece)} is damaged and left out: {error}'

    runs: dict[str, list[Run]] = {topic: [] for topic in topics}
    cores = len(os.sched_getaffinity(0)) if source.parallel else 1
    with ThreadPoolExecutor(cores) as pool:
        each = pool.map if cores > 1 else map
        for result in each(unpack, source.pieces(topics)):
            if isinstance(result, str):
                warnings.append(result)
                continue
            for topic, found in result:
                runs[topic] += [run for run in found if run.values]
    empty = [topic for topic in topics if not any(len(run.sequence) for run in runs[topic])]
    if empty:
        raise BagError(f'{source.path}: no message on {", ".join(empty)}'
                       + ''.join(f'; {warning}' for warning in warnings))
    try:
        return [track(topic, runs[topic]) for topic in topics]
    except TimeError as error:
        raise BagError(f'{source.path}: {error}') from None


def _info(source: Source, prefix: str, warnings: list[str]) -> dict[str, Any]:
    kind = f'{PACKAGE}/msg/RecordingInfo'
    channels = [channel for channel in source.channels if channel.kind == kind]
    channels.sort(key=lambda channel: channel.topic != prefix + 'recording')
    for channel in channels:
        payload = source.first(channel.topic)
        if payload is None:
            continue
        try:
            types = embedded_types(kind, channel.encoding, channel.definition)
            message = deserialize(types, kind, payload)
            return {name: getattr(message, name)
                    for name in ('servo', 'servo_file', 'family', 'replicate', 'note')}
        except (*DAMAGE, AttributeError) as error:  # a field whose name is damaged is not there
            warnings.append(f'{channel.topic} is damaged: {error}')
    warnings.append(f'no message on {prefix}recording: servo, family and replicate are unknown')
    return {}


def _seconds(nanoseconds: int) -> float:
    """Return whole nanoseconds as the nearest float, which division of 1e18 by 1e9 is not."""
    whole, rest = divmod(nanoseconds, 10**9)
    return whole + rest / 1e9


def _digest(files: list[Path]) -> str:
    total = hashlib.sha256()
    for path in files:
        with path.open('rb') as file:
            while block := file.read(1 << 20):
                total.update(block)
    return total.hexdigest()
