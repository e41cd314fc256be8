"""Work on all cores by threads: the kernels and the products of tables run outside Python."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count
from typing import TypeVar

from threadpoolctl import threadpool_limits

Item, Result = TypeVar('Item'), TypeVar('Result')


def side_by_side(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """
    Yield what becomes of each item, in order.

    Products of tables take one thread each meanwhile, or threads would wait for each other.
    """
    with threadpool_limits(1, 'blas'), ThreadPoolExecutor(cpu_count()) as pool:
        yield from pool.map(work, items)
