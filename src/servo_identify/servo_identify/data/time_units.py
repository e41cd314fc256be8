"""Which unit times are in, by their size."""

from __future__ import annotations

from .export_headers import LEAST_STAMP, MOST_STAMP

SHORTEST, LONGEST = 2e-5, 0.2  # s, between samples of a servo
SINCE_YEAR_1 = (6.2e17, 6.7e17)  # steps of 100 ns, as .NET counts them, from 1965 to 2124
_UNITS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9}
WORDS = {'ms': 'milliseconds', 'us': 'microseconds', 'ns': 'nanoseconds', 'days': 'days',
         '100 ns': 'steps of 100 ns (FILETIME)'}
_SINCE_1970 = (6e8, 4e9)  # s, from 1989 to 2096
_SERIAL_DAYS = ((2e4, 1e5), (7e5, 8e5), (2.43e6, 2.5e6))
"""Days since 1900 (spreadsheets), since 0 (datenum of MATLAB) and of Julian dates, in our time."""


def unit_of_times(step: float, start: float = 0.0) -> str:
    """
    Return the unit in which times make a period of a servo (20 us to 0.2 s), or ''.

    ``step`` is the period and ``start`` the first time, in that unit. Days are those of a
    spreadsheet, of MATLAB or of Julian dates, and steps of 100 ns since 1601 or the year 1 those
    of Windows. Of two units that can be the larger is returned.
    """
    if _of_100_ns(start):
        return '100 ns'
    for unit, factor in _UNITS.items():
        if SHORTEST <= step * factor <= LONGEST:
            return unit
    dated = any(least < start < most for least, most in _SERIAL_DAYS)
    return 'days' if dated and SHORTEST <= step * 86400.0 <= LONGEST else ''


def unit_of_stamps(first: float) -> str:
    """
    Return the unit of stamps of a calendar that begin with ``first``, or '' where they are none.

    They count from 1970, or 100 ns from 1601 or the year 1, and are no seconds: those are smaller
    by far.
    """
    if _of_100_ns(first):
        return '100 ns'
    least, most = _SINCE_1970
    return next((unit for unit, factor in _UNITS.items()
                 if unit != 's' and least < first * factor < most), '')


def _of_100_ns(first: float) -> bool:
    """Tell whether stamps of Windows or .NET begin with a number."""
    return LEAST_STAMP < first < MOST_STAMP or SINCE_YEAR_1[0] < first < SINCE_YEAR_1[1]
