"""
Reads a MAT file in a process of its own: a damaged one brings scipy's reader down, not ours.

Run as a program, this file does the reading. It imports nothing of ours.
"""

from __future__ import annotations

from collections.abc import Iterator
import io
from pathlib import Path
import resource
import subprocess
import sys
from typing import Any

import numpy as np

_SECONDS = 120.0  # for the largest file that one would keep as MAT
_BYTES = 8 << 30  # of memory: a damaged length may ask for any
_HDF5 = b'\x89HDF\r\n\x1a\n'  # how such a file begins
_LATER = 3  # the status for a MAT file of version 7.3


def load_mat(path: Path) -> dict[str, Any]:
    """
    Return the variables of a MAT file (up to version 7) that are numbers, texts or arrays of them.

    Arrays lose axes of length one, the fields of a structure ``s`` are ``s.field``, and the
    elements of a list of them ``s[0].field``.
    Raises ValueError for a file that is none or is damaged.
    """
    with path.open('rb') as file:
        if file.read(len(_HDF5)) == _HDF5:
            raise ValueError(f'{path} is an HDF5 file, as those of version 7.3 of MATLAB are '
                             "within; save it with '-v7', or as CSV or NPZ")
    try:
        ran = subprocess.run([sys.executable, '-P', __file__, str(path)], capture_output=True,
                             timeout=_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise ValueError(f'{path} is no MAT file: its reading takes more than {_SECONDS:g} s') \
            from None
    if ran.returncode == _LATER:
        raise ValueError(f"{path} is a MAT file of version 7.3; save it with '-v7'")
    if ran.returncode:
        said = ran.stderr.decode(errors='replace').strip().splitlines()
        why = said[-1] if said and ran.returncode > 0 else 'it is damaged, its reader broke down'
        raise ValueError(f'{path} is no MAT file: {why}')
    with np.load(io.BytesIO(ran.stdout), allow_pickle=False) as found:
        arrays = {name.removeprefix('v_'): found[name] for name in found.files}
    return {name: value.item() if value.ndim == 0 else value for name, value in arrays.items()}


def _write(path: str) -> int:
    """Write the variables of a MAT file to stdout as NPZ; return the status."""
    from scipy.io import loadmat

    resource.setrlimit(resource.RLIMIT_AS, (_BYTES, _BYTES))
    try:
        found = loadmat(path, squeeze_me=True)
    except NotImplementedError:
        return _LATER
    except Exception as error:  # of a damaged file scipy says what comes
        print(f'{type(error).__name__}: {error}', file=sys.stderr)
        return 2
    plain = {f'v_{path}': array for name, value in found.items()
             if isinstance(name, str) and not name.startswith('__')
             for path, array in _leaves(name, value)}
    memory = io.BytesIO()
    np.savez(memory, **{name: value for name, value in plain.items()
                        if value.dtype.kind in 'fiubcU'})
    sys.stdout.buffer.write(memory.getvalue())
    return 0


def _leaves(name: str, value: Any) -> Iterator[tuple[str, np.ndarray]]:
    """
    Yield (path, array) of a variable; a structure yields ``name.field`` for each field.

    Of a list, as of a scope's signals, each element yields ``name[k]``, or ``name[label]`` where
    each is a structure with a label of its own.
    """
    array = np.asarray(value)
    listed = array.dtype.names or array.dtype.kind == 'O'
    if not listed:
        yield name, array
    elif array.ndim == 0 and array.dtype.names:
        for field in array.dtype.names:
            yield from _leaves(f'{name}.{field}', array[field].item())
    elif array.ndim == 1:
        labels = [_label(one) for one in array]
        own = all(labels) and len(set(labels)) == len(labels)
        for k, one in enumerate(array):
            yield from _leaves(f'{name}[{labels[k] if own else k}]', one)


def _label(value: Any) -> str:
    """Return the label of a structure, '' where it has none."""
    fields = getattr(value, 'dtype', np.dtype(float)).names or ()
    return next((str(value[field]) for field in ('label', 'name') if field in fields), '')


if __name__ == '__main__':
    sys.exit(_write(sys.argv[1]))
