"""Reads a rig file: the machine to emulate and how strong each of its effects is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from types import ModuleType

import numpy as np
import yaml

from ..home_path import at_home
from ..nearest_name import or_what
from ..plain_yaml import read_yaml
from .rig_physics import World, WORLDS

STEP = 2e-5  # s
_TOP = ('name', 'physics', 'dictionaries', 'step', 'switches')


class RigFileError(ValueError):
    """A rig file that cannot be used; the text names the key, the value and the choice."""


@dataclass(frozen=True)
class Switch:
    """Properties that take new values ``at`` a time of the simulation, s."""

    at: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class RigSettings:
    """One emulated rig: ``values`` by path, ``step`` the largest substep in s, kind of physics."""

    name: str
    dictionaries: str
    step: float
    values: Mapping[str, float]
    switches: tuple[Switch, ...] = field(default=())
    kind: str = 'servo'

    @property
    def physics(self) -> ModuleType:
        """The module that moves this rig, see rig_physics.py."""
        return WORLDS[self.kind].physics

    def parameters(self) -> np.ndarray:
        """Return the values as the record that the compiled simulation reads."""
        world = WORLDS[self.kind]
        record = np.zeros(1, world.dtype)
        for path, value in self.values.items():
            record[world.by_path[path].name] = value
        return record

    def with_values(self, values: Mapping[str, float]) -> RigSettings:
        """Return a rig with other values by path; raises RigFileError as load_rig does."""
        world = WORLDS[self.kind]
        changed = {path: _value(world, path, raw) for path, raw in values.items()}
        return replace(self, values={**self.values, **changed})


def load_rig(path: str | Path, overrides: Sequence[str] = ()) -> RigSettings:
    """
    Read a rig file, or the shipped one of a name.

    ``overrides`` are texts like 'friction.level=1.5'.

    What the file leaves out is as on the bench of paper 000. Raises RigFileError for a file that
    is no YAML mapping, an unknown key, a value that is no number or out of range.
    """
    path = rig_at(path)
    try:
        content = read_yaml(path.read_text())
    except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
        raise RigFileError(f'{path} cannot be read: {error}') from error
    try:
        return rig_settings(content, overrides)
    except RigFileError as error:
        raise RigFileError(f'{path}: {error}') from error


def rig_at(name_or_path: str | Path) -> Path:
    """Return a path as it is, and for a bare name that of the shipped rig file."""
    try:
        path = at_home(name_or_path)
    except ValueError as error:
        raise RigFileError(str(error)) from None
    if path.suffix or len(path.parts) != 1 or path.is_file():
        return path
    try:
        from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
    except ImportError:  # without ROS there are paths only
        return path
    try:
        folder = Path(get_package_share_directory('servo_rig_driver')) / 'config' / 'rigs'
    except PackageNotFoundError:
        return path
    found = folder / f'{path.name}.yaml'
    if not found.is_file():
        known = sorted(file.stem for file in folder.glob('*.yaml'))
        raise RigFileError(f'{path.name!r} is no shipped rig; there are {known}')
    return found


def rig_settings(content: object, overrides: Sequence[str] = ()) -> RigSettings:
    """Return the settings of a mapping as read from YAML; raises RigFileError as load_rig does."""
    if not isinstance(content, Mapping):
        raise RigFileError('a rig file is a mapping of sections, see config/rigs/rv_bench.yaml')
    kind = content.get('physics', 'servo')
    if kind not in WORLDS:
        raise RigFileError(f'physics = {kind!r} is unknown; it is one of {list(WORLDS)}')
    world = WORLDS[kind]
    values = world.defaults()
    for key, section in content.items():
        if key in _TOP:
            continue
        if key not in world.sections:
            raise RigFileError(f"has no section '{key}'; "
                               f'{or_what(key, [*_TOP, *world.sections])}')
        if not isinstance(section, Mapping):
            raise RigFileError(f"section '{key}' must be a mapping, it is {section!r}")
        for name, raw in section.items():
            values[f'{key}.{name}'] = _value(world, f'{key}.{name}', raw)
    step = _number('step', content.get('step', STEP))
    if not 1e-7 <= step <= 1e-4:
        raise RigFileError(f'step = {step} s is outside [1e-07, 0.0001]')
    rig = RigSettings(str(content.get('name', 'rig')),
                      str(content.get('dictionaries', 'rv_bench')), step, values,
                      _switches(world, content.get('switches') or ()), kind)
    return rig.with_values(dict(_override(text) for text in overrides))


def _switches(world: World, entries: object) -> tuple[Switch, ...]:
    switches = []
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        raise RigFileError(f'switches = {entries!r} must be a list of {{at, set}}')
    for entry in entries:
        if not isinstance(entry, Mapping) or set(entry) != {'at', 'set'} \
                or not isinstance(entry['set'], Mapping):
            raise RigFileError(f'switch {entry!r} must have the keys at and set')
        switches.append(Switch(_number('switches.at', entry['at']), {
            path: _value(world, path, raw) for path, raw in entry['set'].items()}))
    return tuple(sorted(switches, key=lambda switch: switch.at))


def _override(text: str) -> tuple[str, str]:
    path, equals, raw = text.partition('=')
    if not equals:
        raise RigFileError(f"override '{text}' must read path=value, as friction.level=1.5")
    return path.strip(), raw.strip()


def _number(path: str, raw: object) -> float:
    try:
        value = float(raw)
    except (TypeError, ValueError):
        raise RigFileError(f'{path} = {raw!r} is no number') from None
    if not isfinite(value):
        raise RigFileError(f'{path} = {value} must be finite')
    return value


def _value(world: World, path: str, raw: object) -> float:
    known = world.by_path.get(path)
    if known is None:
        section = str(path).partition('.')[0]
        near = [item for item in world.by_path if item.startswith(section + '.')]
        raise RigFileError(f"has no property '{path}'; "
                           f'{or_what(path, near or world.by_path)}')
    value = _number(path, raw)
    if not known.low <= value <= known.high:
        raise RigFileError(f'{path} = {value:g} {known.unit} is outside '
                           f'[{known.low:g}, {known.high:g}]')
    return value
