"""Which recordings select, which accept and which report: by recording, never by sample."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from servo_twin.recording.recording import Recording

HELD_OUT_FIRST = ('multisine', 'sine', 'chirp', 'square', 'ramps', 'turns')
"""Families that are missed least in the selection when each was recorded once."""
RESTS = 0.01  # share of the travel within which a machine rests where it begins or ends
PURPOSES = ('screen', 'accept', 'report')
FEWEST_PARTS = 3  # of one bag, of which each serves one purpose
REST = 0.5  # s of rest that are kept before and after


@dataclass(frozen=True)
class Split:
    """Recordings by their purpose; no recording serves two unless ``warnings`` says so."""

    screen: tuple[Recording, ...]
    accept: tuple[Recording, ...]
    report: tuple[Recording, ...]
    warnings: tuple[str, ...] = ()


def split(recordings: list[Recording], accept: list[Recording],
          report: list[Recording]) -> Split:
    """
    Part recordings into those that select, accept and report.

    What the caller names for accepting or reporting is taken as it is. Of replicates one goes to
    each purpose; where there are too few, two recordings are held out, first those whose motion
    others repeat; fewer recordings than purposes are each cut in time. Parts of one bag serve in
    turn.
    """
    if accept and report:
        return Split(tuple(recordings), tuple(accept), tuple(report))
    if len(recordings) < len(PURPOSES) and not (accept or report):
        return _cut(recordings)
    if not (accept or report) and len(recordings) >= FEWEST_PARTS and recordings[0].digest and (
            len({(one.digest, one.family, one.replicate) for one in recordings}) == 1):
        return _in_turn(recordings)
    pool, held = list(recordings), {'accept': list(accept), 'report': list(report)}
    warnings = []
    wanted = [purpose for purpose in ('report', 'accept') if not held[purpose]]
    families = defaultdict(list)
    for one in pool:
        families[one.family].append(one)
    several = [group for family, group in families.items() if len(group) > len(wanted) and family]
    for group in several:
        for purpose in wanted:
            held[purpose].append(group.pop())
    if not several:
        for purpose in wanted:
            spare = _others(pool, held)
            if len(spare) <= 1:
                held[purpose] = list(held['report'] or held['accept'] or spare)
                warnings.append(f'too few recordings: those that {purpose} serve twice; '
                                'the shrink may be flattered')
                continue
            left = Counter(one.family for one in spare if one.family)
            held[purpose].append(min(spare, key=lambda one: (
                left[one.family] < 2, _missed(one), -one.replicate)))
        warnings.append(_held_out(families, 1 + len(wanted)))
    screen = tuple(_others(pool, held)) or tuple(held['accept'])
    return Split(screen, tuple(held['accept']), tuple(held['report']), tuple(warnings))


def _in_turn(parts: list[Recording]) -> Split:
    """Of every five parts of one bag the second accepts, the third reports, the others select."""
    accept, report = parts[1::5], parts[2::5]
    return Split(tuple(_others(parts, {'accept': accept, 'report': report})), tuple(accept),
                 tuple(report), (
        'parts of one bag: nothing can be said about other excitations, and without replicates '
        'the noise floor is that of their own fast part',))


def _held_out(families: Mapping[str, list[Recording]], needed: int) -> str:
    """Say why recordings of other motions are held out, what that costs and what to do."""
    if len(families.get('', ())) >= needed:
        why, action = ('these recordings do not say which of them repeat the same motion',
                       'name the motion of each on import: --family, or recordings.yaml beside '
                       'the tables')
    else:
        why = f'no motion was recorded {needed} times'
        action = f'record one motion {needed} times, and give all of them its --family'
    return (f'{why}, to select, accept and report on: recordings of other motions were held out, '
            f'and an effect that only they excite cannot be found; {action}')


def _others(pool: list[Recording], held: Mapping[str, list[Recording]]) -> list[Recording]:
    """Return those that are held out for no purpose; several may have one name."""
    out = {id(one) for kept in held.values() for one in kept}
    return [one for one in pool if id(one) not in out]


def _missed(recording: Recording) -> int:
    family = recording.family
    return HELD_OUT_FIRST.index(family) if family in HELD_OUT_FIRST else len(HELD_OUT_FIRST)


def _moving(recording: Recording) -> tuple[int, int]:
    """Return the samples from which and to which a machine moves: nothing is judged at rest."""
    size, inside = len(recording), []
    for name in ('motor_position', 'load_position'):
        x = recording[name][np.isfinite(recording[name])]
        if len(x) and np.ptp(x) > 0.0:
            away = RESTS * np.ptp(x)
            x = recording[name]
            moved = [np.flatnonzero(np.abs(x - end) > away) for end in (
                x[np.isfinite(x)][0], x[np.isfinite(x)][-1])]
            inside.append((moved[0][0], moved[1][-1] + 1))
    if not inside:
        return 0, size
    spare = round(REST / recording.period)
    return (max(0, min(first for first, _ in inside) - spare),
            min(size, max(last for _, last in inside) + spare))


def whole_of(part: Recording) -> str:
    """Return the name of the recording that a part of it was cut from, its own for a whole one."""
    whole, _, purpose = part.name.rpartition('[')
    return whole if purpose.rstrip(']') in PURPOSES and whole else part.name


def _cut(recordings: Sequence[Recording]) -> Split:
    """Cut each recording in time: three fifths select, a fifth accepts, a fifth reports."""
    parts: dict[str, list[Recording]] = {purpose: [] for purpose in PURPOSES}
    for recording in recordings:
        first, last = _moving(recording)
        size = last - first
        edges = [first, first + int(0.6 * size), first + int(0.8 * size), last]
        for purpose, begin, end in zip(PURPOSES, edges[:-1], edges[1:], strict=True):
            columns = {n: np.ascontiguousarray(c[begin:end])
                       for n, c in recording.columns.items()}
            parts[purpose].append(replace(
                recording, name=f'{recording.name}[{purpose}]', columns=columns,
                start=recording.start + begin * recording.period))
    few = 'one recording only' if len(recordings) == 1 else f'{len(recordings)} recordings only'
    screen, accept, report = (tuple(parts[purpose]) for purpose in PURPOSES)
    return Split(screen, accept, report, (
        f'{few}, cut in time: nothing can be said about other excitations, and without '
        'replicates the noise floor is that of their own fast part',))
