"""Cells that hold lists or records, as JSON and Parquet have them, as columns of their parts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

MOST = 64  # parts of a list: joints of a robot, and not the pixels of a picture


def parts_of(name: str, values: Sequence[Any]) -> Iterator[tuple[str, list[Any]]]:
    """
    Yield the names and values of the parts of cells: ``q[0]`` of a list, ``q.angle`` of a record.

    The first cell that is there says which parts there are; what another lacks is None.
    """
    first = next((one for one in values if one is not None), None)
    if isinstance(first, dict):
        for key in first:
            yield from parts_of(f'{name}.{key}', [
                one.get(key) if isinstance(one, dict) else None for one in values])
    elif isinstance(first, list) and 0 < len(first) <= MOST:
        for k in range(len(first)):
            yield from parts_of(f'{name}[{k}]', [
                one[k] if isinstance(one, list) and k < len(one) else None for one in values])
    else:
        yield name, list(values)
