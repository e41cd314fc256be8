"""When a recording began, by the first stamp of its time, as people write it."""

from __future__ import annotations

from datetime import datetime, UTC

from .export_headers import LEAST_STAMP, MOST_STAMP
from .table import Table
from .time_units import SINCE_YEAR_1, unit_of_stamps

_SINCE_1601, _SINCE_1 = 11_644_473_600.0, 62_135_596_800.0  # s from there to 1970
_FACTORS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9}
_SINCE_1970 = (6e8, 4e9)  # s, from 1989 to 2096


def begin_of(table: Table, source: str, unit: str) -> str:
    """Return when the first row of a table was taken; '' where its times do not say."""
    return table.begins.get(source) or date_of(table.first(source), unit)


def date_of(first: float, unit: str) -> str:
    """Return a number of an instant as a date, UTC; '' where it is none of a calendar."""
    unit = unit or unit_of_stamps(first) or 's'
    if LEAST_STAMP < first < MOST_STAMP:
        seconds = 1e-7 * first - _SINCE_1601
    elif SINCE_YEAR_1[0] < first < SINCE_YEAR_1[1]:
        seconds = 1e-7 * first - _SINCE_1
    else:
        seconds = _FACTORS.get(unit, 0.0) * first
    least, most = _SINCE_1970
    if not least < seconds < most:
        return ''
    shown = datetime.fromtimestamp(seconds, UTC)
    return f'{shown:%Y-%m-%d %H:%M:%S}.{shown.microsecond // 1000:03d} UTC'
