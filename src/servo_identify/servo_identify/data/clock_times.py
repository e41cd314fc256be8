"""Times as a clock shows them, 14:03:22.104, brought to seconds."""

from __future__ import annotations

from collections.abc import Sequence
import re
from typing import Any

import numpy as np

from .physical_units import factor_to

_CLOCK = re.compile(r'(?:.*[\sT])?(?:(\d{1,2}):)?(\d{1,2}):(\d{1,2}(?:[.,:]\d+)?)'
                    r'\s*(?:([AaPp])\.?\s?[Mm]\.?)?\s*(?:Z|[+-]\d\d:?\d\d)?')
_DAY, _HOUR = 86400.0, 3600.0
_DURATION = re.compile(r'([-+]?\d[\d.]*(?:[eE][-+]?\d+)?)\s*([A-Za-zµ]+)')
_UNITS = ('s', 'sec', 'ms', 'us', 'µs', 'min', 'hr', 'h')


def seconds_of(values: Sequence[Any]) -> np.ndarray | None:
    """
    Return times of a clock in s, (rows,), NaN where there is none; None for what is no clock.

    A date before the time may be written in any order, for it is not read: a clock that jumps
    back by most of its round has begun the next one. The round is a day, or an hour where
    minutes and seconds alone are shown. Durations have their unit with them, as MATLAB writes
    them: 0.002 sec.
    """
    durations = _durations(values)
    if durations is not None:
        return durations
    found, round_ = np.full(len(values), np.nan), _DAY
    for k, value in enumerate(values):
        if value in (None, ''):
            continue
        match = _CLOCK.fullmatch(str(value).strip())
        if not match:
            return None
        hour, minute, second, half = match.groups()
        if hour is None:
            round_ = _HOUR
        hours = int(hour or 0) % 12 + 12 * (half in 'Pp') if half else int(hour or 0)
        found[k] = _HOUR * hours + 60.0 * int(minute) + float(re.sub('[,:]', '.', second))
    known = np.flatnonzero(np.isfinite(found))
    if not len(known):
        return None
    back = np.diff(found[known], prepend=found[known[0]]) < -0.5 * round_
    found[known] += round_ * np.cumsum(back)
    return found


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
