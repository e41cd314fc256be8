"""Anything that can be read, as a bag: one of ours, or what servo-identify makes of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import subprocess
import sys
import tempfile

_BY_MAPPING = ('.mat', '.json')
"""Files whose shipped mapping is taken where there is one of the servo's name."""


@contextmanager
def bag_of(given: Path, servo: Path | None, mapping: Path | None = None,
           folder: Path | None = None, force: bool = False) -> Iterator[Path]:
    """
    Yield the bag of what a person names: a bag, a table, or messages by a mapping file.

    What is no bag is imported by `servo-identify import` into ``folder``, over what is there with
    ``force``, or into a folder that is gone afterwards. Raises ServoError for what does not exist,
    for a table without a servo file, and where the import refused.
    """
    from ..description.shipped import shipped
    from ..physics.servo import ServoError

    if not given.exists():
        raise ServoError(f'{given} does not exist; give a bag, an MCAP file or a table')
    table = given.is_file() and given.suffix.lower() != '.mcap'
    if not table and mapping is None:
        yield given
        return
    if servo is None:
        raise ServoError(f'{given} is no bag of this project: --servo must say of which machine '
                         'it is')
    if mapping is None and given.suffix.lower() in _BY_MAPPING:
        try:
            mapping = shipped(f'imports/{servo.stem}.yaml')
        except ServoError:
            pass  # its columns may have our names
    with tempfile.TemporaryDirectory(prefix='servo_twin_') as scratch:
        bag = (folder or Path(scratch)) / ('recording' if folder else given.stem)
        bag.parent.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, '-m', 'servo_identify.cli', 'import', str(given), '--servo',
                   str(servo), '-o', str(bag)]
        if mapping:
            command += ['--mapping', str(mapping)]
        command += ['--force'] * force
        ended = subprocess.run(command, check=False, capture_output=True, text=True)
        if ended.returncode:
            raise ServoError(ended.stderr.strip().removeprefix('servo-identify import: '))
        yield bag
