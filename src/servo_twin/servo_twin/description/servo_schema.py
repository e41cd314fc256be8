"""
The JSON schema of servo files, for editors: made from what parts and effects declare.

    python -m servo_twin.description.servo_schema config/schemas/servo.json

A file that begins with `# yaml-language-server: $schema=PATH` is completed and judged by it.
"""

from __future__ import annotations

import json
from pathlib import Path
import sys
from typing import Any

from ..physics.catalogue import find, names
from ..physics.effect import Parameter
from ..physics.harmonic_drive_models import HARMONIC_DRIVES
from ..physics.servo import CONTROLLERS, DRIVES, MECHANISMS, SENSORS
from ..physics.servo_parts import Correction
from ..physics.straight_units import straightened

Schema = dict[str, Any]

_TOLERANCE = {'description': 'How far off a value may be.', 'anyOf': [
    {'type': 'string', 'pattern': r'^\s*[0-9.eE+-]+\s*%\s*$', 'examples': ['10 %']},
    {'type': 'array', 'items': {'type': 'number'}, 'minItems': 2, 'maxItems': 2}]}


def schema() -> Schema:
    """Return the schema as plain data."""
    sections: Schema = {
        'servo': {'description': 'Name of the machine.'},
        'travel': {'enum': ['rotary', 'linear'],
                   'description': 'linear: the load is in m, N and kg. The ratio of a motor that '
                                  'turns is then in rad/m; a linear motor has a ratio of 1.'},
        'step': {'type': 'number', 'minimum': 1e-7, 'maximum': 0.1,
                 'description': 'Of the simulation, s.'},
        'drive': _typed(DRIVES), 'mechanism': _typed(MECHANISMS, ('fmu',)),
        'controller': _typed(CONTROLLERS, needed=False),
        'observer': _named(Correction.parameters),
        'sensors': _section({name: _named(sensor.parameters)
                             for name, sensor in SENSORS.items()}),
        'harmonic_drive': {'type': ['object', 'null'],
                           'properties': {'model': {'enum': list(HARMONIC_DRIVES)}}},
        'effects': {'type': ['object', 'null'], 'additionalProperties': _effect()},
        'tolerance': {'type': ['object', 'null'], 'additionalProperties': _TOLERANCE},
    }
    return {'$schema': 'https://json-schema.org/draft/2020-12/schema', 'title': 'Servo file',
            **_section(sections), 'type': 'object', 'required': ['servo', 'drive', 'mechanism']}


def _section(properties: Schema) -> Schema:
    return {'type': ['object', 'null'], 'properties': properties, 'additionalProperties': False}


def _named(parameters: Any) -> Schema:
    return _section({name: _value(parameter) for name, parameter in parameters.items()})


def _typed(kinds: Any, beside: tuple[str, ...] = (), needed: bool = True) -> Schema:
    """Return a section whose type says which values it may have."""
    cases = [{'if': {'properties': {'type': {'const': kind}}, 'required': ['type']},
              'then': {'properties': {'type': {'description': _about(part)}, **{
                  name: _value(parameter) for name, parameter in part.parameters.items()}},
                  'additionalProperties': False}} for kind, part in kinds.items()]
    return {'type': 'object' if needed else ['object', 'null'],
            'properties': {'type': {'enum': [*kinds, *beside]}},
            'required': ['type'] if needed else [], 'allOf': cases}


def _effect() -> Schema:
    cases = []
    for name in names():
        effect = find(name)
        cases.append({'if': {'properties': {'effect': {'const': name}}, 'required': ['effect']},
                      'then': {'properties': {
                          'effect': {'description': _about(effect)},
                          'at': {'enum': list(effect.sites)},
                          **{key: _value(one) for key, one in effect.parameters.items()}},
                          'additionalProperties': False}})
    return {'type': ['object', 'null'], 'properties': {'effect': {'enum': names()}},
            'allOf': cases}


def _about(part: type) -> str:
    """Return what a part does, with its equations."""
    return ' '.join((part.__doc__ or '').split())


def _value(parameter: Parameter) -> Schema:
    low, high = parameter.bounds
    number: Schema = {'type': 'number', 'minimum': low, 'maximum': high}
    bare = {'type': 'array', 'items': number} if parameter.row else number
    unit = parameter.unit
    linear = {'rad/m'} if parameter.name == 'ratio' else {straightened(unit)}
    detail = {'value': bare, 'unit': {'enum': sorted({unit} | linear)},
              'source': True, 'std': True, 'bags': True}
    return {'description': f'{parameter.meaning} [{unit or "a number"}]',
            'anyOf': [bare, {'type': 'object', 'properties': detail, 'required': ['value'],
                             'additionalProperties': False}]}


def text() -> str:
    """Return the schema as it is shipped."""
    return json.dumps(schema(), indent=1) + '\n'


if __name__ == '__main__':
    Path(sys.argv[1]).write_text(text())
