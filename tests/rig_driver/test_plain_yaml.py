"""Files of rigs, drives and mappings: a word that two programs read differently is refused."""

from pathlib import Path
import re

import pytest
import yaml

from servo_rig_driver.adapter.mapped_columns import MappingError, read_mapping
from servo_rig_driver.devices.device import DeviceError
from servo_rig_driver.devices.mit_table import load_mit_table
from servo_rig_driver.emulated.drives.by_protocol import driver_parameters
from servo_rig_driver.emulated.rig_file import load_rig, RigFileError
from servo_rig_driver.plain_yaml import read_yaml

CONFIG = Path(__file__).resolve().parents[2] / 'config'


@pytest.mark.parametrize('word', ['30:1', '1:30.5', '010', 'off', 'Yes', '-017'])
def test_a_word_that_is_read_as_another_value_is_named_with_its_line(word):
    with pytest.raises(yaml.YAMLError, match=f'line 2: {word} would be read as'):
        read_yaml(f'a: 1\nb: [{word}]')


def test_plain_numbers_words_and_quoted_texts_are_what_they_are():
    text = 'a: [30, 1.5, 0x10, 0, 0.5, true, False, "30:1", \'off\', null]'
    assert read_yaml(text) == {'a': [30, 1.5, 16, 0, 0.5, True, False, '30:1', 'off', None]}
    assert read_yaml('') is None
    assert read_yaml('a: &x [1]\nb: *x') == {'a': [1], 'b': [1]}


@pytest.mark.parametrize(('load', 'error', 'text'), [
    (load_rig, RigFileError, 'transmission:\n  ratio: 30:1\n'),
    (driver_parameters, DeviceError, 'driver:\n  ros__parameters: {device.ratio: 30:1}\n'),
    (read_mapping, MappingError, 'time: {source: t}\ncolumns: {current: {scale: 30:1}}\n'),
    (lambda path: load_mit_table(str(path)), DeviceError, 'ranges: {kp: [0, 30:1]}\n')])
def test_no_file_of_a_rig_has_a_ratio_with_a_colon_as_1801(load, error, text, tmp_path):
    path = tmp_path / 'own.yaml'
    path.write_text(text)
    with pytest.raises(error, match='30:1 would be read as a number'):
        load(path)


@pytest.mark.parametrize('file', sorted(CONFIG.glob('*/*.yaml')), ids=lambda file: file.stem)
def test_the_shipped_files_are_plain(file):
    assert read_yaml(file.read_text('utf8')) == yaml.safe_load(file.read_text('utf8'))


@pytest.mark.parametrize(('load', 'error', 'text'), [
    (load_rig, RigFileError, 'transmission:\n  ratio: {0}\n'),
    (driver_parameters, DeviceError, 'driver:\n  ros__parameters: {{device.ratio: {0}}}\n'),
    (read_mapping, MappingError, 'time: {{source: t}}\ncolumns: {{current: {{scale: {0}}}}}\n'),
    (lambda path: load_mit_table(str(path)), DeviceError, 'ranges: {{kp: [0, {0}]}}\n')])
@pytest.mark.parametrize('sign', ['', '-'])
def test_a_whole_number_beyond_all_floats_is_named_with_its_line(load, error, text, sign,
                                                                 tmp_path):
    path = tmp_path / 'own.yaml'
    path.write_text(text.format(sign + '1' + '0' * 400))
    with pytest.raises(error, match=r'a whole number of 40[12] digits is more than a float64'):
        load(path)


@pytest.mark.parametrize(('text', 'why'), [
    ('transmission: {ratio: 9.0, ratio: 77.0}', "line 1: 'ratio' is there twice"),
    ('a: 1\nb: 2\na: 3', "line 3: 'a' is there twice"),
    ('a: ' + '[' * 100_000, 'line 1 is nested deeper than 20 levels'),
    ('- ' * 10_000, 'line 1 is nested deeper than 20 levels'),
    ('a: &a {b: 1}\nc: {<<: *a}', 'line 2: << takes in another mapping')])
def test_what_hides_a_value_or_never_ends_is_refused(text, why, tmp_path):
    with pytest.raises(yaml.YAMLError, match=re.escape(why)):
        read_yaml(text)
    (tmp_path / 'own.yaml').write_text(text)
    with pytest.raises(RigFileError):
        load_rig(tmp_path / 'own.yaml')
