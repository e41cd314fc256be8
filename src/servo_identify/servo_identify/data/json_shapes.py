"""
The shapes in which JSON holds a table: a list of records, columns by name, or either within more.

People write ``{"meta": {...}, "data": {"t": [...], ...}}``, pandas ``{"columns": [...], "data":
[[...], ...]}``, loggers of channels ``[{"name": "u", "unit": "V", "data": [...]}, ...]``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from servo_twin.description.nearest_name import or_what

from .column_names import looks_like
from .json_file import flat

_NUMBERS = ('data', 'values', 'samples')
"""How the numbers of a channel are called beside its ``name``."""


def table_of(path: Path, content: Any, rows: str) -> list[Any] | dict[str, list[Any]]:
    """
    Return the records, or the columns by name, that a JSON file holds.

    ``rows`` is the name of what holds them, ``log.data`` of one within another; '' finds it.
    Raises ValueError that says what there is instead.
    """
    for name in _steps(content, rows):
        if not isinstance(content, dict) or name not in content:
            held = content if isinstance(content, dict) else ()
            raise ValueError(f'{path} has no list {rows!r}; {or_what(name, held, "it has")}')
        content = content[name]
    if not rows:
        content = _inner(content)
    content = _alone(path, _of_channels(_with_names(content)))
    if isinstance(content, dict):
        return {name: value for name, value in flat(content) if isinstance(value, list)}
    if isinstance(content, list) and all(isinstance(row, dict) for row in content):
        return content
    what = (f'{rows!r} is' if rows else 'it is') + (
        ' a list of lists without the names of their columns' if isinstance(content, list)
        and content and isinstance(content[0], list) else ' no list of records')
    raise ValueError(f'{path}: {what}; write a record for each row, [{{"t": 0.0, "current": 0.1}}'
                     ', ...], or a list for each column, {"t": [0.0, ...], "u": [0.1, ...]}; '
                     "where it stands within more, 'rows' of a mapping file names it")


def _alone(path: Path, content: Any) -> Any:
    """Return the one record of a list whose times are a list; raises ValueError for several."""
    if not isinstance(content, list) or not content or not all(
            isinstance(one, dict) and any(looks_like(name) == 't' and isinstance(times, list)
                                          for name, times in one.items()) for one in content):
        return content
    if len(content) > 1:
        raise ValueError(f'{path} holds {len(content)} records with times of their own, as of '
                         'several machines or runs: make a file of each, by for k, one in '
                         "enumerate(json.load(file)): json.dump(one, open(f'{k}.json', 'w'))")
    return content[0]


def _steps(content: Any, rows: str) -> list[str]:
    """Return the names on the way to the rows."""
    if not rows or isinstance(content, dict) and rows in content:
        return [rows] if rows else []
    return rows.split('.')


def _inner(content: Any) -> Any:
    """Return what alone holds lists, whatever stands beside: the data, and not the meta."""
    while isinstance(content, dict) and not _split(content):
        holding = [one for one in content.values() if _holds_lists(one)]
        inner = holding[0] if len(holding) == 1 else None
        if not isinstance(inner, dict) and not (isinstance(inner, list) and all(
                isinstance(one, dict) for one in inner)):
            break
        content = inner
    return content


def _holds_lists(one: Any) -> bool:
    return isinstance(one, list) and bool(one) or isinstance(one, dict) and any(
        map(_holds_lists, one.values()))


def _split(content: Mapping[str, Any]) -> bool:
    """Tell whether names of columns stand beside lists of numbers, a list each row."""
    names, data = content.get('columns'), content.get('data')
    return bool(isinstance(names, list) and isinstance(data, list) and data and all(
        isinstance(row, list) and len(row) == len(names) for row in data))


def _with_names(content: Any) -> Any:
    """Return rows whose names stand beside them, as pandas writes them, as columns."""
    if not isinstance(content, dict) or not _split(content):
        return content
    return {str(name): list(column) for name, column in zip(
        content['columns'], zip(*content['data'], strict=True), strict=True)}


def _of_channels(content: Any) -> Any:
    """Return channels, each with its name and its numbers, as columns; a unit behind the name."""
    if not isinstance(content, list) or not content:
        return content
    found = dict[str, list[Any]]()
    for one in content:
        key = next((key for key in _NUMBERS if isinstance(one, dict)
                    and isinstance(one.get(key), list)), '')
        if not key or not isinstance(one.get('name'), str):
            return content
        unit = one.get('unit') or one.get('units') or ''
        found[f'{one["name"]} [{unit}]' if unit else one['name']] = one[key]
    return found
