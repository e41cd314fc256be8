r"""
Two encoders that part for good: a coupling that slipped, or an encoder that lost counts.

.. math:: d = \theta_m / N - \theta_l

is compared at the same place, turning the same way, between the quarters of a recording: the first
and the last one, or others where a clutch slips back. So a wrong ratio, an eccentric encoder,
torsion and backlash do not count. What is left must be alike in all places, and more than
all that comes and goes: the torsion of the servo file both ways, what one place shows within a
quarter, and what the two directions differ by.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from servo_twin.physics.servo import Servo

from .finding import Finding, said_once
from .rough_balances import friction_given, torque_of_drive
from .signals import ANGLES, Signals

PLACES, QUARTERS, FEWEST = 40, 4, 4  # bins over the motion; cells that must tell
TURNING = 0.9  # of the smoothed sign of the speed, from which on a direction is clear
ALIKE = 0.25  # of what parted, by which it may differ from place to place
Cells = dict[tuple[int, bool], np.ndarray]
NUMBERS = ('first', 'second', 'third', 'last')


class Parting(NamedTuple):
    """How much further apart two encoders are in a later quarter than in one before, in rad."""

    apart: float
    before: int
    later: int

    def when(self) -> str:
        """Say between which quarters."""
        if (self.before, self.later) == (0, QUARTERS - 1):
            return 'at the end than at the start'
        return f'in the {NUMBERS[self.later]} quarter than in the {NUMBERS[self.before]} one'


def parting_findings(apart: Mapping[str, Parting], servo: Servo) -> list[Finding]:
    """Return a sentence of recordings whose encoders part; ``apart`` by name, rad at the load."""
    unit = servo.reads('rad', ANGLES[1])
    told = [(name, 'at the same place, motor_position / ratio less load_position is '
             f'{abs(one.apart):.3g} {unit} {"more" if one.apart > 0.0 else "less"} {one.when()}.')
            for name, one in apart.items()]
    return [Finding('amber', said, 'look for a coupling, a belt or a clutch that slips, or an '
                    'encoder that loses counts') for said in said_once(told)]


def parted(at: Signals, servo: Servo) -> Parting | None:
    """Return how much further apart encoders come to be, rad at the load; None if they hold."""
    if not {*ANGLES} <= at.plain.keys():
        return None
    motor, load = at.plain[ANGLES[0]] / servo.values['mechanism.ratio'], at.plain[ANGLES[1]]
    most = 2.0 * torsion_of(at, servo)
    # of an encoder that lost counts the other one tells the place
    for place, name in ((motor, ANGLES[0]), (load, ANGLES[1])):
        apart = _apart(motor - load, place, at.sign[name], most)
        if apart:
            return apart
    return None


def _apart(twist: np.ndarray, place: np.ndarray, sign: np.ndarray,
           most: float) -> Parting | None:
    """Return the largest difference between two quarters; None where it may come and go."""
    bins = ((place - place.min()) / max(float(np.ptp(place)), 1e-300) * PLACES).astype(int)
    quarter = np.arange(len(twist)) * QUARTERS // len(twist)
    cells = [_cells(twist, bins, sign, quarter == k) for k in range(QUARTERS)]
    within = [np.ptp(values) for one in cells for values in one.values()]
    ways = [abs(float(values.mean() - one[at, True].mean())) for one in cells
            for (at, forward), values in one.items() if not forward and (at, True) in one]
    across = abs(float(np.polyfit(place, twist, 1)[0]) * np.ptp(place)) / PLACES  # a bin
    usual = most + across + (float(np.median(within)) if within else 0.0) + (
        float(np.median(ways)) if ways else 0.0)
    found = {}
    for before, later in combinations(range(QUARTERS), 2):
        both = cells[before].keys() & cells[later].keys()
        if len(both) < FEWEST:
            continue
        apart = np.array([cells[later][key].mean() - cells[before][key].mean() for key in both])
        middle = float(np.median(apart))
        alike = float(np.median(np.abs(apart - middle))) < ALIKE * abs(middle)
        if alike and abs(middle) > usual:
            found[before, later] = Parting(middle, before, later)
    return found.get((0, QUARTERS - 1)) or max(
        found.values(), key=lambda one: abs(one.apart), default=None)


def _cells(twist: np.ndarray, bins: np.ndarray, sign: np.ndarray, rows: np.ndarray) -> Cells:
    """Return the samples of some rows by place and direction."""
    clear = rows & (np.abs(sign) > TURNING)
    forward = sign > 0.0
    return {(int(at), way): twist[here] for at in np.unique(bins[clear]) for way in (False, True)
            if (here := clear & (bins == at) & (forward == way)).any()}


def torsion_of(at: Signals, servo: Servo) -> float:
    """Return the torsion of the servo file at the largest torque, at the load; 0 if unknown."""
    stiffness, told = servo.values.get('mechanism.stiffness', 0.0), torque_of_drive(at, servo)
    if not stiffness:
        return 0.0
    if told is None:
        return _most_by_the_file(at, servo) / stiffness
    return float(np.max(np.abs(told[0]))) * servo.values['mechanism.ratio'] / stiffness


def _most_by_the_file(at: Signals, servo: Servo) -> float:
    """Return the largest torque at the load that the file has its motion take, whatever drives."""
    name, (slope, level) = ANGLES[1], friction_given(servo)
    if name not in at.speed:
        return 0.0
    of = [f'effects.{placed.name}.' for placed in servo.effects
          if placed.effect.name in ('gravity', 'constant_torque')]
    weight = sum(float(np.linalg.norm([servo.values.get(path + each, 0.0)
                                       for each in ('cosine', 'sine', 'torque')])) for path in of)
    return (servo.values['mechanism.load_inertia'] * float(np.max(np.abs(at.acceleration[name])))
            + slope * float(np.max(np.abs(at.speed[name]))) + level + weight)
