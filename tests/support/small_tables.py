"""A small table of a servo, and its import, for the tests of both."""

from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv

from servo_identify.cli import main

CONFIG = Path(__file__).parents[2] / 'config'
SERVO = CONFIG / 'servos' / 'rv_bench.yaml'
TIME = np.arange(200) * 1e-3


def table(**columns) -> dict[str, np.ndarray]:
    """Return 200 rows of time, command and angle at 1 kHz, with some columns changed."""
    return {'t': TIME, 'voltage': np.sin(TIME), 'motor_position': TIME**2} | columns


def write_csv(path: Path, columns: dict) -> Path:
    """Write columns as they are."""
    csv.write_csv(pa.table(columns), path)
    return path


def convert(path: Path, bag: Path, *options: str) -> int:
    """Import a table for the bench; return the exit status."""
    return main(['import', str(path), '--servo', str(SERVO), '-o', str(bag), *options])
