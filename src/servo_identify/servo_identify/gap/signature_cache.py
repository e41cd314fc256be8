"""
Signatures kept on disk, by servo, effect and recordings: asking again costs reading alone.

A folder for each set of recordings with its servo, a file for each candidate. What changes a
signature changes its name: the values of the servo, the sources of its laws and of this package,
every sample of the recordings. The oldest sets go when there are too many.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
import shutil
from zipfile import BadZipFile

import numpy as np

from servo_twin.physics.kernel import cache_folder, kernel_of

from .candidates import Candidate
from .stack import Stack

SETS = 12  # of some tens of megabytes each


class SignatureCache:
    """The signatures of the candidates on one stack of recordings."""

    def __init__(self, stack: Stack) -> None:
        home = cache_folder() / 'signatures'
        self._folder = home / _fingerprint(stack)
        self._folder.mkdir(parents=True, exist_ok=True)
        os.utime(self._folder)
        sets = sorted((f for f in home.iterdir() if f.is_dir()), key=lambda f: f.stat().st_mtime)
        for old in sets[:-SETS]:
            shutil.rmtree(old, ignore_errors=True)

    def get(self, candidate: Candidate, size: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Return (columns, amplitudes) of a candidate; None where it was never asked for."""
        try:
            with np.load(self._file(candidate, size)) as kept:
                return kept['table'], kept['amplitudes']
        except (OSError, ValueError, KeyError, BadZipFile):  # none, or cut short
            return None

    def put(self, candidate: Candidate, size: float, table: np.ndarray,
            amplitudes: np.ndarray) -> None:
        """Keep the columns of a candidate; a disk that is full only costs the next diagnosis."""
        file = self._file(candidate, size)
        draft = file.with_suffix(f'.{os.getpid()}')
        try:
            with open(draft, 'wb') as out:
                np.savez(out, table=table, amplitudes=amplitudes)
            draft.replace(file)
        except OSError:
            draft.unlink(missing_ok=True)

    def _file(self, candidate: Candidate, size: float) -> Path:
        told = (candidate.name, candidate.site, candidate.paths, candidate.elements,
                candidate.shapes, size)
        return self._folder / f'{hashlib.sha256(repr(told).encode()).hexdigest()[:32]}.npz'


def _fingerprint(stack: Stack) -> str:
    digest = hashlib.sha256()
    digest.update(kernel_of(stack.extended.servo).module.__name__.encode())
    for file in sorted(Path(__file__).parent.glob('*.py')):
        digest.update(file.read_bytes())
    servo = stack.extended.servo
    digest.update(repr((sorted(servo.values.items()), sorted(servo.tolerance.items()),
                        servo.step)).encode())
    for part in (stack.extended.theta, stack.extended.on, stack.base, stack.scale):
        digest.update(np.ascontiguousarray(part).tobytes())
    for one in stack.balances:
        recording = one.seen.recording
        digest.update(repr((recording.period, recording.family)).encode())
        for name in sorted(recording.columns):
            digest.update(name.encode() + recording.columns[name].tobytes())
    return digest.hexdigest()[:32]
