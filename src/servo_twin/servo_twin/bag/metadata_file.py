"""The metadata.yaml of a rosbag2 folder: what it says is checked by who asks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

_DEEPEST = 50  # mappings and rows within each other
_Loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


def metadata_of(path: Path) -> dict[str, Any]:
    """Return rosbag2's metadata, empty where a killed writer left none or half of it."""
    try:
        text = (path / 'metadata.yaml').read_text('utf8')
        if _deep(text):
            return {}
        content = yaml.load(text, _Loader)  # noqa: S506  (SafeLoader, in C where it is there)
        return dict(content['rosbag2_bagfile_information'])
    except (OSError, UnicodeDecodeError, yaml.YAMLError, KeyError, TypeError, ValueError):
        return {}


def _deep(text: str) -> bool:
    """Tell whether YAML nests too deeply: the loader in C ends the process over it."""
    depth = 0
    for event in yaml.parse(text, _Loader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _DEEPEST:
            return True
    return False
