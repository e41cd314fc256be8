"""The example FMU for tests, which are skipped on a machine without a C compiler."""

from pathlib import Path
from shutil import which

import pytest

from servo_twin.fmu import example


def made(folder: Path, version: int = 2, **said) -> Path:
    """Return a new FMU, see servo_twin.fmu.example."""
    if not which(example.COMPILER):
        pytest.skip('there is no C compiler')
    return example.made(folder, version, **said)
