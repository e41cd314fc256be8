"""A mapping file says which column is which, and its table becomes a recording: it ..."""

import json

import numpy as np
import pytest
from scipy.io import savemat
from small_tables import CONFIG, SERVO, table, TIME, write_csv

from servo_identify.cli import main
from servo_identify.data.mapping import read_mapping
from servo_identify.data.table_import import import_table
from servo_twin.bag import read_recording


@pytest.mark.parametrize('name, content, text', [
    ('a.json', '{"rows": [1', 'is no JSON file'), ('a.json', '{"x": []}', "has no list 'rows'"),
    ('a.json', '{"rows": [1]}', 'is no list of records'), ('a.mat', 'x', 'is no MAT file'),
    ('a.json', '{"rows": [{"x": 1}]}', "has no column 'time'; it has"),
    ('a.json', '{"rows": [{"time": 1' + 400 * '0' + '}]}', 'in row 1, which is no number'),
    ('a.json', '{"rows": [{"time": "now"}]}', "column 'time' has 'now' in row 1")])
def test_it_says_what_a_mapping_cannot_take(tmp_path, name, content, text):
    (tmp_path / name).write_text(content)
    mapping = tmp_path / 'm.yaml'
    mapping.write_text('rows: rows\ntime: {source: time}\ncolumns: {voltage: {source: u}}\n')
    with pytest.raises(ValueError, match=text):
        import_table(tmp_path / name, SERVO, mapping=mapping)


@pytest.mark.parametrize('text, said', [
    ('[1, 2]', 'is no mapping file'), ('time: {source: t}', "'time' and 'columns' must be there"),
    ('time: {source: t}\ncolumns: {speed: {source: v}}', "there is no column 'speed'"),
    ('time: {source: t}\ncolumns: {voltage: {factor: 2}}', "voltage has no 'factor'; it has"),
    ('time: {source: t}\ncolumns: {voltage: {scale: 2}}', "give either 'source' or 'value'"),
    ('time: {source: t}\ncolumns: {voltage: {source: u, scale: x}}', "scale = 'x' is no number"),
    ('time: {source: t}\ncolumns: {voltage: {source: u, above: 1}}', 'go together'),
    ('time: {source: t}\ncolumns: {voltage: {source: u, zero: now}}', "zero = 'now'"),
    ('time: [', 'is no YAML')])
def test_it_says_what_is_wrong_with_a_mapping(tmp_path, text, said):
    (tmp_path / 'm.yaml').write_text(text)
    with pytest.raises(ValueError, match=said):
        import_table(write_csv(tmp_path / 'a.csv', table()), SERVO, mapping=tmp_path / 'm.yaml')


def test_it_follows_a_mapping(tmp_path):
    (tmp_path / 'm.yaml').write_text(
        'time: {source: clock, scale: 0.001}\n'
        'columns:\n'
        '  voltage: {source: raw, above: 32767, subtract: 65536, scale: 0.5, offset: 1, '
        'times: supply, negate: true}\n'
        '  motor_position: {source: angle, scale: 161, zero: first}\n'
        '  load_position: {source: angle, zero: mean}\n'
        '  temperature: {value: 25}\n'
        'recording: {family: "{kind}", note: "gain {gain}"}\n')
    savemat(tmp_path / 'a.mat', {
        'clock': [0.0, 10.0, 20.0], 'raw': [2, 65535, 4], 'supply': [10.0, 10.0, 5.0],
        'angle': [7.0, 8.0, 9.0], 'kind': 'sine', 'gain': 3.5})
    recording = import_table(tmp_path / 'a.mat', SERVO, mapping=tmp_path / 'm.yaml')
    assert np.allclose(recording['voltage'], [-20.0, -5.0, -15.0])
    assert np.array_equal(recording['motor_position'], [0.0, 161.0, 322.0])
    assert np.array_equal(recording['load_position'], [-1.0, 0.0, 1.0])
    assert np.array_equal(recording['temperature'], [25.0, 25.0, 25.0])
    assert (recording.period, recording.family, recording.note) == (0.01, 'sine', 'gain 3.5')


@pytest.mark.parametrize('name, mapping, servo, size, period', [
    ('emps/DATA_EMPS.mat', 'emps', 'emps', 24841, 1e-3),
    ('two_mass/MultisineTypeA.mat', 'two_mass', 'two_mass', 50000, 4e-4)])
def test_it_imports_real_recordings_to_the_last_bit(tmp_path, shared_data, name, mapping, servo,
                                                    size, period):
    from scipy.io import loadmat
    assert main(['import', str(shared_data / name), '--mapping',
                 str(CONFIG / 'imports' / f'{mapping}.yaml'), '--servo',
                 str(CONFIG / 'servos' / f'{servo}.yaml'), '-o', str(tmp_path / 'bag')]) == 0
    again = read_recording(tmp_path / 'bag')
    assert (len(again), again.period, again.servo) == (size, period, servo)
    source = loadmat(shared_data / name, squeeze_me=True)
    assert np.array_equal(again['voltage'], source['vir' if servo == 'emps' else 'iq_refx'])
    assert again.warnings == ()


def test_it_imports_every_run_of_the_small_servo(shared_data):
    files = sorted((shared_data / 'xl330').glob('*.json'))
    assert len(files) == 8
    for path in files:
        recording = import_table(path, CONFIG / 'servos' / 'xl330.yaml',
                                 mapping=CONFIG / 'imports' / 'xl330.yaml')
        entries = json.loads(path.read_text())['entries']
        assert abs(recording.duration - entries[-1]['timestamp'] + entries[0]['timestamp']) < 0.01
        assert np.nanmax(np.abs(recording['voltage'])) <= 7.5
        assert not recording.has('load_position')
        assert recording.family in path.stem and recording.note.startswith('kp ')
        error = recording['reference_position'] - recording['motor_position']
        on = slice(0, 500)
        assert np.corrcoef(error[on], recording['voltage'][on])[0, 1] > 0.5
        assert ('the drive is off' in recording.note) == ('drop' in path.stem)


