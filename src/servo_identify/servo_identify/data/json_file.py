"""JSON as loggers write it: one text, or a record in each line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import json
from pathlib import Path
from typing import Any

LINES = ('.jsonl', '.ndjson')
"""How names of files with a record in each line end."""


def read_json(path: Path) -> Any:
    """Return what a file holds, lines as a list; raises ValueError for what does not parse."""
    text = path.read_text('utf8')
    try:
        if path.suffix.lower() in LINES:
            return [json.loads(line) for line in text.splitlines() if line.strip()]
        return json.loads(text)
    except ValueError as error:
        raise ValueError(f'{path} is no JSON file: {error}') from None


def flat(record: Mapping[str, Any], above: str = '') -> Iterator[tuple[str, Any]]:
    """Yield the names and values of a record, ``motor.angle`` of a record within it."""
    for name, value in record.items():
        if isinstance(value, dict):
            yield from flat(value, f'{above}{name}.')
        else:
            yield above + name, value
