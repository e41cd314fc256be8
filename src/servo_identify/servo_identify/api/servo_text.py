"""A servo together with the text of its file, so that comments survive what is changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path

from servo_twin.description.home_path import at_home
from servo_twin.description.whole_file import write_whole
from servo_twin.physics.servo import Servo, Value


@dataclass(frozen=True, repr=False)
class ServoFile:
    """
    One machine as its servo file describes it.

    ``servo`` is the machine, ``text`` the YAML with its comments, ``path`` where it was read from
    (None where it was made here). Printing it shows the text.
    """

    servo: Servo
    text: str
    path: Path | None = None

    @property
    def name(self) -> str:
        """The name of the machine."""
        return self.servo.name

    @property
    def values(self) -> Mapping[str, Value]:
        """Every parameter by its path, in the unit that `servo-twin parameters` lists."""
        return self.servo.values

    def save(self, path: str | Path) -> Path:
        """
        Write the servo file, whole or not at all, and return its path.

        Raises OSError that names what cannot be written, or the folder that is not there,
        ValueError for ~ of nobody.
        """
        path = at_home(path)
        if path.is_dir():
            raise IsADirectoryError(f'{path} is a folder; give the name of a file, such as '
                                    f'{path / f"{self.name}.yaml"}')
        if not path.parent.is_dir():
            raise FileNotFoundError(f'{path} cannot be written: there is no folder {path.parent}')
        write_whole(path, self.text)
        return path

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        origin = f', read from {self.path}' if self.path else ''
        return (f'ServoFile {self.name!r}: {len(self.servo.effects)} effects, '
                f'{len(self.servo.tolerance)} tolerances{origin}')

    def _repr_html_(self) -> str:
        return f'<pre>{escape(self.text)}</pre>'
