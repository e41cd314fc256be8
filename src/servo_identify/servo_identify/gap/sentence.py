"""The verdict as a person is told it."""

from __future__ import annotations

from collections.abc import Sequence

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
