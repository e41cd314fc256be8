"""Columns as the flags of init give them: --column COLUMN=SOURCE:UNIT."""

from __future__ import annotations

from collections.abc import Sequence

from servo_twin.description.nearest_name import or_what

from ..data.column_names import NAMES
from ..data.column_units import factor_of
from ..data.physical_units import factor_to
from ..data.unit_symbols import UnitError
from .proposals import Proposal, unit_said
from .sources import Offered
from .torques import shaft_of, stands_for_current


def given_columns(of: Offered, texts: Sequence[str]) -> dict[str, Proposal]:
    """
    Return columns that are given as COLUMN=SOURCE or COLUMN=SOURCE:UNIT; COLUMN= has none.

    COLUMN=-SOURCE is one whose positive is the other way, t=:2 ms counts rows without times.
    """
    found = {}
    for text in texts:
        column, equals, rest = text.partition('=')
        if not equals:
            raise ValueError(f'--column {text}: write COLUMN=SOURCE:UNIT')
        if column not in NAMES:
            raise ValueError(f'--column {text}: there is no column {column!r}; '
                             f'{or_what(column, NAMES)}')
        if not rest:  # left out
            found[column] = Proposal(column, '', '')
            continue
        source, colon, unit = rest.rpartition(':')
        if column == 't' and colon and not source:
            found[column] = _counted(of, text, unit)
            continue
        if not colon or rest in of.sources or rest[1:] in of.sources:
            source, unit = rest, unit_said(of, column, rest.removeprefix('-'))
        negate = source[:1] == '-' and source[1:] in of.sources
        source = source[negate:]
        if source not in of.sources:
            raise ValueError(f'--column {text}: {of.path} has no {source!r}; '
                             f'{or_what(source, of.sources, "it has")}')
        judge_unit(f'--column {text}', column, unit)
        found[column] = Proposal(column, source, unit, shaft=shaft_of(of, column, source),
                                 negate=negate)
    return found


def _counted(of: Offered, text: str, period: str) -> Proposal:
    """Return the time of a file that has none: its rows are counted in a period, as in 2 ms."""
    try:
        every = factor_to(period, 's')
    except UnitError as problem:
        raise ValueError(f'--column {text}: write the period of the rows, t=:2 ms: {problem}'
                         ) from None
    if of.messages:
        raise ValueError(f'--column {text}: messages have stamps; give one of them')
    return Proposal('t', '', 's', every=every)


def judge_unit(where: str, column: str, unit: str) -> None:
    """Raise ValueError for what can be no unit of a column; a torque may stand for a current."""
    if not stands_for_current(column, unit):
        factor_of(where, column, unit, None, either=True)
