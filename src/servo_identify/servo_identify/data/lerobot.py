"""Names that a LeRobot data set gives the parts of its features, beside the Parquet files."""

from __future__ import annotations

import json
from pathlib import Path
import re
from typing import Any

import numpy as np

INFO = Path('meta', 'info.json')
_DEEP = 4  # folders between a Parquet file and that of the data set
_PART = re.compile(r'(.+)\[(\d+)\]')


def named_parts(path: Path, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """
    Return columns with the names of joints for numbers: action[elbow_flex.pos] for action[2].

    They stand in the meta/info.json of the data set; without it all stays as it is.
    """
    features = _features(path)
    return {_name(name, features): column for name, column in columns.items()}


def _features(path: Path) -> dict[str, Any]:
    for folder in path.resolve().parents[:_DEEP]:
        if (folder / INFO).is_file():
            try:
                found = json.loads((folder / INFO).read_text('utf8')).get('features')
            except (ValueError, OSError, AttributeError):
                return {}
            return found if isinstance(found, dict) else {}
    return {}


def _name(name: str, features: dict[str, Any]) -> str:
    match = _PART.fullmatch(name)
    feature = features.get(match[1]) if match else None
    names = feature.get('names') if isinstance(feature, dict) else None
    if isinstance(names, dict):  # as version 2 has them, below one word
        names = next((one for one in names.values() if isinstance(one, list)), None)
    if match is None or not isinstance(names, list) or len(set(map(str, names))) < len(names):
        return name
    at = int(match[2])
    return f'{match[1]}[{names[at]}]' if at < len(names) else name
