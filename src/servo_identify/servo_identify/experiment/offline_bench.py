"""Runs on the emulated rig without its bus: faster than real time, in a process of its own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import subprocess
import sys
import tempfile

import numpy as np

from servo_twin.bag import write_recording
from servo_twin.recording.recording import COLUMNS, Recording

from .next_command import emulated_note
from .procedures import Run

_MAKER = 'servo_rig_driver.emulated.make_recording'


def make(run: Run, folder: Path, rig: Path, servo: str, servo_text: str,
         turned: Sequence[str] = (), seed: int = 0, namespace: str = 'rig') -> Path:
    """
    Have the emulated rig play a run and return the bag of it, ``folder``/NAME.

    The bag is as a live one of the rig in a ``namespace``. ``turned``: properties such as
    friction.level=1.5. Raises ValueError with what the emulated rig said when it did not play it.
    """
    with tempfile.TemporaryDirectory(prefix='servo_identify_') as scratch:
        table, waves = Path(scratch) / 'table.npz', Path(scratch) / 'waves.npz'
        np.savez(waves, reference=run.reference, external_torque=run.external_torque)
        words = [sys.executable, '-m', _MAKER, run.family, '--waves', str(waves), '--mode',
                 run.mode, '--rig', str(rig), '--rate', repr(1.0 / run.period), '--seed',
                 str(seed), '-o', str(table)]
        for one in turned:
            words += ['--set', one]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode:
            raise ValueError(f'{run.name} was not played: {done.stderr.strip()[-500:]}')
        with np.load(table) as columns:
            kept = {name: columns[name] for name in COLUMNS if name in columns}
    recording = Recording(
        name=run.name, period=run.period, columns=kept, family=run.family,
        replicate=run.replicate, servo=servo, servo_file=servo_text,
        note=emulated_note(rig, turned))
    return write_recording(folder / run.name, recording, namespace=namespace)