def test_rows_of_several_topics_side_by_side_are_joined(tmp_path):
    """PlotJuggler writes a row a message, empty where another topic speaks."""
    rows = ['__time,/joint_states/a/position,/command/data']
    for k in range(100):
        rows.append(f'{5.0 + 0.002 * k:.6f},{0.01 * k},')
        if k % 5 == 0:
            rows.append(f'{5.0005 + 0.002 * k:.6f},,{k}')
    (tmp_path / 'plot.csv').write_text('\n'.join(rows) + '\n')
    mapping = tmp_path / 'm.yaml'
    mapping.write_text('time: {source: __time}\ncolumns:\n'
                       '  load_position: {source: /joint_states/a/position}\n'
                       '  voltage: {source: /command/data}\n')
    one = import_table(tmp_path / 'plot.csv', SERVO, mapping=mapping)
    assert len(one) == 100 and one.period == 0.002
    assert np.allclose(one['load_position'], 0.01 * np.arange(100))
    row = np.arange(1, 100)  # a command comes after a quarter of its row
    assert np.allclose(one['voltage'][1:], row // 5 * 5.0 - np.where(row % 5, 0.0, 1.25))


@pytest.mark.parametrize(('text', 'word'), [
    ('time: {source: t}\ntime: {source: u}\n', "'time' is there twice"),
    ('time: &a {source: t}\ncolumns: {voltage: *a}\n', 'an alias'),
    ('time: {source: t, scale: .nan}\ncolumns: {voltage: {value: 0.0}}\n', 'no finite number'),
    ('time: ' + 300 * '[', 'nested deeper')])
def test_a_mapping_is_refused_that_says_a_thing_twice_or_endlessly(tmp_path, text, word):
    (tmp_path / 'mapping.yaml').write_text(text)
    with pytest.raises(ValueError, match=word):
        read_mapping(tmp_path / 'mapping.yaml')


def test_a_command_that_is_written_less_often_is_held_as_the_warning_says(tmp_path):
    path, mapping = tmp_path / 'a.csv', tmp_path / 'm.yaml'
    path.write_text('t,voltage,motor_position\n' + ''.join(
        f'{k * 0.002:g},{k / 5 if k % 5 == 0 else ""},{k / 8}\n' for k in range(100)))
    said, = import_table(path, SERVO).warnings
    assert 'voltage is missing in 80 rows' in said and 'join: true in a mapping file' in said
    mapping.write_text('join: true\ntime: {source: t}\ncolumns:\n  voltage: {source: voltage}\n'
                       '  motor_position: {source: motor_position}\n')
    found = import_table(path, SERVO, mapping=mapping)
    assert found['voltage'].tolist() == [k // 5 for k in range(100)] and not found.warnings


def test_a_zero_is_the_first_value_that_was_measured(tmp_path):
    columns = table(angle=np.where(TIME < 2e-3, np.nan, 5.0 + TIME))
    del columns['motor_position']
    mapping = tmp_path / 'm.yaml'
    mapping.write_text('time: {source: t}\ncolumns:\n'
                       '  motor_position: {source: angle, zero: first}\n')
    one = import_table(write_csv(tmp_path / 'a.csv', columns), SERVO, mapping=mapping)
    np.testing.assert_allclose(one['motor_position'][2:], TIME[2:] - TIME[2], atol=1e-9)


def test_a_constant_column_follows_the_steps_too(tmp_path):
    mapping = tmp_path / 'm.yaml'
    mapping.write_text('time: {source: t}\ncolumns:\n  motor_position: {source: motor_position}\n'
                       '  external_torque: {value: 2.0, scale: 1.5, negate: true}\n')
    one = import_table(write_csv(tmp_path / 'a.csv', table()), SERVO, mapping=mapping)
    assert np.all(one['external_torque'] == -3.0)


def test_it_adds_and_subtracts_another_column_in_the_same_numbers(tmp_path):
    coarse, fine = np.arange(len(TIME)) % 360.0, 0.25 * np.ones(len(TIME))
    path = write_csv(tmp_path / 'a.csv', {
        't': TIME, 'u': TIME, 'left': np.full(len(TIME), 1500.0),
        'right': np.full(len(TIME), 65536.0 - 500.0), 'coarse': coarse, 'fine': fine})
    (tmp_path / 'm.yaml').write_text(
        'time: {source: t}\ncolumns:\n  voltage: {source: u}\n'
        '  current: {source: left, plus: right, above: 32767, subtract: 65536, scale: 0.001}\n'
        '  motor_position: {source: coarse, minus: fine, wraps: 360, unit: deg}\n')
    one = import_table(path, SERVO, mapping=tmp_path / 'm.yaml')
    assert np.allclose(one['current'], 1.0)
    assert np.allclose(np.degrees(one['motor_position']), np.arange(len(TIME)) - 0.25)


def test_it_names_a_column_to_add_that_is_not_there(tmp_path):
    (tmp_path / 'm.yaml').write_text(
        'time: {source: t}\ncolumns: {voltage: {source: voltage, plus: volts}}\n')
    with pytest.raises(ValueError, match="has no column 'volts'"):
        import_table(write_csv(tmp_path / 'a.csv', table()), SERVO, mapping=tmp_path / 'm.yaml')
