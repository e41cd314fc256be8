"""
Reads a MAT or HDF5 file in a process of its own: a damaged one brings that reader down, not ours.

Run as a program, this file does the reading. It imports nothing of ours.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
import io
from pathlib import Path
import resource
import subprocess
import sys
from typing import Any

import numpy as np

_SECONDS = 120.0  # for the largest file that one would keep as MAT
_BYTES = 8 << 30  # of memory: a damaged length may ask for any
_NO_NUMBERS = {'MATLAB_empty'}
_OPAQUE = ('s0', 's1', 's2', 'arr')  # what scipy has of an object: its name, and its class as s2
_BESIDE = {'columns', 'names', 'channels'}  # attributes that name the columns of an array
_OBJECT = 'class'  # in place of the numbers of an object stands its class
_HDF5 = b'\x89HDF\r\n\x1a\n'  # how such a file begins


def load_mat(path: Path) -> tuple[dict[str, Any], dict[str, str]]:
    """
    Return the variables of a MAT or HDF5 file that are numbers, texts or arrays of them.

    Beside them are its objects, which MATLAB alone reads, with their classes.

    Arrays lose axes of length one, the fields of a structure or group ``s`` are ``s.field``, and
    the elements of a list of structures ``s[0].field``. An attribute ``unit`` of HDF5 stands
    behind the name: ``angle [deg]``.
    Raises ValueError for a file that is none or is damaged, and where h5py lacks for an HDF5 file.
    """
    if _is_hdf5(path) and find_spec('h5py') is None:
        raise ValueError(f'{path} is an HDF5 file, as those of version 7.3 of MATLAB are within; '
                         "reading it needs `pip install h5py`, or save it with '-v7', or as CSV "
                         'or NPZ')
    kind = 'HDF5' if _is_hdf5(path) else 'MAT'
    try:
        ran = subprocess.run([sys.executable, '-P', __file__, str(path)], capture_output=True,
                             timeout=_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise ValueError(f'{path} is no {kind} file: its reading takes more than {_SECONDS:g} s') \
            from None
    if ran.returncode:
        said = ran.stderr.decode(errors='replace').strip().splitlines()
        why = said[-1] if said and ran.returncode > 0 else 'it is damaged, its reader broke down'
        raise ValueError(f'{path} is no {kind} file: {why}')
    with np.load(io.BytesIO(ran.stdout), allow_pickle=False) as found:
        arrays = {name.removeprefix('v_'): found[name] for name in found.files}
    objects = {name: value[_OBJECT].item().decode() for name, value in arrays.items()
               if value.dtype.names == (_OBJECT,)}
    return {name: value.item() if value.ndim == 0 else value for name, value in arrays.items()
            if name not in objects}, objects


def _is_hdf5(path: str | Path) -> bool:
    """Tell whether a file is HDF5: from its begin, or behind the 512 bytes of MATLAB."""
    with Path(path).open('rb') as file:
        begin = file.read(512 + len(_HDF5))
    return begin.startswith(_HDF5) or begin[512:] == _HDF5


def _write(path: str) -> int:
    """Write the variables of a MAT or HDF5 file to stdout as NPZ; return the status."""
    resource.setrlimit(resource.RLIMIT_AS, (_BYTES, _BYTES))
    try:
        found = dict(_of_hdf5(path) if _is_hdf5(path) else _of_mat(path))
    except Exception as error:  # of a damaged file scipy and h5py say what comes
        print(f'{type(error).__name__}: {error}', file=sys.stderr)
        return 2
    memory = io.BytesIO()
    np.savez(memory, **{f'v_{name}': value for name, value in found.items()
                        if value.dtype.kind in 'fiubcU' or value.dtype.names == (_OBJECT,)})
    sys.stdout.buffer.write(memory.getvalue())
    return 0


def _of_mat(path: str) -> Iterator[tuple[str, np.ndarray]]:
    from scipy.io import loadmat

    for name, value in loadmat(path, squeeze_me=True).items():
        if isinstance(name, str) and not name.startswith('__'):
            yield from leaves(name, value)


def _object(name: str, kind: Any) -> tuple[str, np.ndarray]:
    """Return the name of an object, and its class in place of numbers."""
    text = kind if isinstance(kind, bytes) else str(kind).encode()
    return name, np.array((text,), [(_OBJECT, f'S{len(text) or 1}')])


def _of_hdf5(path: str) -> Iterator[tuple[str, np.ndarray]]:
    import h5py

    def below(path_to: tuple[Any, ...], above: str) -> Iterator[tuple[str, np.ndarray]]:
        group = path_to[-1]
        for name in group:
            link = group.get(name, getlink=True)
            if name.startswith('#') or not isinstance(link, h5py.HardLink):  # another file's
                continue
            one = group[name]
            if isinstance(one, h5py.Group) and one not in path_to:  # which a link may lead back to
                for label, field, target in _listed(file, one):
                    yield from of_element((*path_to, one), f'{above}{name}[{label}].{field}',
                                          target)
                if not _is_list(one):
                    yield from below((*path_to, one), f'{above}{name}.')
            elif isinstance(one, h5py.Dataset) and h5py.check_ref_dtype(one.dtype):
                texts = [_text(target) for target in _referred(file, one)]
                if texts and all(texts):
                    yield above + name, np.array(texts)
                    continue
                for k, target in enumerate(_referred(file, one)):
                    yield from of_element((*path_to, one), f'{above}{name}[{k}]', target)
            elif isinstance(one, h5py.Dataset) and 'MATLAB_object_decode' in one.attrs:
                yield _object(above + name, one.attrs.get('MATLAB_class', b'object'))
            elif isinstance(one, h5py.Dataset) and one.shape and not (
                    one.is_virtual or one.external or _NO_NUMBERS & {*one.attrs}):
                yield from _of_dataset(above + name, one)
            elif isinstance(one, h5py.Dataset) and one.shape == () and one.dtype.kind in 'fiub':
                yield above + name, np.asarray(one[()])

    def of_element(path_to: tuple[Any, ...], name: str, target: Any
                   ) -> Iterator[tuple[str, np.ndarray]]:
        if isinstance(target, h5py.Group) and target not in path_to:
            yield from below((*path_to, target), f'{name}.')
        elif isinstance(target, h5py.Dataset) and target.shape and target not in path_to:
            if h5py.check_ref_dtype(target.dtype):
                for k, inner in enumerate(_referred(file, target)):
                    yield from of_element((*path_to, target), f'{name}[{k}]', inner)
            else:
                yield from _of_dataset(name, target)

    with h5py.File(path, 'r') as file:
        yield from below((file['/'],), '')


def _is_list(group: Any) -> bool:
    """Tell whether a group is a list of structures: each field refers to as many values."""
    import h5py

    fields = [group[name] for name in group]
    return bool(fields) and all(isinstance(one, h5py.Dataset) and h5py.check_ref_dtype(
        one.dtype) and one.size == fields[0].size for one in fields)


def _listed(file: Any, group: Any) -> Iterator[tuple[str, str, Any]]:
    """Yield label or number, field and value of each structure of a list."""
    if not _is_list(group):
        return
    fields = {name: _referred(file, group[name]) for name in group}
    told = next((fields[name] for name in ('label', 'name') if name in fields), [])
    labels = [''.join(map(chr, np.ravel(one[()]))) if one.dtype.kind in 'iu' and one.size else ''
              for one in told]
    own = all(labels) and len(set(labels)) == len(labels)
    for field, values in fields.items():
        for k, one in enumerate(values):
            yield labels[k] if own and labels else str(k), field, one


def _referred(file: Any, cells: Any) -> list[Any]:
    """Return what the cells of a MAT file of version 7.3 refer to."""
    return [file[one] for one in np.ravel(cells[()]) if one]


def _text(one: Any) -> str:
    """Return the text that an array of characters of MATLAB is; '' for any other."""
    return ''.join(map(chr, np.ravel(one[()]))) if one.attrs.get('MATLAB_class') == b'char' else ''


def _decoded(text: Any) -> str:
    return text.decode('utf8', 'replace') if isinstance(text, bytes) else str(text)


def _of_dataset(name: str, one: Any) -> Iterator[tuple[str, np.ndarray]]:
    import h5py

    if _text(one):
        yield name, np.asarray(_text(one))
        return
    if h5py.check_string_dtype(one.dtype):
        yield name, np.array([*map(_decoded, np.ravel(one[()]))])
        return
    for key in _BESIDE & {*one.attrs}:
        if np.ndim(one.attrs[key]) == 1:
            yield f'{name}.{key}', np.array([*map(_decoded, one.attrs[key])])
    unit = next((one.attrs[key] for key in ('unit', 'units', 'Unit') if key in one.attrs), '')
    unit = unit.decode() if isinstance(unit, bytes) else unit
    if one.dtype.kind in 'fiub':
        yield f'{name} [{unit}]' if isinstance(unit, str) and unit else name, np.squeeze(one[()])
    elif one.dtype.names:
        yield from ((f'{name}.{field}', np.squeeze(one[field])) for field in one.dtype.names)


def leaves(name: str, value: Any) -> Iterator[tuple[str, np.ndarray]]:
    """
    Yield (path, array) of a variable; a structure yields ``name.field`` for each field.

    Of a list, as of a scope's signals, each element yields ``name[k]``, or ``name[label]`` where
    each is a structure with a label of its own.
    """
    array = np.asarray(value)
    if array.dtype.names == _OPAQUE and array.size == 1:
        held = array.ravel()[0]
        own = held['s0'].decode() if isinstance(held['s0'], bytes) else str(held['s0'])
        yield _object(own or name, held['s2'])
        return
    listed = array.dtype.names or array.dtype.kind == 'O'
    if not listed:
        yield name, array
    elif array.ndim == 0 and array.dtype.names:
        for field in array.dtype.names:
            yield from leaves(f'{name}.{field}', array[field].item())
    elif array.ndim == 1 and array.size and all(isinstance(one, str) for one in array):
        yield name, array.astype(str)
    elif array.ndim == 1:
        labels = [_label(one) for one in array]
        own = all(labels) and len(set(labels)) == len(labels)
        for k, one in enumerate(array):
            yield from leaves(f'{name}[{labels[k] if own else k}]', one)


def _label(value: Any) -> str:
    """Return the label of a structure, '' where it has none."""
    fields = getattr(value, 'dtype', np.dtype(float)).names or ()
    return next((str(value[field]) for field in ('label', 'name') if field in fields), '')


if __name__ == '__main__':
    sys.exit(_write(sys.argv[1]))
