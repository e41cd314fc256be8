"""Recordings of one machine, as a sequence that prints what it holds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, overload

import numpy as np

from servo_twin.description.nearest_name import or_what
from servo_twin.recording.recording import COLUMNS, Recording

from .frames import dataset_of, frame_of, table_of
from .html_table import html_table

_HEADINGS = ('recording', 'family', 'seconds', 'Hz', 'channels')


@dataclass(frozen=True, repr=False)
class Recordings(Sequence[Recording]):
    """
    Recordings in the order in which they were read.

    ``data[0]['current']`` is an array of shape (samples,) in the unit of
    `servo_twin.recording.recording.COLUMNS`: rad, A, V, N m. Angles, speeds and torques are
    positive the same way on both shafts. ``data[1:]`` and ``data + more`` are recordings.
    """

    items: tuple[Recording, ...]

    @overload
    def __getitem__(self, index: int) -> Recording: ...

    @overload
    def __getitem__(self, index: slice) -> Recordings: ...

    def __getitem__(self, index: int | slice) -> Recording | Recordings:
        if isinstance(index, slice):
            return Recordings(self.items[index])
        if isinstance(index, str):
            raise TypeError(f'a recording is taken by its number, as in data[0][{index!r}]')
        if not -len(self) <= index < len(self):
            raise IndexError(f'there is no recording {index}; there are {len(self)}, counted '
                             'from 0')
        return self.items[index]

    def __len__(self) -> int:
        return len(self.items)

    def __iter__(self) -> Iterator[Recording]:
        return iter(self.items)

    def __add__(self, other: Sequence[Recording]) -> Recordings:
        return Recordings((*self.items, *other))

    def of_family(self, family: str) -> Recordings:
        """Return those of one excitation family; raises ValueError where there is none."""
        found = tuple(one for one in self.items if one.family == family)
        if not found:
            known = sorted({one.family for one in self.items if one.family})
            raise ValueError(f'no recording is of the family {family!r}; '
                             + (or_what(family, known, 'there are') if known else
                                'none says its family: recordings.yaml beside the tables does'))
        return Recordings(found)

    def table(self, index: int = 0) -> dict[str, np.ndarray]:
        """
        Return one recording as columns: ``t`` in s and what was measured, each (samples,).

        Units and signs are those of the recording. Raises IndexError where there is none.
        """
        return table_of(self[index])

    def frame(self, index: int = 0) -> Any:
        """
        Return one recording as a pandas DataFrame; its index is ``t`` in s.

        Raises IndexError where there is none, ImportError without pandas.
        """
        return frame_of(self[index])

    def dataset(self, index: int = 0) -> Any:
        """
        Return one recording as an xarray Dataset over ``t`` in s, each variable with units.

        Raises IndexError where there is none, ImportError without xarray.
        """
        return dataset_of(self[index])

    def _rows(self) -> list[tuple[str, ...]]:
        return [(one.name, one.family or '-', f'{one.duration:.3g}', f'{1.0 / one.period:.5g}',
                 ', '.join(name for name in COLUMNS if one.has(name))) for one in self.items]

    def __repr__(self) -> str:
        lines = ['  '.join(row) for row in self._rows()]
        count = '1 recording' if len(self) == 1 else f'{len(self)} recordings'
        return '\n'.join([f'{count}: {", ".join(_HEADINGS)}', *lines])

    def _repr_html_(self) -> str:
        return html_table(_HEADINGS, self._rows())


def named_apart(groups: Sequence[Sequence[Recording]]) -> list[list[Recording]]:
    """
    Return groups of recordings in which each has a name of its own: ``run``, ``run (2)`` ...

    One that is in two groups has one name.
    """
    names, taken = dict[int, str](), set[str]()
    for one in (one for several in groups for one in several):
        if id(one) in names:
            continue
        number, name = 1, one.name
        while name in taken:
            number += 1
            name = f'{one.name} ({number})'
        names[id(one)] = name
        taken.add(name)
    renamed = {id(one): one if names[id(one)] == one.name else replace(one, name=names[id(one)])
               for several in groups for one in several}
    return [[renamed[id(one)] for one in several] for several in groups]
