"""Names of the columns of an array that stand in another array of the same file, beside it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

BESIDE = ('columns', 'names', 'channels', 'label')
"""What the names are called, an array or one text; the last is that of a scope of Simulink."""
OF_PANDAS = ('_items', '_values')
"""How names and numbers end of a block of a frame that pandas wrote into HDF5."""


def with_names_beside(arrays: Mapping[str, Any], told: list[str]) -> dict[str, Any]:
    """
    Return arrays in which one of shape (rows, k) with k names beside it is k columns.

    Names stand in the group of the arrays, as an attribute of one (``data.columns``), or as pandas
    has them, ``block0_items`` beside ``block0_values``. A name that is also that of something else
    in the file stays behind its array, ``data.speed``. Names of another number than any array has
    columns are ``told`` and not used.
    """
    flat = {key: array for key, value in arrays.items() if (array := np.asarray(value)).ndim == 2
            and array.dtype.kind in 'fiub'}
    found = dict(arrays)
    for beside in [key for key in arrays if key.rpartition('.')[2] in BESIDE
                   or key.endswith(OF_PANDAS[0])]:
        names = _texts(arrays[beside])
        near = {key: array for key, array in flat.items() if _is_of(beside, key)}
        if not names or not near:
            continue
        held = {key: upright for key, array in near.items()
                if (upright := array if array.shape[0] >= array.shape[1] else array.T).shape[1]
                == len(names)}
        if not held and all(len(names) != max(one.shape) for one in near.values()):  # of rows
            told.append(f'{beside!r} holds {len(names)} names and no array has as many columns; '
                        + ', '.join(f'{key} has {min(array.shape)}'
                                    for key, array in near.items()))
        times = Counter([*arrays, *names * len(held)])
        for key, array in held.items():
            del found[key], flat[key]
            found |= {name if times[name] == 1 else f'{key}.{name}': column
                      for name, column in zip(names, array.T, strict=True)}
    return found


def _is_of(beside: str, key: str) -> bool:
    """Tell whether names are those of an array: its own, those of its group, or of its block."""
    names, values = OF_PANDAS
    if beside.endswith(names):
        return key == beside.removesuffix(names) + values
    group = beside.rpartition('.')[0]
    return group in (key, key.rpartition('.')[0])


def _texts(value: Any) -> list[str]:
    """Return the names that texts or a text with commas hold; [] where one is none or twice."""
    array = np.asarray(value.split(',') if isinstance(value, str) and ',' in value else value)
    if array.dtype.kind not in 'US' or array.ndim != 1:
        return []
    names = [one.decode('utf8', 'replace') if isinstance(one, bytes) else str(one)
             for one in array.tolist()]
    names = [name.strip() for name in names]
    return names if all(names) and len(set(names)) == len(names) else []
