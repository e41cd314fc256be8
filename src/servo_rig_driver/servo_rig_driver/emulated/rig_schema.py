"""
The JSON schema of rig files, for editors: made from the properties that a rig can be told.

    python -m servo_rig_driver.emulated.rig_schema config/schemas/rig.json
"""

from __future__ import annotations

import json
from pathlib import Path
import sys
from typing import Any

from .rig_physics import World, WORLDS


def schema() -> dict[str, Any]:
    """Return the schema as plain data: one case for each kind of physics."""
    cases = [{'if': {'properties': {'physics': {'const': kind}},
                     **({} if kind == 'servo' else {'required': ['physics']})},
              'then': _of(world)} for kind, world in WORLDS.items()]
    return {'$schema': 'https://json-schema.org/draft/2020-12/schema', 'title': 'Rig file',
            'type': 'object', 'properties': {'physics': {'enum': list(WORLDS)}}, 'allOf': cases}


def _of(world: World) -> dict[str, Any]:
    sections: dict[str, Any] = {}
    for path, one in world.by_path.items():
        section, _, name = path.partition('.')
        sections.setdefault(section, {})[name] = {
            'type': 'number', 'minimum': one.low, 'maximum': one.high,
            'description': f'{one.meaning} [{one.unit or "a scale"}]'}
    properties: dict[str, Any] = {
        'name': True, 'physics': True, 'dictionaries': {'type': 'string'},
        'step': {'type': 'number', 'minimum': 1e-7, 'maximum': 1e-4},
        'switches': {'type': ['array', 'null'], 'items': {
            'type': 'object', 'required': ['at', 'set'], 'additionalProperties': False,
            'properties': {'at': {'type': 'number'}, 'set': {
                'type': 'object', 'propertyNames': {'enum': list(world.by_path)}}}}}}
    properties |= {section: {'type': 'object', 'properties': names, 'additionalProperties': False}
                   for section, names in sections.items()}
    return {'properties': properties, 'additionalProperties': False}


def text() -> str:
    """Return the schema as it is shipped."""
    return json.dumps(schema(), indent=1) + '\n'


if __name__ == '__main__':
    Path(sys.argv[1]).write_text(text())
