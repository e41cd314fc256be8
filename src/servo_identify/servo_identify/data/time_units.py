"""Which unit times are in, by their size."""

from __future__ import annotations

SHORTEST, LONGEST = 2e-5, 0.2  # s, between samples of a servo
_UNITS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9}
WORDS = {'ms': 'milliseconds', 'us': 'microseconds', 'ns': 'nanoseconds', 'days': 'days'}
_SERIAL_DAYS = (2e4, 1e5)  # since 1900, of a spreadsheet: from 1954 to 2173


def unit_of_times(step: float, start: float = 0.0) -> str:
    """
    Return the unit in which times make a period of a servo (20 us to 0.2 s), or ''.

    ``step`` is the period and ``start`` the first time, in that unit. Days are those of a
    spreadsheet, which counts them since 1900. Of two units that can be the larger is returned.
    """
    for unit, factor in _UNITS.items():
        if SHORTEST <= step * factor <= LONGEST:
            return unit
    least, most = _SERIAL_DAYS
    return 'days' if least < start < most and SHORTEST <= step * 86400.0 <= LONGEST else ''
