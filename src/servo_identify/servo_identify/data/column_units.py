"""Columns by DESIGN's names, with the units that a header may give them brought to SI."""

from __future__ import annotations

from difflib import get_close_matches
from math import pi
import re

import numpy as np

from servo_twin.recording.recording import COLUMNS

from .tables import Table

NAMES = ('t', *COLUMNS)

_UNIT = {'t': 's'} | COLUMNS
_ALSO = {'time': 't', 'timestamp': 't', 'u': 'voltage', 'v': 'voltage', 'pwm': 'voltage',
         'i': 'current', 'theta': 'motor_position', 'theta_m': 'motor_position',
         'q': 'load_position', 'theta_l': 'load_position', 'tau': 'torque',
         'q_ref': 'reference_position'}
"""What others call a column."""
_TO_SI = {
    's': {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'µs': 1e-6, 'ns': 1e-9, 'min': 60.0},
    'V': {'v': 1.0, 'mv': 1e-3, 'kv': 1e3},
    'A': {'a': 1.0, 'ma': 1e-3},
    'rad': {'rad': 1.0, 'mrad': 1e-3, 'deg': pi / 180, '°': pi / 180, 'degree': pi / 180,
            'degrees': pi / 180, 'rev': 2 * pi, 'turn': 2 * pi, 'turns': 2 * pi,
            'arcmin': pi / 10800, 'arcsec': pi / 648000},
    'rad/s': {'rad/s': 1.0, 'deg/s': pi / 180, '°/s': pi / 180, 'rpm': pi / 30, '1/min': pi / 30,
              'rev/s': 2 * pi},
    'N m': {'nm': 1.0, 'mnm': 1e-3, 'knm': 1e3, 'ncm': 1e-2},
    'degC': {'degc': 1.0, '°c': 1.0, 'c': 1.0},
}
_LINEAR = {
    'rad': {'m': 1.0, 'mm': 1e-3, 'um': 1e-6, 'µm': 1e-6},
    'rad/s': {'m/s': 1.0, 'mm/s': 1e-3},
    'N m': {'n': 1.0, 'kn': 1e3},
}


def named_columns(table: Table, linear: bool, warnings: list[str]) -> dict[str, np.ndarray]:
    """
    Return the columns of :data:`NAMES` in SI units; ``linear``: m for rad and N for N m.

    A header may give a unit, as in ``motor_position [deg]``: another than SI is converted, with a
    warning. Raises ValueError for an unknown unit, a name given twice, and a column whose name
    looks like a missing one; other columns are left out with a warning.
    """
    found: dict[str, np.ndarray] = {}
    strangers: list[str] = []
    for header, column in table.columns.items():
        name, unit = _split(header)
        if name not in NAMES:
            strangers.append(header)
            continue
        if name in found:
            raise ValueError(f'{table.path}: column {name!r} is there twice')
        found[name] = column * _factor(table, header, name, unit, linear, warnings)
    _judge_strangers(table, strangers, [name for name in NAMES if name not in found], warnings)
    return found


def _split(header: str) -> tuple[str, str]:
    match = re.fullmatch(r'\s*(\w+)\s*[\[(]\s*(.*?)\s*[\])]\s*', header)
    return (match[1], match[2]) if match else (header.strip(), '')


def _factor(table: Table, header: str, name: str, unit: str, linear: bool,
            warnings: list[str]) -> float:
    if not unit:
        return 1.0
    wanted = _UNIT[name]
    known = _TO_SI[wanted] | (_LINEAR.get(wanted, {}) if linear else {})
    plain = re.sub(r'[\s·*.]', '', unit).lower()
    if plain not in known:
        hint = ('; a linear axis says so in its servo file: travel: linear'
                if plain in _LINEAR.get(wanted, {}) else '')
        raise ValueError(f'{table.path}: column {header!r} is in {unit!r}, {name} is in {wanted}; '
                         f'known units are {list(known)}{hint}')
    factor = known[plain]
    if factor != 1.0:
        warnings.append(f'column {header!r} is converted to {wanted} by {factor:.9g}')
    return factor


def _judge_strangers(table: Table, strangers: list[str], missing: list[str],
                     warnings: list[str]) -> None:
    for header in strangers:
        name = _split(header)[0]
        words = set(name.lower().split('_')) - {'reference', 'position'}
        also = _ALSO.get(name.lower())
        like = [also] if also in missing else get_close_matches(name.lower(), missing, 1, 0.7) or [
            candidate for candidate in missing if len(words & set(candidate.split('_'))) > 0]
        if like:
            raise ValueError(
                f'{table.path}: there is no column {header!r}; is it {like[0]!r}? Rename it, or '
                f'say so in a mapping file. Columns are {list(NAMES)}')
    if strangers:
        warnings.append(f'columns {strangers} are left out: they are none of {list(NAMES)}')
