"""
A network parallel to an analytical model (paper 001 eq. 22 to 27).

What the model's position of the load is off by is taken from recordings of a closed position loop,
whose reference the model is given and nothing else. Two inputs, the wanted position and that of
the analytical model; ten sigmoids; one output, which is added to the model's. The paper descends
the gradient of eq. 25; Levenberg-Marquardt finds a minimum of the same error in seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed, Provenance, Servo
from servo_twin.recording.joined_samples import reference_of
from servo_twin.recording.recording import Recording

from ...fit.estimate import bag_name
from ..error_scores import Scores, scores_of
from ..free_run import rolled
from ..friction.friction_network import Network, trained

HIDDEN = 10  # nodes, paper 001 eq. 22
EVERY = 0.005  # s between the rows that are trained on
FIFTH = 5  # one second of so many is kept back
STARTS = 3  # of the training, of which the best on what is kept back is taken


@dataclass(frozen=True)
class LearnedDeviation:
    """The network, of tansig nodes as trained; ``scores`` at the load on seconds kept back."""

    network: Network
    scores: Scores
    bags: tuple[str, ...]


def learned_deviation(servo: Servo, recordings: Sequence[Recording], *, seed: int = 0,
                      told: Callable[[float, float], None] | None = None) -> LearnedDeviation:
    """
    Learn what the servo's position of the load is off by in its closed position loop.

    ``told`` is given the share that is done and the mean square error on what is kept back.
    Raises ValueError for recordings without a wanted position or a position of the load, and for
    a servo whose controller does not follow a position.
    """
    if not recordings:
        raise ValueError('there is no recording to learn a deviation from')
    bare = without_deviation(servo)
    if reference_of(bare) != 'reference_position':
        raise ValueError(f'{servo.name}: its controller follows no position; a deviation is '
                         'learned in a closed position loop (controller position_loop)')
    wanted, behind, off, second = (np.concatenate(column) for column in zip(
        *(_deviation(bare, recording) for recording in recordings), strict=True))
    held = second % FIFTH == 2
    best = None
    for start in range(STARTS):
        network = trained(wanted, behind, off, hidden=HIDDEN, held=held, seed=seed + start)
        scores = scores_of(off[held], network(wanted[held], behind[held]))
        if best is None or scores.mse < best[1].mse:
            best = network, scores
        if told:
            told((start + 1) / STARTS, best[1].mse)
    return LearnedDeviation(*best, tuple(bag_name(r) for r in recordings))


def without_deviation(servo: Servo) -> Servo:
    """Return the servo without any network parallel to it: the analytical model."""
    return servo.without_effects(lambda placed: placed.effect.name == 'network_deviation')


def with_deviation(servo: Servo, learned: LearnedDeviation, name: str = 'deviation') -> Servo:
    """Return the servo with the network in place of any it had: the hybrid model."""
    placed = Placed(name, find('network_deviation'), 'load_position')
    values = placed.paths(learned.network.sigmoid_values('wanted', 'behind'))
    said = Provenance('position that was missing, paper 001 eq. 27', None, learned.bags)
    return without_deviation(servo).with_effects(
        placed, values=values, provenance=dict.fromkeys(values, said))


def _deviation(servo: Servo, recording: Recording) -> tuple[np.ndarray, ...]:
    """Return wanted position, how far the model is beyond it, what it is off by, and second."""
    for channel in ('reference_position', 'load_position'):
        if not recording.has(channel):
            raise ValueError(f'{recording.name}: {channel} is missing; a deviation is learned '
                             'where a wanted position is followed and the load is measured')
    y = rolled(servo, recording, 'closed_loop')
    rows = np.arange(len(recording))[::max(1, round(EVERY / recording.period))]
    wanted = recording['reference_position'][rows]
    off = recording['load_position'][rows] - y[rows, 1]
    good = np.isfinite(wanted) & np.isfinite(off)
    behind = y[rows, 1] - wanted
    return wanted[good], behind[good], off[good], (rows[good] * recording.period).astype(int)
