"""Names of the columns of an array that stand in another array of the same file, beside it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

BESIDE = ('columns', 'names', 'channels')
"""What the array of the names is called."""


def with_names_beside(arrays: Mapping[str, Any], told: list[str]) -> dict[str, Any]:
    """
    Return arrays in which one of shape (rows, k) with k names beside it is k columns.

    A name that is also that of something else in the file stays behind its array, ``data.speed``.
    Names of another number than any array has columns are ``told`` and not used.
    """
    flat = {key: array for key, value in arrays.items() if (array := np.asarray(value)).ndim == 2
            and array.dtype.kind in 'fiub'}
    found = dict(arrays)
    for beside in BESIDE:
        names = _texts(arrays.get(beside))
        if not names or not flat:
            continue
        held = {key: upright for key, array in flat.items()
                if (upright := array if array.shape[0] >= array.shape[1] else array.T).shape[1]
                == len(names)}
        if not held and all(len(names) != max(one.shape) for one in flat.values()):  # of rows
            told.append(f'{beside!r} holds {len(names)} names and no array has as many columns; '
                        + ', '.join(f'{key} has {min(array.shape)}'
                                    for key, array in flat.items()))
        times = Counter([*arrays, *names * len(held)])
        for key, array in held.items():
            del found[key], flat[key]
            found |= {name if times[name] == 1 else f'{key}.{name}': column
                      for name, column in zip(names, array.T, strict=True)}
    return found


def _texts(value: Any) -> list[str]:
    """Return the names that an array of texts holds; [] where it is none, or one is twice."""
    array = np.asarray(value)
    if array.dtype.kind not in 'US' or array.ndim != 1:
        return []
    names = [one.decode('utf8', 'replace') if isinstance(one, bytes) else str(one)
             for one in array.tolist()]
    names = [name.strip() for name in names]
    return names if all(names) and len(set(names)) == len(names) else []
