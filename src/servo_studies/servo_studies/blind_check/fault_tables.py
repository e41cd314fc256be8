"""Machines and faults of the blind check, read from the tables beside this file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from servo_twin.description import servo_file
from servo_twin.physics.catalogue import names
from servo_twin.physics.servo import Servo

_HERE = Path(__file__).parent
SPLITS = ('screen', 'accept', 'report')


def config_folder() -> Path:
    """Return the folder `config` of the workspace; raises OSError where there is none."""
    for folder in (Path.cwd(), *Path.cwd().parents, *_HERE.resolve().parents):
        if (folder / 'config' / 'rigs').is_dir():
            return folder / 'config'
    raise OSError(f'no folder config/rigs above {Path.cwd()} or {_HERE}; run it in the workspace')


@dataclass(frozen=True)
class Machine:
    """An emulated rig that its servo file describes within tolerance, and how it is excited."""

    name: str
    rig: str
    servo: str
    set: Mapping[str, float]
    tolerated: Mapping[str, tuple[str, ...]]
    recordings: Mapping[str, Mapping[str, Mapping[str, Any]]]

    @property
    def rig_path(self) -> Path:
        """The rig file."""
        return config_folder() / self.rig

    @property
    def servo_path(self) -> Path:
        """The servo file."""
        return config_folder() / self.servo

    def base(self, path: str) -> float:
        """Value of a tolerated property as the servo file has it."""
        return _servo(self.servo_path).values[self.tolerated[path][0]]

    def share(self, path: str) -> float:
        """How far a tolerated property may be off, as a share of its value."""
        servo = _servo(self.servo_path)
        shares = [min(1.0 - servo.tolerance[p][0] / servo.values[p],
                      servo.tolerance[p][1] / servo.values[p] - 1.0)
                  for p in self.tolerated[path]]
        return min(shares)


@dataclass(frozen=True)
class Fault:
    """Something that the rig can have and the servo file lacks; see faults.yaml."""

    name: str
    property: str
    balances: tuple[str, ...]
    start: Mapping[str, float]
    names: tuple[str, ...] = ()
    site: str = ''
    also: Mapping[str, str] = field(default_factory=dict)
    remove: tuple[str, ...] = ()
    set: Mapping[str, float] = field(default_factory=dict)
    vary: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    relative: bool = False
    inverse: bool = False
    share: bool = False
    tolerance_of: str = ''
    granted: float = 0.0

    @property
    def known(self) -> bool:
        """Whether the catalogue has it."""
        return bool(self.names)

    @property
    def removable(self) -> bool:
        """Whether all that makes it up can be taken out of the catalogue."""
        return bool(self.remove) and set(self.remove) <= set(names())

    @property
    def accepted(self) -> frozenset[str]:
        """All names that count as right."""
        return frozenset(self.names) | frozenset(self.also)

    def settings(self, machine: Machine, severity: float) -> dict[str, float]:
        """Properties of the rig that give the fault at a severity."""
        value = severity
        if self.relative:
            value = machine.base(self.property) * (1.0 + severity)
        elif self.inverse:
            value = 1.0 / severity
        return {**self.set, self.property: value}


@cache
def machines() -> dict[str, Machine]:
    """Return the machines by name."""
    table = _table('machines')
    return {name: Machine(name, row['rig'], row['servo'], row['set'],
                          {k: tuple(v) for k, v in row['tolerated'].items()}, row['recordings'])
            for name, row in table.items()}


@cache
def faults() -> dict[str, Fault]:
    """Return the faults by name."""
    return {name: _fault(name, row) for name, row in _table('faults').items()}


@cache
def severities() -> dict[str, dict[str, float]]:
    """Return the smallest detectable severity by machine and fault."""
    return {machine: {fault: row['severity'] for fault, row in rows.items()
                      if row['severity'] is not None}
            for machine, rows in (_table('severities') or {}).items()}


@cache
def plans() -> dict[str, dict[str, Any]]:
    """Return the frozen plans: which seeds, how many cases of each kind."""
    return _table('plans')


def _fault(name: str, row: dict[str, Any]) -> Fault:
    row = dict(row)
    for key in ('names', 'balances', 'remove'):
        row[key] = tuple(row.get(key, ()))
    row['vary'] = {k: tuple(v) for k, v in row.get('vary', {}).items()}
    row['set'] = row.pop('with', {})
    if row.get('relative'):
        row |= {'share': True, 'tolerance_of': row['property']}
    return Fault(name, **row)


def _table(name: str) -> Any:
    path = _HERE / f'{name}.yaml'
    return yaml.safe_load(path.read_text('utf8')) if path.is_file() else {}


@cache
def _servo(path: Path) -> Servo:
    return servo_file.load(path)
