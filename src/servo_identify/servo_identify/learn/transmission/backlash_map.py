"""
Backlash over angle and load, as in paper 000 section 3.2.

Under a constant load the transmission error is measured in both directions; forward less reverse
is the backlash. Its low orders are kept: the high ones are those of the transmission error. A gap
is crossed only where the teeth change flanks, so a forward pass that carries positive torque is
paired with a reverse pass that carries as much negative torque. Where a load simulator pulls one
way only, this takes two recordings, and encoders that keep their zero between them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed, Provenance, Servo
from servo_twin.recording.recording import Recording

from ...fit.estimate import bag_name
from ..error_scores import Scores, scores_of
from ..friction.friction_network import Network, trained
from .order_spectrum import amplitudes, dominant, rebuilt
from .transmission_harmonics import ARCMIN, gap_takes_low_orders, LOW
from .turn_passes import angles, passes_of

ALIKE = 0.1  # two torques are the same load within this share
ITERATIONS = 300  # of the network, at most


@dataclass(frozen=True)
class LearnedBacklash:
    """
    The network and what it learned from.

    ``loads`` (curves,) N m; ``gaps`` (curves, cells) rad, measured less high orders; ``orders``
    how many low orders were kept; ``scores`` in arcmin on the cells kept for validation.
    """

    network: Network
    loads: np.ndarray
    raw: np.ndarray
    gaps: np.ndarray
    orders: int
    scores: Scores
    bags: tuple[str, ...]


def learned_backlash(servo: Servo, recordings: list[Recording], cells: int = 720,
                     seed: int = 0, iterations: int = ITERATIONS, told=None) -> LearnedBacklash:
    """
    Learn the gap from turns in both directions under constant loads of both signs.

    The loads are the mean size of the transmitted torque of a pair of passes.
    ``told(iteration, loss, held loss)``, arcmin2, after each of at most ``iterations``.
    Raises ValueError where fewer than two loads pair up.
    """
    passes = [p for p in passes_of(servo, recordings, cells) if p.covered > 0.5]
    ahead = [p for p in passes if p.forward and p.load > 0.0]
    back = [p for p in passes if not p.forward and p.load < 0.0]
    loads, raw = [], []
    for one in ahead:
        for other in sorted(back, key=lambda p: (p.recording != one.recording,
                                                 abs(p.load + one.load))):
            if abs(one.load + other.load) < ALIKE * one.load + 1.0:
                raw.append(one.lost - other.lost)
                loads.append(0.5 * (one.load - other.load))
                break
    if not loads:
        raise ValueError('no forward pass with positive torque has a reverse pass with as much '
                         f'negative torque; torques are {[round(p.load, 1) for p in ahead]} and '
                         f'{[round(p.load, 1) for p in back]} N m')
    if len(set(np.round(loads))) < 2:
        raise ValueError(f'backlash over load needs recordings at two loads at least, not at '
                         f'{np.round(loads, 1).tolist()} N m')
    order = np.argsort(loads)
    loads, raw = np.array(loads)[order], np.array(raw)[order]
    kept = [o for o in dominant(list(raw)) if o <= LOW]
    gaps = np.array([np.nanmean(r) + rebuilt(amplitudes(r - np.nanmean(r)), kept, cells)
                     for r in raw])
    gaps = np.maximum(gaps, 0.0)
    angle = np.tile(angles(cells), len(loads))
    load = np.repeat(loads, cells)
    held = np.tile(np.arange(cells) % 5 == 2, len(loads))
    network = trained(angle, load, gaps.ravel() / ARCMIN, held=held, seed=seed,
                      iterations=iterations, told=told)
    scores = scores_of(gaps.ravel()[held] / ARCMIN, network(angle[held], load[held]))
    network = replace(network, weight=network.weight * ARCMIN, level=network.level * ARCMIN)
    return LearnedBacklash(network, loads, raw, gaps, len(kept), scores,
                           tuple(bag_name(r) for r in recordings))


def with_backlash(servo: Servo, learned: LearnedBacklash, name: str = 'backlash') -> Servo:
    """Return the servo with its clearances replaced by the learned network."""
    placed = Placed(name, find('network_backlash'), 'mesh')
    values = placed.paths(learned.network.values('angle', 'load'))
    said = Provenance('bidirectional transmission error, paper 000 section 3.2', None,
                      learned.bags)
    bare = servo.without_effects(lambda other: other.effect.port == 'clearance')
    return gap_takes_low_orders(bare.with_effects(placed, values=values,
                                                  provenance=dict.fromkeys(values, said)))
