"""The verdict, and what to do next, as a person is told it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .augmented import is_spring
from .balance import BALANCES
from .candidates import Candidate
from .evidence import Evidence
from .noise import signal_of
from .status import Judgement
from .wrong_reading import ENTERS

RIGID = 'the compliance of the transmission (its mechanism is rigid)'
PEOPLE = {
    'drive': 'the drive', 'motor': 'the motor shaft', 'transmission': 'the transmission',
    'load': 'the load shaft', 'torque': 'the torque balance of motor and load',
    'controller': 'the controller', 'sensor': 'the sensors',
}
SETTINGS = {'amplitude': 'V', 'speed': 'rad/s', 'speeds': 'rad/s', 'torque': 'N m', 'period': 's',
            'duration': 's', 'from': 'Hz', 'to': 'Hz', 'frequency': 'Hz',
            'acceleration': 'rad/s2'}
"""Units of the settings of a recording that is proposed."""


def sentence(found: Judgement, evidence: Evidence, balance: str, gone: float) -> str:
    """
    Return the verdict in one sentence or two.

    ``balance`` is where it is said to be, ``gone`` the share by which the gap shrinks.
    """
    worst, reading = found.worst, evidence.reading
    where = PEOPLE.get(balance, balance)
    if found.status == 'no_gap':
        return ('No gap: within its tolerances the twin does what the rig does, down to the noise '
                'floor and the practical margin.')
    if found.status == 'unknown':
        shape = ''
        if worst is not None and worst.depends_on:
            shape = f' It depends on {" and ".join(worst.depends_on[:2])}'
            shape += f' and is {worst.parity} in the direction of motion.'
        if reading:
            shape = (f' {_both(reading)} depart as one, as they do when the reading of the '
                     f'{reading} is wrong.{shape}')
        left = _left(evidence, balance)
        return (f'The twin departs from the rig at {where}, by {100 * left:.2g} % of what acts '
                f'there, and no effect known here explains it.{shape}')
    spoken = _spoken(found.named)
    causes = ', '.join(n.replace('_', ' ') for n in spoken)
    text = (f'The twin departs from the rig at {where}: it lacks {causes}; with '
            f'{"it" if len(spoken) == 1 else "them"} ')
    gone = round(100 * gone)
    if gone > 0:
        text += f'the gap shrinks by {gone} % on recordings nobody fitted to.'
    else:
        text += ('less is left of the balances, but the gap of a twin run anew over recordings '
                 f'nobody fitted to does not shrink ({gone} %).')
    if found.status == 'partly_explained' and found.share >= 0.005:
        text += (f' About {100 * found.share:.0f} % of it still follows a law that is not known '
                 'here.')
    return text


def next_step(following: Mapping[str, Any], linear: bool) -> str:
    """Return what a report proposes to tell two causes apart; a ``linear`` servo moves in m."""
    one, other = following['separates']
    if following['family']:
        settings = ', '.join(f'{name} {_setting(name, value, linear)}'
                             for name, value in following['settings'].items())
        return (f'Record next: {following["family"]} ({settings}). Of what the rig was seen to '
                f'do, it separates {one} from {other} most.')
    said = (f'Of what the rig was seen to do, no recording of ten seconds would separate {one} '
            f'from {other}.')
    value = following.get('measure')
    if value:
        read = ', '.join(f'{number:.4g} {value["unit"]} would mean {cause}'
                         for cause, number in value['values'].items())
        said += f' An instrument would: measure {value["parameter"]} by itself; {read}.'
    return said


def _setting(name: str, value: Any, linear: bool) -> str:
    said = '/'.join(f'{v:.3g}' for v in value) if isinstance(value, (list, tuple)) else (
        f'{value:.3g}' if isinstance(value, (int, float)) else str(value))
    unit = SETTINGS.get(name, '')
    return f'{said} {unit.replace("N m", "N").replace("rad", "m") if linear else unit}'.strip()


def _left(evidence: Evidence, balance: str) -> float:
    """Root mean square of what is left in a balance, as a share of its largest term."""
    stack = evidence.stacks['screen']
    rows = stack.balance == (BALANCES.index(balance) if balance else -1)
    if not rows.any():
        return 0.0
    signal = [signal_of(one, balance, stack.extended.theta) for one in stack.balances
              if balance in one.names]
    size = np.sqrt(np.mean((evidence.left[rows] * stack.scale[rows])**2))
    return float(size / (np.sqrt(np.mean(np.square(signal))) or 1.0))


def _spoken(named: Sequence[Candidate]) -> list[str]:
    """Return what a person is told of the causes: the side too where a name is there twice."""
    names = [cause.name for cause in named]
    return [RIGID if is_spring(cause) else
            f'{cause.name} ({cause.site})' if names.count(cause.name) > 1 else cause.name
            for cause in named]


def _both(reading: str) -> str:
    first, second = (PEOPLE[balance] for balance in ENTERS[reading][:2])
    return f'{first[0].upper()}{first[1:]} and {second}'
