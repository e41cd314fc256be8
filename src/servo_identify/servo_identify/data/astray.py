r"""
A reference that the angle does not follow: another quantity, or a loop that does not reach it.

.. math:: |r - z - g\,\theta|^2 > e_a\,|r - z|^2, \qquad r - z \approx g\,\dot\theta

An encoder and a set-point of one shaft differ in their form only where the loop follows badly.
The law of the controller tells a right reference from the command, however badly it is followed
(:mod:`.control_law`). Where the law does not close either, the column is asked about.
"""

from __future__ import annotations

from collections.abc import Sequence

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .control_law import factors_by_law
from .finding import Finding, said_once
from .likelihood import ASTRAY
from .mistakes import unread
from .shown_factor import motions, shared_form
from .shown_ratio import FORM
from .signals import Signals

OTHER = {'reference_position': ('reference_velocity', 'the speed of the shaft'),
         'reference_velocity': ('reference_position', 'the angle of the shaft')}


def astray(usable: Sequence[tuple[Recording, Signals]], servo: Servo) -> dict[str, list[Finding]]:
    """
    Return what is to be said of references that the angle does not follow, by channel.

    References that the controller of the servo does not read are left out.
    """
    skipped, found = unread(servo), {name: [] for name in OTHER}
    for one, at in usable:
        motion = motions(at, servo)
        apart = {name: shared_form(motion[name], at.plain[name])[1] for name in OTHER
                 if name in motion and name in at.plain and name not in at.silent | skipped}
        apart = {name: left for name, left in apart.items() if left > ASTRAY}
        told = factors_by_law(one, servo) if apart else {}
        for name in apart.keys() - told.keys():
            found[name].append((one.name, _said(name, shared_form(
                motion[OTHER[name][0]], at.plain[name])[1] < FORM**2)))
    return {name: [Finding('amber', sentence, _action(name)) for sentence in said_once(said)]
            for name, said in found.items() if said}


def _said(name: str, as_other: bool) -> str:
    other, words = OTHER[name]
    return f'the shaft does not follow {name}, ' + (
        f'which goes as {words} does: is it a {other}?' if as_other else
        'whatever its factor: is it another quantity, such as a speed, or of another joint?')


def _action(name: str) -> str:
    return (f'hold the column against the channel list of the logger: map it to {OTHER[name][0]} '
            'where it is that, and leave it out where it is no set-point of this shaft')
