"""
The physics that an emulated rig may have, by the name that its rig file gives.

Each is a table of properties and a module like rig_sampling.py. The module has
``fresh_state(values, seed)``, and ``answer``, ``advance`` and ``record`` over the same columns of
commands, noise and answers.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from types import ModuleType

import numpy as np

from . import rig_properties
from .feed_drive import feed_properties as feed_drive
from .rig_properties import Property


@dataclass(frozen=True)
class World:
    """One kind of machine: what it can be told, and the module that moves it."""

    properties: tuple[Property, ...]
    module: str

    @cached_property
    def by_path(self) -> dict[str, Property]:
        """The properties by their paths in a rig file."""
        return {item.path: item for item in self.properties}

    @cached_property
    def dtype(self) -> np.dtype:
        """The record that the compiled simulation reads."""
        return np.dtype([(item.name, np.float64) for item in self.properties])

    @cached_property
    def sections(self) -> tuple[str, ...]:
        """The sections of its rig files."""
        return tuple(dict.fromkeys(path.partition('.')[0] for path in self.by_path))

    def defaults(self) -> dict[str, float]:
        """Return the values of the machine by path, where a rig file says nothing."""
        return {item.path: item.default for item in self.properties}

    @property
    def physics(self) -> ModuleType:
        """The module that moves it, compiled when it is first called."""
        return import_module(f'.{self.module}', __package__)


WORLDS = {
    'servo': World(rig_properties.PROPERTIES, 'rig_sampling'),
    'feed_drive': World(feed_drive.PROPERTIES, 'feed_drive.feed_sampling'),
}
