"""Files of NumPy, NPZ and NPY, as named arrays; what would run code is not read."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np

from servo_twin.bag.fits_in_memory import check_fits

from .import_memory import ADVICE
from .names_beside import BESIDE

_AS_TEXT = (', but objects, whose reading may run code: save the names as text, '
            '{0}=numpy.array({0}, dtype=str)')


def load_numpy(path: Path) -> tuple[dict[str, Any], dict[str, str]]:
    """
    Return the arrays of a file by their names, and of objects among them why they are not read.

    The single array of an NPY file has the name of the file, a structured one those of its fields.
    Raises ValueError for a file that is none or holds an object alone.
    """
    arrays, refused = dict[str, Any](), dict[str, str]()
    try:
        if path.suffix.lower() == '.npz':
            with ZipFile(path) as packed:  # zeros pack to a thousandth
                check_fits(path, 2.0 * sum(one.file_size for one in packed.infolist()), ADVICE)
        found = np.load(path, allow_pickle=False)
        if isinstance(found, np.ndarray):
            arrays = {name: found[name] for name in found.dtype.names or ()} or {path.stem: found}
        else:
            with found:
                for name in found.files:
                    try:
                        arrays[name] = found[name]
                    except ValueError as problem:  # objects, whose reading would run code
                        refused[name] = f'{path}: {name!r} is no plain array' + (
                            _AS_TEXT.format(name) if name in BESIDE else _why(problem))
    except (ValueError, OSError, EOFError, BadZipFile) as error:
        raise ValueError(f'{path} is no NPZ file of plain arrays{_why(error)}') from None
    return arrays, refused


def _why(problem: Exception) -> str:
    """Say why NumPy does not read something, without its advice to run what stands in it."""
    return (', but an object such as a dictionary, whose reading may run code: save its arrays, '
            'numpy.savez(FILE, **data)' if 'pickle' in str(problem) else f': {problem}')
