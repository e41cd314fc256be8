"""
When messages were made: by their stamps, or by their receipt, brought to one clock.

A stamp is that of the header, or a stamp of the message's own. A topic whose messages have none
goes by their receipt. The clock of a stamp may be another than that of the receipt: a simulation
counts from zero, and a controller from its start.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .message_parts import part_of

CLOCK = 10**9 // 2  # ns between stamp and receipt from which on they are of two clocks
BACK = 10**8  # ns by which stamps of one topic may go back: several publish it, or come late
STRETCH = 20  # messages between two steps back of a clock that is set; several publish more often
_STAMPS = ('stamp', 'timestamp')


def stamp_of(message: Any) -> int:
    """Return the stamp of a message in ns; 0 where it has none, or none that is set."""
    header = part_of(message, 'header', None)
    for owner in (header, message):
        for name in _STAMPS:
            stamp = part_of(owner, name, None)
            if isinstance(stamp, int | float):
                return _of_calendar(stamp)
            seconds = _first(stamp, 'sec', 'secs', 'seconds')
            nanoseconds = _first(stamp, 'nanosec', 'nsec', 'nsecs', 'nanos')
            if seconds or nanoseconds:
                return int(seconds or 0) * 10**9 + int(nanoseconds or 0)
    return 0


def on_one_clock(stamps: Mapping[str, np.ndarray], received: Mapping[str, np.ndarray],
                 leading: str) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """
    Return the times of the messages of each topic, ns, and what to mind of them.

    All are of the clock of the ``leading`` topic. A topic of another clock is joined by the times
    of receipt: so much after the leading stamps as its messages came after those. Stamps are of
    another clock where they lie before or behind all of the leading ones.
    """
    times, late = dict[str, np.ndarray](), dict[str, int]()
    set_back = list[str]()
    for topic, those in stamps.items():
        going, back = _going_on(those, received[topic])
        times[topic], late[topic] = _filled(going, received[topic])
        set_back += [f'the clock of {topic} was set back by {by * 1e-9:.4g} s before message '
                     f'{at + 1}: from there on its stamps are taken on by their receipt'
                     for at, by in back]
    others: dict[str, list[str]] = {}
    for topic in stamps:
        if topic == leading or not len(times[topic]):
            continue
        off, own = late[topic] - late[leading], stamps[topic].any()
        if abs(off) < CLOCK or own and _meet(times[topic], times[leading]):
            continue
        others.setdefault(f'{abs(off) * 1e-9:.4g} s', []).append(topic)
        if own:
            times[topic] = times[topic] + off
        else:
            times[topic] = received[topic] - _late(received[topic], received[leading],
                                                   times[leading])
    return times, (*set_back, *_set_back(leading, times[leading]), *(
        f'the stamps of {leading} are of another clock than {" and ".join(those)}, {off} off: '
        'they are joined by their receipt' for off, those in others.items()))


def _going_on(stamps: np.ndarray, received: np.ndarray
              ) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """
    Return stamps as if their clock had never been set back; where it was and by how much, ns.

    The receipt has gone on meanwhile. Stamps that step back over and over are those of several
    that publish one topic, and stay as they are.
    """
    behind = np.flatnonzero(stamps != 0)
    steps = behind[1:][np.diff(stamps[behind]) < -BACK]
    if not len(steps) or len(behind) < STRETCH * (1 + len(steps)):
        return stamps, []
    going, found = stamps.copy(), list[tuple[int, int]]()
    for at, end in zip(steps, [*steps[1:], len(stamps)], strict=True):
        before, after = (received[part] - stamps[part] for part in (
            behind[behind < at][-STRETCH:], behind[(behind >= at) & (behind < end)][:STRETCH]))
        by = int(np.median(after) - np.median(before))
        if by > BACK:
            rest = behind[behind >= at]
            going[rest] += by
            found.append((int(at), by))
    return going, found


def _set_back(topic: str, times: np.ndarray) -> tuple[str, ...]:
    """Say where the clock of a topic was set back: two stretches then lie over one another."""
    behind = np.maximum.accumulate(times) - times
    if behind.max() <= BACK:
        return ()
    at = int(np.argmax(behind > BACK))
    return (f'the stamps of {topic} go back by {behind[at] * 1e-9:.4g} s in message {at + 1}: its '
            'clock was set, or two publish it, and rows of two instants are mixed',)


def _meet(some: np.ndarray, others: np.ndarray) -> bool:
    """Tell whether two ranges of times have an instant in common."""
    return bool(some.min() <= others.max() and others.min() <= some.max())


def _filled(stamps: np.ndarray, received: np.ndarray) -> tuple[np.ndarray, int]:
    """Return stamps, those that are not set by the receipt, and how late that is, ns."""
    is_set = stamps != 0
    if not is_set.any():
        return received, 0
    by_receipt = received - _late(received, received[is_set], stamps[is_set])
    return (np.where(is_set | (np.abs(by_receipt) < CLOCK), stamps, by_receipt),
            int(np.median(received[is_set] - stamps[is_set])))


def _late(at: np.ndarray, received: np.ndarray, stamps: np.ndarray) -> np.ndarray:
    """Return how long after their stamps messages came that were received at a time, ns."""
    order = np.argsort(received, kind='stable')
    return np.interp(at, received[order], (received - stamps)[order]).astype(np.int64)


def _of_calendar(number: float) -> int:
    """Return a stamp in s, ms, us or ns since 1970 in ns; 0 for a number that is none of them."""
    for unit in (10**9, 10**6, 10**3, 1):
        if 1e9 <= number * unit * 1e-9 < 1e11:  # from 2001 on
            return int(number * unit)
    return 0


def _first(owner: Any, *names: str) -> Any:
    return next((value for name in names if (value := part_of(owner, name, None)) is not None),
                None)
