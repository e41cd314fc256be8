"""
Angles of a recording held against each other, to find columns in another unit or on another shaft.

Over a motion that is more than play and noise, motor_position / ratio, load_position and
reference_position move together. A constant factor between them that is 180/pi or the ratio, or a
negative one, is a mistake in the table and not the machine.
"""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np

_TOGETHER = 0.99
"""Correlation from which on two angles count as the same motion."""

_NEAR = 0.1
"""Relative distance within which a factor is taken for a known one."""


def check_angles(path: Path, columns: dict[str, np.ndarray], ratio: float) -> None:
    """
    Raise ValueError when two angles differ by a known factor or in direction.

    ``columns`` in rad, each on its own shaft; ``ratio`` of the servo file.
    """
    at_load = {}
    if _moves(columns.get('load_position')):
        at_load['load_position'] = columns['load_position']
    if _moves(columns.get('motor_position')):
        at_load['motor_position'] = columns['motor_position'] / ratio
    reference = columns.get('reference_position')
    names = list(at_load)
    if len(names) == 2:
        _compare(path, 'motor_position / ratio', at_load['motor_position'], 'load_position',
                 at_load['load_position'], ratio)
    if names and _moves(reference):
        told = 'motor_position / ratio' if names[0] == 'motor_position' else names[0]
        _compare(path, 'reference_position', reference, told, at_load[names[0]], ratio)


def _moves(column: np.ndarray | None) -> bool:
    if column is None or np.isfinite(column).sum() <= 2:
        return False
    return bool(np.nanstd(column) > 0.0)


def _compare(path: Path, name: str, value: np.ndarray, other: str, base: np.ndarray,
             ratio: float) -> None:
    known = np.isfinite(value) & np.isfinite(base)
    if known.sum() < 3 or not (_moves(value[known]) and _moves(base[known])):
        return
    together = float(np.corrcoef(value[known], base[known])[0, 1])
    if abs(together) < _TOGETHER:
        return
    factor = float(np.std(value[known]) / np.std(base[known]))
    if together < 0.0:
        raise ValueError(f'{path}: {name} runs against {other}; positive must be the same way on '
                         'both shafts: negate one, by a mapping file or in the table')
    meanings = {180.0 / pi: f'{name} looks like degrees',
                pi / 180.0: f'{other} looks like degrees'}
    if ratio > 1.0 + 2.0 * _NEAR:
        meanings |= {ratio: f'{name} and {other} look as if one were on the other shaft',
                     1.0 / ratio: f'{name} and {other} look as if one were on the other shaft'}
    for known_factor, meaning in meanings.items():
        if abs(factor / known_factor - 1.0) < _NEAR:
            raise ValueError(
                f'{path}: {name} moves {factor:.4g} times as far as {other} (ratio {ratio:g}): '
                f'{meaning}. Angles are in rad, each on its own shaft; a header may give the '
                "unit, as in 'load_position [deg]'")
