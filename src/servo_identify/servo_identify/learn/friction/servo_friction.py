"""The friction networks of paper 000, forward and reverse, put into a servo."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from servo_twin.physics.catalogue import find
from servo_twin.physics.element_names import split_name
from servo_twin.physics.servo import Placed, Provenance, Servo
from servo_twin.recording.recording import Recording

from ...fit.estimate import bag_name
from ..error_scores import Scores, scores_of
from .friction_network import Network, trained
from .friction_samples import BRISTLES, friction_of
from .load_share import load_share, LoadShare, with_load_share
from .resampling import AngleTable, equal_angles


@dataclass(frozen=True)
class LearnedFriction:
    """
    Networks of both directions, the table they learned from, and their table 1 figures.

    ``share`` of the load that was taken off before (None: the loads did not differ).
    """

    site: str
    forward: Network
    reverse: Network
    table: AngleTable
    held: np.ndarray
    forward_scores: Scores
    reverse_scores: Scores
    bags: tuple[str, ...]
    share: LoadShare | None = None


def learned_friction(servo: Servo, recordings: list[Recording], site: str = 'load', *,
                     cells: int = 360, seed: int = 0, told=None) -> LearnedFriction:
    """
    Train both networks on equal-angle tables; every fifth cell of angle is kept for validation.

    Where recordings at one speed differ in their load, its share of the friction is found first
    and taken off, so that the networks hold at any load. Raises ValueError where the recordings
    hold no steady turns in one of the directions.
    """
    table = equal_angles(friction_of(servo, recordings, site), cells)
    bags = tuple(bag_name(r) for r in recordings)
    share = load_share(table, bags)
    if share is not None:
        table = share.taken_off(table)
    held = np.round(table.angle / table.turn * cells).astype(int) % 5 == 2
    networks, scores = [], []
    for forward in (True, False):
        mine = table.forward == forward
        if not mine.any():
            raise ValueError(f'no steady turn {"forward" if forward else "in reverse"}: friction '
                             'is learned from turns in both directions')
        part, kept = table[mine], held[mine]
        network = trained(part.angle, part.speed, part.torque, held=kept, seed=seed, told=told)
        networks.append(network)
        scores.append(scores_of(part.torque[kept], network(part.angle[kept], part.speed[kept])))
    return LearnedFriction(site, *networks, table, held, *scores, bags, share)


def with_friction(servo: Servo, learned: LearnedFriction, name: str = 'friction') -> Servo:
    """Return the servo with its friction at that shaft replaced by the learned networks."""
    def rubs(other: Placed) -> bool:
        return other.site == learned.site and (
            other.effect.port == 'friction' or other.effect.name in BRISTLES)

    forward, reverse = learned.forward, learned.reverse
    values: dict = {'turn': learned.table.turn,
                    'angle_centre': float(forward.centre[0]),
                    'angle_span': float(forward.span[0]),
                    'speed_centre': float(forward.centre[1]),
                    'speed_span': float(forward.span[1])}
    for way, network in (('forward', forward), ('reverse', _rescaled(reverse, forward))):
        for part in ('angle', 'speed', 'threshold', 'weight'):
            values[f'{way}_{part}'] = tuple(float(v) for v in getattr(network, part))
        values[f'{way}_level'] = float(network.level)
    placed = Placed(name, find('network_friction'), learned.site)
    paths = placed.paths(values)
    said = Provenance('learned from turns, paper 000 eq. 5, 6', None, learned.bags)
    servo = servo.without_effects(rubs).with_effects(placed, values=paths,
                                                     provenance=dict.fromkeys(paths, said))
    return servo if learned.share is None else with_load_share(servo, learned.share,
                                                               site=learned.site)


def _rescaled(network: Network, other: Network) -> Network:
    """Return the same network for the input scaling of another."""
    angle = network.angle * other.span[0] / network.span[0]
    speed = network.speed * other.span[1] / network.span[1]
    shift = (network.angle * (other.centre[0] - network.centre[0]) / network.span[0]
             + network.speed * (other.centre[1] - network.centre[1]) / network.span[1])
    return Network(angle, speed, network.threshold - shift, network.weight, network.level,
                   other.centre, other.span, network.losses)


def with_motor_friction(servo: Servo, recordings: list[Recording]) -> tuple[Servo, str]:
    """
    Return the servo with Coulomb and viscous friction of the motor side, from the motor balance.

    Least squares on the steady stretches; the standard errors are those of the means of the runs,
    which are what repeats, not of their samples.
    """
    table = equal_angles(friction_of(servo, recordings, 'motor'), 36, slowest=0.1)
    runs = np.unique(np.column_stack([np.round(table.speed, 1), table.forward]), axis=0)
    rows = [(np.round(table.speed, 1) == speed) & (table.forward == way) for speed, way in runs]
    speed = np.array([table.speed[r].mean() for r in rows])
    torque = np.array([table.torque[r].mean() for r in rows])
    if len(np.unique(np.round(speed))) < 2:
        raise ValueError('motor friction needs turns at two speeds at least')
    design = np.column_stack([np.ones_like(speed), speed])
    found, *_ = np.linalg.lstsq(design, torque, rcond=None)
    noise = np.sum((torque - design @ found) ** 2) / max(1, len(speed) - 2)
    std = np.sqrt(np.diag(noise * np.linalg.inv(design.T @ design)))
    level, slope = (max(0.0, float(v)) for v in found)
    bags = tuple(bag_name(r) for r in recordings)
    placed, values, provenance = [], {}, {}
    for name, kind, parameter, value, error in (
            ('motor_coulomb', 'coulomb_friction', 'level', level, std[0]),
            ('motor_viscous', 'viscous_friction', 'slope', slope, std[1])):
        placed.append(Placed(name, find(kind), 'motor'))
        values[f'effects.{name}.{parameter}'] = value
        provenance[f'effects.{name}.{parameter}'] = Provenance(
            'motor balance of steady turns', float(error), bags)
    bare = servo.without_effects(
        lambda other: other.site == 'motor' and other.effect.port == 'friction')
    better = bare.with_effects(*placed, values=values, provenance=provenance)
    tolerance = {k: v for k, v in servo.tolerance.items()
                 if split_name(k)[0] in better.values}
    servo = replace(better, tolerance=tolerance)  # of the values found too, where they had one
    return servo, (f'friction at the motor: {level:.5g} N m + {slope:.3g} N m s/rad '
                   f'(± {std[0]:.2g}, {std[1]:.2g})')
