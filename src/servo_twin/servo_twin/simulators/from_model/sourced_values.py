"""The values of a servo as they are found, each with where it is from."""

from __future__ import annotations

from ...physics.catalogue import find
from ...physics.servo import Placed, Value


class FoundValues:
    """The values of a servo and their provenance, as they are found."""

    def __init__(self) -> None:
        self.values: dict[str, Value] = {}
        self.sources: dict[str, str] = {}
        self.effects: list[Placed] = []
        self.read: list[str] = []

    def put(self, path: str, value: Value, source: str, read: bool = False) -> None:
        """Take a value; ``read`` says that the simulator holds it."""
        self.values[path], self.sources[path] = value, source
        if read:
            self.read.append(path)

    def place(self, name: str, effect: str, site: str, source: str, **values: Value) -> None:
        """Take an effect that the simulator holds."""
        self.effects.append(Placed(name, find(effect), site))
        for parameter, value in values.items():
            self.put(f'effects.{name}.{parameter}', value, source, read=True)
