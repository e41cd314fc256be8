"""
The JSON schema of mapping files, for editors.

    python -m servo_identify.data.mapping_schema config/schemas/mapping.json
"""

from __future__ import annotations

import json
from pathlib import Path
import sys
from typing import Any

from .column_names import NAMES
from .column_units import UNIT
from .mapping import FACTS, KEYS, STEPS, ZEROS

_KINDS = {str: 'string', bool: 'boolean', int: 'integer', list: 'array', dict: 'object'}
_SIGNS = {'external_torque': ', positive where it resists the load',
          'torque': ', positive where the motor drives the load forward'}
_MEANINGS = {
    'rows': 'The list of records in a JSON file, or the sheet of a spreadsheet.',
    'names': 'The columns of a text file that has no line of names.',
    'join': 'Each row belongs to one of several topics and leaves the others empty.',
    'period': 'The grid to resample to, s.',
    'drive_on': 'A column that is 0 while the drive is switched off.',
    'source': 'A column of the file, or TOPIC.field[index] of messages.',
    'value': 'A constant in place of a source.',
    'every': 'From row to row of a file without times, s.',
    'above': 'Where the value is above this ...',
    'subtract': '... subtract this.', 'scale': 'Multiply.', 'offset': 'Add.',
    'wraps': 'A turn of the numbers, where an encoder wraps around.',
    'plus': 'Add another column, in the same numbers.',
    'minus': 'Subtract another column, in the same numbers.',
    'times': 'Multiply by another column.', 'negate': 'Turn the sign.',
    'unit': 'What the numbers are in; 1/4096 rev is one count of an encoder.',
    'zero': 'Subtract the first value, or the mean.'}


def schema() -> dict[str, Any]:
    """Return the schema as plain data."""
    steps = {'type': 'object', 'properties': {name: _kind(name, kind)
                                              for name, kind in STEPS.items()},
             'additionalProperties': False,
             'oneOf': [{'required': ['source']}, {'required': ['value']}]}
    steps['properties']['zero']['enum'] = list(ZEROS)
    every = steps['properties'].pop('every')
    columns = {name: {'description': f'in {UNIT[name]}{_SIGNS.get(name, "")}', **steps}
               for name in NAMES if name != 't'}
    properties = {name: _kind(name, kind) for name, kind in KEYS.items()}
    properties |= {
        'time': {'description': 'in s', **steps,
                 'properties': {**steps['properties'], 'every': every},
                 'oneOf': [*steps['oneOf'], {'required': ['every']}]},
        'columns': {'type': 'object', 'properties': columns, 'additionalProperties': False,
                    'minProperties': 1},
        'recording': {'type': 'object', 'additionalProperties': False, 'properties': {
            name: {'type': ['string', 'integer']} for name in FACTS}}}
    return {'$schema': 'https://json-schema.org/draft/2020-12/schema', 'title': 'Mapping file',
            'type': 'object', 'properties': properties, 'additionalProperties': False,
            'required': ['time', 'columns']}


def _kind(name: str, kind: Any) -> dict[str, Any]:
    told = {'description': _MEANINGS[name]} if name in _MEANINGS else {}
    return {'type': 'number' if isinstance(kind, tuple) else _KINDS[kind], **told}


def text() -> str:
    """Return the schema as it is shipped."""
    return json.dumps(schema(), indent=1) + '\n'


if __name__ == '__main__':
    Path(sys.argv[1]).write_text(text())
