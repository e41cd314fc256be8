"""Finds the tables of device protocols: shipped ones by name, others by path."""

from __future__ import annotations

from pathlib import Path

import yaml

from ...plain_yaml import read_yaml
from ..device import DeviceError

SHIPPED = Path(__file__).parent
MALFORMED = (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError)
"""What comes of a table that is not shaped as it should be."""


def table_path(name: str, ending: str) -> Path:
    """Return the file of a shipped table, or a file; raises DeviceError that names the choice."""
    shipped = SHIPPED / f'{name}{ending}'
    path = shipped if shipped.is_file() else Path(name)
    if not name or not path.is_file():
        known = sorted(file.stem for file in SHIPPED.glob(f'*{ending}'))
        raise DeviceError(f"device.table = '{name}' is neither a file nor one of the shipped "
                          f'tables {known}')
    return path


def read_table(name: str, ending: str) -> dict:
    """Return a YAML table; raises DeviceError for one that is no mapping."""
    path = table_path(name, ending)
    try:
        content = read_yaml(path.read_text(encoding='utf-8'))
    except (OSError, yaml.YAMLError, ValueError, RecursionError) as error:
        raise DeviceError(f'{path} cannot be read: {error}') from error
    if not isinstance(content, dict):
        raise DeviceError(f'{path} must be a mapping; it is {type(content).__name__}')
    return content
