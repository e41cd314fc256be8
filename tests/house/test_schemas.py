"""JSON schemas of servo, mapping and rig files: what is shipped is what the code declares."""

import json
from pathlib import Path

from jsonschema import Draft202012Validator
import pytest

from servo_identify.cli import main
from servo_identify.data import mapping_schema
from servo_rig_driver.emulated import rig_schema
from servo_twin.description import servo_schema
from servo_twin.description.strict_yaml import read_yaml

CONFIG = Path(__file__).resolve().parents[2] / 'config'
KINDS = {'servo': (servo_schema, 'servos'), 'mapping': (mapping_schema, 'imports'),
         'rig': (rig_schema, 'rigs')}


@pytest.mark.parametrize('kind', KINDS)
def test_the_shipped_schema_is_current(kind):
    assert (CONFIG / 'schemas' / f'{kind}.json').read_text() == KINDS[kind][0].text(), (
        f'python -m {KINDS[kind][0].__name__} config/schemas/{kind}.json')


@pytest.mark.parametrize('kind', KINDS)
def test_every_shipped_file_fits_its_schema(kind):
    module, folder = KINDS[kind]
    judge = Draft202012Validator(module.schema())
    for path in (CONFIG / folder).glob('*.yaml'):
        problems = [f'{path.name}: {one.json_path}: {one.message[:200]}'
                    for one in judge.iter_errors(read_yaml(path.read_text()))]
        assert problems == []


@pytest.mark.parametrize(('kind', 'text'), [
    ('servo', 'servo: x\ndrive: {type: voltag}\nmechanism: {type: rigid}'),
    ('servo', 'servo: x\ndrive: {type: voltage, resistence: 2}\nmechanism: {type: rigid}'),
    ('servo', 'servo: x\ndrive: {type: voltage}\nmechanism: {type: rigid, ratio: -2}'),
    ('servo', 'servo: x\ndrive: {type: voltage}\nmechanism: {type: rigid}\n'
              'effects: {a: {effect: coulomb_friction, at: nowhere}}'),
    ('mapping', 'time: {source: t}\ncolumns: {volts: {source: u}}'),
    ('mapping', 'time: {source: t}\ncolumns: {voltage: {source: u, scal: 2}}'),
    ('rig', 'friction: {levl: 2}'), ('rig', 'machine: {ratio: many}')])
def test_a_slip_does_not_fit(kind, text):
    judge = Draft202012Validator(KINDS[kind][0].schema())
    assert not judge.is_valid(read_yaml(text))


@pytest.mark.parametrize('kind', KINDS)
def test_the_command_prints_it(kind, capsys):
    assert main(['schema', kind]) == 0
    assert json.loads(capsys.readouterr().out) == KINDS[kind][0].schema()
