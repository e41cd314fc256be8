"""Times as a clock shows them, 14:03:22.104, brought to seconds."""

from __future__ import annotations

from collections.abc import Sequence
import re
from typing import Any

import numpy as np

from .physical_units import factor_to

_CLOCK = re.compile(r'(?:.*[\sT])?(?:(\d{1,2}):)?(\d{1,2}):(\d{1,2}(?:[.,]\d+)?)(?::(\d+))?'
                    r'\s*(?:([AaPp])\.?\s?[Mm]\.?)?\s*(?:Z|[+-]\d\d:?\d\d)?')
_DAY, _HOUR = 86400.0, 3600.0
_DURATION = re.compile(r'([-+]?\d[\d.]*(?:[eE][-+]?\d+)?)\s*([A-Za-zµ]+)')
_UNITS = ('s', 'sec', 'ms', 'us', 'µs', 'min', 'hr', 'h')


def seconds_of(values: Sequence[Any]) -> np.ndarray | None:
    """
    Return times of a clock in s, (rows,), NaN where there is none; None for what is no clock.

    A date before the time may be written in any order, for it is not read: a clock that jumps
    back by most of its round has begun the next one. The round is a day, or an hour where
    minutes and seconds alone are shown. What stands behind a colon after the seconds has as many
    digits in each row, as 14:05:00:007, or counts ms or us: 14:5:0:7. Durations have their unit
    with them, as MATLAB writes them: 0.002 sec. Raises ValueError, which begins with what the
    column has, where such counts may be ms or hundredths.
    """
    durations = _durations(values)
    if durations is not None:
        return durations
    read = dict[int, list[str | None]]()
    for k, value in enumerate(values):
        if value in (None, ''):
            continue
        match = _CLOCK.fullmatch(str(value).strip())
        if not match:
            return None
        read[k] = [*match.groups()]
    if any(hour is None and count for hour, _, _, count, _ in read.values()):
        # minutes, seconds and ms in all rows, though few digits look like a clock
        read = {k: [None, *shown[:3], shown[4]] if shown[0] else shown
                for k, shown in read.items()}
    per_second = _counts_per_second([count for *_, count, _ in read.values() if count])
    found, round_ = np.full(len(values), np.nan), _DAY
    for k, (hour, minute, second, count, half) in read.items():
        if hour is None:
            round_ = _HOUR
        hours = int(hour or 0) % 12 + 12 * (half in 'Pp') if half else int(hour or 0)
        found[k] = (_HOUR * hours + 60.0 * int(minute or 0)
                    + float((second or '').replace(',', '.')) + int(count or 0) / per_second)
    known = np.flatnonzero(np.isfinite(found))
    if not len(known):
        return None
    back = np.diff(found[known], prepend=found[known[0]]) < -0.5 * round_
    found[known] += round_ * np.cumsum(back)
    return found


def _counts_per_second(counts: Sequence[str]) -> float:
    """Return what the numbers behind the seconds of a clock count in 1 s."""
    least, most = (f(map(len, counts), default=3) for f in (min, max))
    if most < 2 or least < most < 3:
        raise ValueError(f'has {counts[0]!r} behind a colon after the seconds, and no row has '
                         'more than two digits there: they may be ms or hundredths. Write them '
                         'as a part of the second, 14:05:00.007')
    if least == most:
        return 10.0**most
    return 1e3 if most == 3 else 1e6


def _durations(values: Sequence[Any]) -> np.ndarray | None:
    """Return numbers with one unit of time behind each in s; None where one is something else."""
    told = [_DURATION.fullmatch(str(one).strip()) for one in values if one not in (None, '')]
    units = {match and match[2] for match in told}
    if len(units) != 1 or not units <= set(_UNITS):
        return None
    (unit,), numbers = units, iter(told)
    factor = factor_to({'hr': 'h'}.get(unit, unit), 's')
    return np.array([np.nan if one in (None, '') else factor * float(next(numbers)[1])
                     for one in values])
