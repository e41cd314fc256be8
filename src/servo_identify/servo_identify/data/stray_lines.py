"""Lines among the rows of a text that are no rows: comments, names again, rows that broke off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .csv_layout import cells_of, Layout, MARKS
from .text_encoding import LINE_END

FEW = 0.01
"""Share of the rows that may break off; of more something else is wrong."""


@dataclass(frozen=True)
class Rows:
    """
    The rows of a text alone, in UTF-8.

    ``told`` says what was left out among them. ``again`` are the numbers of the rows, from 0 on,
    before which the line of names stands again.
    """

    text: bytes
    told: tuple[str, ...]
    again: tuple[int, ...]


def rows_alone(path: Path, layout: Layout) -> Rows | None:
    """
    Return the rows of a text without other lines; None where too many do not part as the rows do.

    A logger that starts again appends the lines above its numbers, whose values may differ, with
    comments maybe, and the row before may break off.
    """
    lines = LINE_END.split(path.read_text(layout.encoding))
    above = {line.strip() for line in lines[:layout.skipped]} - {''}
    keys = {_key(line, layout) for line in above} - {'', _key(layout.row, layout)}
    kept, comments, broken, again = list[str](), list[int](), list[int](), list[int]()
    for k, line in enumerate(lines[layout.skipped:], layout.skipped):
        bare = line.strip()
        if not bare.strip(layout.delimiter):
            continue
        if bare in above or _key(line, layout) in keys:
            again.append(len(kept))
        elif MARKS.match(line):
            comments.append(k)
        elif len(cells_of(line, layout.delimiter)) != len(layout.names):
            broken.append(k)
        else:
            kept.append(' '.join(line.split()) if layout.blanks else line)
    again = [*dict.fromkeys(row for row in again if 0 < row < len(kept))]
    if not kept or len(broken) > FEW * len(kept) + len(again):
        return None
    told = [f'the line of names stands again before {_listed([row + 1 for row in again], "row")}'
            ] if again else []
    for found, what in ((comments, 'a comment'), (broken, f'no row of {len(layout.names)} cells')):
        if found:
            told.append(f'{_listed([k + 1 for k in found], "line")} '
                        f'({lines[found[0]].strip()!r}) '
                        f'{"is" if len(found) == 1 else "are each"} {what} and left out')
    return Rows('\n'.join(kept).encode(), tuple(told), tuple(again))


def _key(line: str, layout: Layout) -> str:
    """Return the word that a line begins with; '' where its first cell is none."""
    first = next(iter(cells_of(line, layout.delimiter)), '')
    return first if first[:1].isalpha() else ''


def _listed(numbers: Sequence[int], what: str) -> str:
    """Return numbers of lines or rows for people, the first few of many."""
    shown = ', '.join(map(str, numbers[:3])) + (
        f' and {len(numbers) - 3} more' if len(numbers) > 3 else '')
    return f'{what}{"s" * (len(numbers) > 1)} {shown}'
