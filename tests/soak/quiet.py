"""Quiet stretches of a soak: what lives long holds no more and more, and a change is found."""

from __future__ import annotations

from collections.abc import Callable
import json
from pathlib import Path
import socket
from time import time

from bench import CONFIG
from rig import Rig

from servo_twin_msgs.srv import LoadServo

EACH, LASTS = 1500.0, 600.0  # s of faults before each stretch, and how long that lasts
SETTLES = 240.0  # s before memory counts: the identify node keeps 180 s of samples
GROWS = 12.0  # MiB an hour from which on a process is not flat
FOUND, PLACED = 90.0, 30.0  # s within which a change must be named, and its place after that
CHANGE = 'withheld.load_drag', 8.0  # N m s/rad at the load of the emulated rig


def stretch(rig: Rig, lasts: float, settles: float, wait: Callable[..., bool]) -> dict:
    """
    Leave a rig alone for ``lasts`` s, then change it, and return what was seen.

    ``begin`` and ``end`` are those of the stretch, ``slopes`` as of Usage.slopes() from
    ``settles`` s on, ``found`` after how long the change was named, None: not; ``place`` where it
    was said to be, ``over`` when it was taken back. Where a change was named before, which is a
    false one, the rig is not changed. ``wait(seconds, until)`` looks at all that
    runs until a condition holds.
    """
    answer = rig.graph.call(rig.graph.loads, LoadServo.Request(
        path=str(CONFIG / 'servos' / 'rv_bench.yaml')), 10.0)  # odd values may be set
    row = {'begin': time(), 'loaded': bool(answer and answer.success)}
    wait(lasts, lambda: False)
    row['end'] = time()
    row['well'] = rig.well()
    row['slopes'] = rig.usage.slopes(settles, (row['begin'], row['end']))
    named = [one for one in rig.ears.events if one[0] >= row['begin'] and one[1] == 'change']
    if rig.bench.identify and not named:  # a balance that was named is not named again
        heard = len(rig.ears.events)

        def told(kind: str) -> list:
            return [one for one in rig.ears.events[heard:] if one[1] == kind]

        switch(rig.bench.faults, CHANGE[0], CHANGE[1])
        named = wait(FOUND, lambda: bool(told('change')))
        row['found'] = told('change')[0][0] - row['end'] if named else None
        placed = named and wait(PLACED, lambda: bool(told('place')))
        row['place'] = told('place')[0][2] if placed else ''
        switch(rig.bench.faults, CHANGE[0], 0.0)
    row['over'] = time()
    return row


def switch(path: Path, fault: str, strength: float) -> None:
    """Switch a fault of the emulated rig. Raises OSError, ValueError where that is refused."""
    with socket.socket(socket.AF_UNIX) as port:
        port.settimeout(10.0)
        port.connect(str(path))
        port.sendall(json.dumps({'set': {fault: strength}}).encode() + b'\n')
        told = json.loads(port.makefile().readline())
    if 'error' in told:
        raise ValueError(told['error'])


def judged(rows: list[dict]) -> list[tuple[str, str, bool | None]]:
    """Return the promises of the quiet stretches: name, what was seen, whether it was kept."""
    if not rows:
        return []
    slopes = [one for row in rows for one in row['slopes']]
    most = max(slopes, key=lambda one: one[2], default=None)
    grown = [f'{name}: {threads:+d} threads, {files:+d} files'
             for name, _, _, threads, files in slopes if threads > 0 or files > 0]
    seen = 'nothing that lived so long' if most is None else (
        f'at most {most[2]:+.1f} MiB an hour, of {most[0]} over {most[1]:.1f} minutes; '
        f'{"; ".join(grown) or "no thread or file more"}')
    promises = [
        ('well, and on its own servo file, at the end of each quiet stretch',
         f'{sum(row["well"] and row["loaded"] for row in rows)} of {len(rows)}',
         all(row['well'] and row['loaded'] for row in rows)),
        (f'flat while nothing happens: no process by more than {GROWS:g} MiB an hour, no thread '
         'and no file more', seen,
         None if most is None else most[2] <= GROWS and not grown)]
    changed = [row for row in rows if 'found' in row]
    if changed:
        found = [row['found'] for row in changed if row['found'] is not None]
        promises.append((
            f'a change of the rig ({CHANGE[0]}) is named within {FOUND:g} s',
            f'{len(found)} of {len(changed)}, the slowest after {max(found, default=0.0):.1f} s; '
            f'{", ".join(sorted({row["place"] or "no place" for row in changed}))}',
            len(found) == len(changed)))
    return promises
