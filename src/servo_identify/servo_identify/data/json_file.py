"""JSON as loggers write it: one text, or a record in each line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import json
from pathlib import Path
from typing import Any

LINES = ('.jsonl', '.ndjson')
"""How names of files with a record in each line end."""


_BEGIN = 100_000  # letters in which the first two records are looked for


def read_json(path: Path) -> Any:
    """Return what a file holds, lines as a list; raises ValueError for what does not parse."""
    text = path.read_text('utf8')
    try:
        if path.suffix.lower() in LINES or _are_lines(text):
            return [json.loads(line) for line in text.splitlines() if line.strip()]
        return _listed(json.loads(text))
    except ValueError as error:
        raise ValueError(f'{path} is no JSON file: {error}') from None


def _are_lines(text: str) -> bool:
    """Tell whether each of the first two lines is a record of its own."""
    first = [line.strip() for line in text[:_BEGIN].splitlines() if line.strip()][:2]
    return len(first) == 2 and all(line[0] == '{' and line[-1] == '}' for line in first)


def _listed(content: Any) -> Any:
    """
    Return numbered rows as lists, as pandas writes them.

    They are columns of them, {"t": {"0": 0.0, ...}}, or records, {"0": {"t": 0.0, ...}, ...}.
    """
    if not isinstance(content, dict) or not content or not all(
            isinstance(one, dict) and one for one in content.values()):
        return content
    numbers, *others = [list(one) for one in content.values()]
    if len(content) > 1 and all(map(str.isdigit, content)) and all(
            one == numbers for one in others) and not any(map(str.isdigit, numbers)):
        return list(content.values())
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
