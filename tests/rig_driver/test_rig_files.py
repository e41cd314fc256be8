"""Rig files, recordings without a bus, and the command that makes them."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import yaml

from servo_rig_driver.emulated import excitation_families, make_recording
from servo_rig_driver.emulated.emulated_bench import COLUMNS, run
from servo_rig_driver.emulated.excitation_families import ExcitationError, FAMILIES
from servo_rig_driver.emulated.rig_file import load_rig, rig_settings, RigFileError
from servo_rig_driver.emulated.rig_properties import BY_PATH, PROPERTIES

RIGS = Path(__file__).parents[2] / 'config' / 'rigs'
RIG = RIGS / 'rv_bench.yaml'


@pytest.mark.parametrize('content, words', [
    ({'frictoin': {}}, "no section 'frictoin'"),
    ({'friction': {'level': 'much'}}, "friction.level = 'much' is no number"),
    ({'friction': {'level': float('nan')}}, 'must be finite'),
    ({'friction': {'level': -1}}, r'outside \[0, 100\]'),
    ({'friction': 3}, "section 'friction' must be a mapping"),
    ({'step': 1.0}, 'step = 1.0 s is outside'),
    ({'switches': [{'at': 1}]}, 'must have the keys at and set'),
    ({'switches': [{'at': 1, 'set': {'a.b': 1}}]}, "no property 'a.b'"),
    (None, 'is a mapping of sections'),
])
def test_nonsense_in_a_rig_file_is_named(content, words):
    with pytest.raises(RigFileError, match=words):
        rig_settings(content)


def test_a_rig_is_named_as_a_servo_is():
    assert load_rig('rv_plain') == load_rig(RIGS / 'rv_plain.yaml')
    with pytest.raises(RigFileError, match=r"'rv_plane' is no shipped rig; there are \["):
        load_rig('rv_plane')


def test_an_override_must_name_a_property():
    assert rig_settings({}, ['mesh.backlash=2']).values['mesh.backlash'] == 2.0
    with pytest.raises(RigFileError, match='path=value'):
        rig_settings({}, ['mesh.backlash'])


def test_the_shipped_bench_states_every_property_with_its_default():
    content = yaml.safe_load(RIG.read_text())
    stated = {f'{section}.{name}': value for section, values in content.items()
              if isinstance(values, dict) for name, value in values.items()}
    assert stated == {item.path: item.default for item in PROPERTIES}


@pytest.mark.parametrize('path', sorted(RIGS.glob('*.yaml')),
                         ids=lambda path: path.stem)
def test_every_shipped_rig_can_be_driven(path):
    rig = load_rig(path)
    columns = run(rig, 'voltage', np.full(500, 0.3 * rig.values['drive.command_limit']))
    measured = 'load_position' if rig.values['sensors.load_encoder'] else 'motor_position'
    assert columns[measured][-1] > 1e-3


def test_a_property_switches_on_while_the_rig_runs():
    late = rig_settings({'switches': [{'at': 0.25, 'set': {'withheld.load_drag': 30.0}}]})
    reference = np.full(500, 2.0)
    plain, switched = (run(rig, 'voltage', reference) for rig in (rig_settings({}), late))
    same = plain['load_position'] == switched['load_position']
    assert same[:251].all() and not same[260:].any()


def test_runs_are_repeatable_and_seeds_differ():
    reference = np.full(100, 1.0)
    first, again, other = (run(rig_settings({}), 'voltage', reference, seed=seed)['torque']
                           for seed in (1, 1, 2))
    assert np.array_equal(first, again) and not np.array_equal(first, other)


def test_a_rig_without_sensors_leaves_their_columns_empty():
    rig = rig_settings({'sensors': {'torque': 0.0, 'load_encoder': 0.0}})
    columns = run(rig, 'voltage', np.ones(20))
    assert np.isnan(columns['torque']).all() and np.isnan(columns['load_position']).all()


@pytest.mark.parametrize('name', FAMILIES)
def test_every_family_drives_the_bench_and_makes_a_table(name, tmp_path):
    columns = make_recording.make_recording(name, RIG, duration=2.0, seed=1)
    assert set(columns) == set(COLUMNS)
    assert all(len(values) == 2000 for values in columns.values())
    make_recording.write_table(tmp_path / 'table.csv', columns)
    head = (tmp_path / 'table.csv').read_text().splitlines()
    assert head[0] == ','.join(COLUMNS) and len(head) == 2001
    read = np.genfromtxt(tmp_path / 'table.csv', delimiter=',', names=True)
    for column in COLUMNS:
        np.testing.assert_allclose(read[column], columns[column], rtol=1e-11, atol=1e-14)


def test_the_command_makes_a_listed_recording(tmp_path, capsys):
    table = tmp_path / 'sine.npz'
    assert make_recording.main(['sine', '--rig', str(RIG), '--duration', '0.2', '--set',
                      'friction.level=1.5', '--setting', 'amplitude=2', '--list',
                      '--replicate', '3', '-o', str(table)]) == 0
    assert len(np.load(table)['t']) == 200
    assert 'replicate: 3' in (tmp_path / 'recordings.yaml').read_text()


@pytest.mark.parametrize('arguments, words', [
    (['waltz'], "no excitation family 'waltz'"),
    (['sine', '--setting', 'speed=1'], "sine has no setting 'speed'"),
    (['sine', '--set', 'friction.x=1'], "no property 'friction.x'"),
    (['sine', '--rate', '1'], 'rate = 1 Hz is outside'),
    (['sine', '--duration', '-1'], 'duration = -1 s is outside'),
])
def test_the_command_names_what_is_wrong(arguments, words, tmp_path, capsys):
    assert make_recording.main([*arguments, '--rig', str(RIG), '-o', str(tmp_path / 'a.csv')]) == 1
    assert words in capsys.readouterr().err


def test_settings_that_make_no_sense_are_refused():
    with pytest.raises(ExcitationError):
        excitation_families.family('chirp').waves(np.arange(10) * 1e-3, {'first': 0.0})


def test_every_property_says_what_it_means():
    assert len(BY_PATH) == len(PROPERTIES)
    for item in PROPERTIES:
        assert item.meaning and item.low <= item.default <= item.high


def test_recordings_that_are_made_at_once_are_all_noted(tmp_path):
    names = [f'sine_{n}.csv' for n in range(40)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda name: make_recording.note(tmp_path / name, 'sine', 1), names))
    assert sorted(yaml.safe_load((tmp_path / 'recordings.yaml').read_text())) == sorted(names)
