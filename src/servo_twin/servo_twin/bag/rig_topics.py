"""Which topics of a bag are those of one rig, and what the recorder said of it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from .bag_topics import COUPLED_TOPIC, SAMPLE_TOPICS
from .bag_writing import BagError
from .mcap_reading import DAMAGE
from .message_definitions import deserialize, embedded_types, PACKAGE
from .message_sources import Source

INFO = 'recording'
"""Topic on which a recorder says what it records."""
Topics = dict[str, tuple[str, Iterable[str]]]
"""Topic of a rig: its message, and the columns that are read from it."""


def prefixes(source: Source) -> list[str]:
    """Return the rigs' prefixes, each with a slash at both ends."""
    kinds = {f'{PACKAGE}/msg/{message}': topic for topic, (message, _) in SAMPLE_TOPICS.items()}
    return sorted({
        channel.topic[:-len(kinds[channel.kind])] for channel in source.channels
        if channel.kind in kinds and channel.topic.endswith('/' + kinds[channel.kind])
        and not channel.topic.endswith('/' + COUPLED_TOPIC)})


def prefix_of(source: Source, namespace: str | None) -> str:
    """Return the prefix of one rig; raises BagError where it is not there or not the only one."""
    found = prefixes(source)
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


def present(source: Source, prefix: str, topics: Topics, required: tuple[str, ...]) -> Topics:
    """Return the topics that a bag has; raises BagError where a required one is missing."""
    have = {(channel.topic, channel.kind) for channel in source.channels}
    found = {topic: entry for topic, entry in topics.items()
             if (prefix + topic, f'{PACKAGE}/msg/{entry[0]}') in have}
    for topic in required:
        if topic not in found:
            listed = ', '.join(f'{name} ({kind})' for name, kind in sorted(have)) or 'no topic'
            raise BagError(f'{source.path}: no topic {prefix}{topic} '
                           f'({PACKAGE}/msg/{topics[topic][0]}); the bag has {listed}')
    return found


def info_of(source: Source, prefix: str, warnings: list[str]) -> dict[str, Any]:
    """
    Return what the recorder said of a rig, empty with a warning where it said nothing.

    A recorder in a namespace of its own speaks of the rig that it records; one in the namespace of
    another rig speaks of that one alone.
    """
    kind = f'{PACKAGE}/msg/RecordingInfo'
    others = {other + INFO for other in prefixes(source)} - {prefix + INFO}
    channels = [channel for channel in source.channels
                if channel.kind == kind and channel.topic not in others]
    channels.sort(key=lambda channel: channel.topic != prefix + INFO)
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
    warnings.append(f'no message on {prefix}{INFO}: servo, family and replicate are unknown')
    return {}
