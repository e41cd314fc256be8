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
        return _listed(json.loads(text))
    except ValueError as error:
        raise ValueError(f'{path} is no JSON file: {error}') from None


def _listed(content: Any) -> Any:
    """Return columns of numbered rows as lists: {"t": {"0": 0.0, ...}}, as pandas writes them."""
    if not isinstance(content, dict) or not content or not all(
            isinstance(one, dict) and one for one in content.values()):
        return content
    numbers, *others = [list(one) for one in content.values()]
    if not all(one.isdigit() for one in numbers) or any(one != numbers for one in others):
        return content
    return {name: list(one.values()) for name, one in content.items()}


def flat(record: Mapping[str, Any], above: str = '') -> Iterator[tuple[str, Any]]:
    """Yield the names and values of a record, ``motor.angle`` of a record within it."""
    for name, value in record.items():
        if isinstance(value, dict):
            yield from flat(value, f'{above}{name}.')
        else:
            yield above + name, value
