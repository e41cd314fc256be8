"""Times as a clock shows them, 14:03:22.104, brought to seconds."""

from __future__ import annotations

from collections.abc import Sequence
import re
from typing import Any

import numpy as np

_CLOCK = re.compile(r'(?:.*[\sT])?(?:(\d{1,2}):)?(\d{1,2}):(\d{1,2}(?:[.,:]\d+)?)'
                    r'\s*([AaPp][Mm])?\s*(?:Z|[+-]\d\d:?\d\d)?')
_DAY, _HOUR = 86400.0, 3600.0


def seconds_of(values: Sequence[Any]) -> np.ndarray | None:
    """
    Return times of a clock in s, (rows,), NaN where there is none; None for what is no clock.

    A date before the time may be written in any order, for it is not read: a clock that jumps
    back by most of its round has begun the next one. The round is a day, or an hour where
    minutes and seconds alone are shown.
    """
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
        hours = int(hour or 0) % 12 + 12 * (half in ('PM', 'pm')) if half else int(hour or 0)
        found[k] = _HOUR * hours + 60.0 * int(minute) + float(re.sub('[,:]', '.', second))
    known = np.flatnonzero(np.isfinite(found))
    if not len(known):
        return None
    back = np.diff(found[known], prepend=found[known[0]]) < -0.5 * round_
    found[known] += round_ * np.cumsum(back)
    return found
