"""
How much friction grows with the torque that the teeth carry.

Turns at one speed under several constant loads meet the same angle at the same speed with another
torque: what friction differs by, over what the torque differs by, is its share of the load. With
that share taken off, a network over angle and speed (paper 000 eq. 3) holds at any load.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed, Provenance, Servo

from .resampling import AngleTable

SPREAD = 3.0  # N m, how much the torque must differ at one angle and speed
RUNG = 0.05  # speeds that are the same within this share


@dataclass(frozen=True)
class LoadShare:
    """
    Friction for a torque of one, and what is added while the load drives; ``std`` of each.

    ``back_driven`` is 0 with an unknown deviation (NaN) where the load never drove.
    """

    share: float
    back_driven: float
    share_std: float
    back_driven_std: float
    bags: tuple[str, ...]

    def taken_off(self, table: AngleTable) -> AngleTable:
        """Return the friction that does not come from the load."""
        slope = self.share + self.back_driven * (table.load < 0.0)
        return replace(table, torque=table.torque - slope * np.abs(table.load))


def load_share(table: AngleTable, bags: tuple[str, ...] = ()) -> LoadShare | None:
    """
    Return the share of the load in the friction of a table, None where the loads do not differ.

    Least squares with a level of its own for each cell of angle, direction and speed; deviations
    from the scatter between the cells.
    """
    rung = np.round(np.log(table.speed) / RUNG)
    _, group = np.unique(np.column_stack([rung, table.angle, table.forward]), axis=0,
                         return_inverse=True)
    group = group.ravel()
    size = np.bincount(group)

    def within(values: np.ndarray) -> np.ndarray:
        return values - (np.bincount(group, values) / size)[group]

    load = np.abs(table.load)
    columns = [within(load), within(np.where(table.load < 0.0, load, 0.0))]
    if not np.abs(columns[0]).max() > SPREAD:
        return None
    both = bool(np.abs(columns[1]).max() > SPREAD)
    design = np.column_stack(columns[:1 + both])
    inverse = np.linalg.inv(design.T @ design)
    torque = within(table.torque)
    found = inverse @ design.T @ torque
    scores = np.zeros((len(size), 1 + both))
    np.add.at(scores, group, design * (torque - design @ found)[:, None])
    std = np.sqrt(np.diag(inverse @ (scores.T @ scores) @ inverse))
    return LoadShare(float(found[0]), float(found[1]) if both else 0.0, float(std[0]),
                     float(std[1]) if both else float('nan'), bags)


def with_load_share(servo: Servo, found: LoadShare, name: str = 'loaded',
                    site: str = 'load') -> Servo:
    """Return the servo with load-dependent friction at a shaft, in place of any it had there."""
    placed = Placed(name, find('load_dependent_friction'), site)
    values = placed.paths({'share': max(0.0, found.share),
                           'back_driven': max(0.0, found.back_driven)})
    source = 'turns under several loads, cell by cell'
    said = {f'effects.{name}.share': Provenance(source, found.share_std, found.bags)}
    if np.isfinite(found.back_driven_std):
        said[f'effects.{name}.back_driven'] = Provenance(source, found.back_driven_std,
                                                         found.bags)
    bare = servo.without_effects(
        lambda other: other.name == name or (other.effect, other.site) == (placed.effect, site))
    return bare.with_effects(placed, values=values, provenance=said)
