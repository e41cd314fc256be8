"""Tables become bags, or a sentence says why not."""

from pathlib import Path
import subprocess
import sys

import numpy as np
import pyarrow as pa
from pyarrow import csv, parquet
import pytest
from small_tables import CONFIG, convert, SERVO, table, TIME, write_csv

from servo_identify.cli import main
from servo_identify.data.column_names import likely, NAMES
from servo_identify.data.column_units import named_columns
from servo_identify.data.table_import import import_table
from servo_identify.data.tables import read_table
from servo_twin.bag import read_recording
from servo_twin.recording.recording import COLUMNS


@pytest.mark.parametrize('suffix', ['.csv', '.parquet'])
def test_it_keeps_the_numbers_of_a_table(tmp_path, suffix):
    random = np.random.default_rng(2)
    columns = {'t': TIME} | {name: random.standard_normal(200) for name in COLUMNS}
    path = tmp_path / f'run{suffix}'
    (csv.write_csv if suffix == '.csv' else parquet.write_table)(pa.table(columns), path)
    assert convert(path, tmp_path / 'bag', '--family', 'chirp', '--replicate', '2') == 0
    again = read_recording(tmp_path / 'bag')
    for name in COLUMNS:
        assert np.array_equal(again[name], columns[name])
    assert (again.period, again.family, again.replicate) == (1e-3, 'chirp', 2)
    assert (again.servo, again.warnings, again.note) == ('rv_bench', (), '')
    assert again.servo_file == SERVO.read_text()


@pytest.mark.parametrize('header', ['voltage [A]', 'voltage [mA]', 'added_command [A]'])
def test_a_command_in_amperes_is_refused_for_a_drive_that_takes_volts(tmp_path, header):
    path = write_csv(tmp_path / 'a.csv', {'t': TIME, 'motor_position': TIME, header: TIME})
    with pytest.raises(ValueError, match=r"column '.*A\]' is in 'm?A', and .* takes V"):
        import_table(path, CONFIG / 'servos' / 'geared_dc.yaml')
    import_table(path, CONFIG / 'servos' / 'two_mass.yaml')  # its gain is in A/V


def test_it_leaves_what_is_missing_nan(tmp_path):
    recording = import_table(write_csv(tmp_path / 'a.csv', table()), SERVO)
    assert [name for name in COLUMNS if recording.has(name)] == ['voltage', 'motor_position']


def test_it_finds_family_and_replicate_beside_the_tables(tmp_path):
    write_csv(tmp_path / 'a.csv', table())
    listing = tmp_path / 'recordings.yaml'
    for text in ('a.csv: {family: hold, replicate: 3}', 'a: {family: hold, replicate: 3}',
                 'recordings:\n- {file: a.csv, family: hold, replicate: 3}'):
        listing.write_text(text)
        recording = import_table(tmp_path / 'a.csv', SERVO)
        assert (recording.family, recording.replicate) == ('hold', 3)
    assert import_table(tmp_path / 'a.csv', SERVO, family='chirp').family == 'chirp'
    listing.write_text('a: {family: 3}')
    with pytest.raises(ValueError, match='family = 3 is of the wrong kind, it is a text'):
        import_table(tmp_path / 'a.csv', SERVO)


def test_it_converts_the_units_that_a_header_gives(tmp_path):
    columns = table()
    columns['motor_position [deg]'] = columns.pop('motor_position') * 180.0
    columns['reference_velocity (rpm)'] = np.full(200, 30.0)
    columns['torque [N m]'] = np.full(200, 5.0)
    columns['t [ms]'] = columns.pop('t') * 1e3
    recording = import_table(write_csv(tmp_path / 'a.csv', columns), SERVO)
    assert np.allclose(recording['motor_position'], np.pi * TIME**2)
    assert np.allclose(recording['reference_velocity'], np.pi)
    assert np.array_equal(recording['torque'], np.full(200, 5.0))
    assert recording.period == 1e-3
    assert "'motor_position [deg]' is converted to rad by 0.0174532925" in recording.note
    assert recording.warnings == ()


@pytest.mark.parametrize('change, text', [
    ({'motor_position [furlong]': TIME}, "is in 'furlong', motor_position is in rad: 'furlong'"),
    ({'motor_position [counts]': TIME}, 'write 1/4096 rev in place of counts'),
    ({'load_position [mm]': TIME}, 'a linear axis says so in its servo file: travel: linear'),
    ({'motor_angle': TIME}, "there is no column 'motor_angle'; is it 'motor_position'"),
    ({'volts': TIME, 'load_pos': TIME}, "there is no column 'load_pos'; is it 'load_position'"),
    ({'t': np.r_[TIME[:7], TIME[8], TIME[7], TIME[9:]]},
     'time runs backwards from 0.008 s in row 8 to 0.007 s in row 9'),
    ({'t': np.where(TIME == TIME[7], np.nan, TIME)},
     't = nan in row 8; every row needs a time, and 1 of 200 have none: delete these rows'),
    ({'t': np.full(200, 3.0)}, '199 of 200 rows repeat the time of the row before, and 50%'),
    ({'t': np.where(TIME == TIME[7], np.inf, TIME)}, 't = inf in row 8; every row needs a time'),
    ({'voltage': ['1,5'] * 200}, "column 'voltage' has '1,5' in row 1, which is no number"),
])
def test_it_says_what_is_wrong_with_a_table(tmp_path, capsys, change, text):
    columns = table(**change)
    if any('motor' in name for name in change):
        del columns['motor_position']
    path = write_csv(tmp_path / 'a.csv', columns)
    assert convert(path, tmp_path / 'bag') == 2
    said = capsys.readouterr().err
    assert text in said and str(path) in said
    assert not (tmp_path / 'bag').exists()


def test_an_import_that_fails_leaves_no_bag_in_the_way_of_the_next(tmp_path, monkeypatch):
    path = write_csv(tmp_path / 'a.csv', table())

    def fails(*_):
        raise ValueError('no')

    with monkeypatch.context() as full:
        full.setattr('servo_twin.bag.RecordingWriter.add', fails)
        assert convert(path, tmp_path / 'bag') == 2
    assert [one.name for one in tmp_path.iterdir()] == ['a.csv']
    assert convert(path, tmp_path / 'bag') == 0


def belt(folder: Path) -> Path:
    """Return the servo file of a motor that turns and a load that moves straight."""
    (folder / 'belt.yaml').write_text(
        'servo: belt\ntravel: linear\ndrive: {type: current, gain: 1.0, torque_constant: 0.2}\n'
        'mechanism: {type: rigid, rotor_inertia: 1e-4, load_inertia: 8.0, ratio: '
        '{value: 150.0, unit: rad/m}}\n')
    return folder / 'belt.yaml'


def test_a_belt_has_its_motor_in_degrees_and_its_load_in_millimetres(tmp_path):
    columns = table(**{'load_position [mm]': TIME**2 / 150.0 * 1e3})
    columns['motor_position [deg]'] = np.degrees(columns.pop('motor_position'))
    recording = import_table(write_csv(tmp_path / 'a.csv', columns), belt(tmp_path))
    assert np.allclose(recording['motor_position'], TIME**2)
    assert np.allclose(recording['load_position'], TIME**2 / 150.0)
    assert "'load_position [mm]' is converted to m" in recording.note


def test_a_motor_that_turns_is_not_read_in_metres(tmp_path):
    columns = {'t': TIME, 'voltage [V]': TIME, 'motor_position [mm]': TIME}
    with pytest.raises(ValueError, match='motor of this axis turns, since its ratio is in rad/m'):
        import_table(write_csv(tmp_path / 'a.csv', columns), belt(tmp_path))


@pytest.mark.parametrize('name', ['voltage', 'added_command'])
def test_a_command_may_be_a_current(tmp_path, name):
    columns = table(**{f'{name} [mA]': TIME})
    if name == 'voltage':
        del columns['voltage']
    recording = import_table(write_csv(tmp_path / 'a.csv', columns), SERVO)
    assert np.allclose(recording[name], 1e-3 * TIME)
    assert f"'{name} [mA]' is converted to A" in recording.note


@pytest.mark.parametrize('left, text', [
    (['voltage', 'motor_position'], 'has no column t'),
    (['t', 'voltage'], 'has neither motor_position nor load_position')])
def test_it_names_the_columns_that_must_be_there(tmp_path, left, text):
    path = write_csv(tmp_path / 'a.csv', {name: table()[name] for name in left})
    with pytest.raises(ValueError, match=text):
        import_table(path, SERVO)


@pytest.mark.parametrize('change, text', [
    ({'load_position': 180 / np.pi}, 'load_position looks like degrees'),
    ({'motor_position': 180 / np.pi}, 'motor_position / ratio looks like degrees'),
    ({'motor_position': 1 / 161}, 'look as if one were on the other shaft'),
    ({'load_position': -1.0}, 'runs against load_position; positive must be the same way'),
    ({'reference_position': 180 / np.pi}, 'reference_position looks like degrees'),
    ({'motor_position': 652.0}, r'/ ratio moves 652 times as far as load_position \(ratio 161\)'),
    ({'load_position': 2.0 * np.pi}, 'moves 0.1592 times .* leaves a factor of 3 at most')])
def test_it_holds_angles_against_each_other(tmp_path, change, text):
    angle = np.sin(20.0 * TIME)
    columns = table(motor_position=161.0 * angle, load_position=angle + 1e-4 * np.cos(900 * TIME),
                    reference_position=angle)
    path = write_csv(tmp_path / 'a.csv', columns)
    assert import_table(path, SERVO).warnings == ()
    write_csv(path, columns | {name: columns[name] * factor for name, factor in change.items()})
    with pytest.raises(ValueError, match=text):
        import_table(path, SERVO)


def test_a_load_near_its_resonance_may_move_further_than_its_motor(tmp_path):
    servo = tmp_path / 'soft.yaml'
    time = np.arange(5000) * 1e-3
    for stiffness, refused in ((9.0, True), (0.9, False)):  # resonance: 30 and 9.5 rad/s
        servo.write_text(SOFT.format(stiffness))
        path = write_csv(tmp_path / 'a.csv', table(
            t=time, voltage=time, motor_position=0.1 * np.sin(8.0 * time),
            load_position=0.4 * np.sin(8.0 * time)))
        if refused:
            with pytest.raises(ValueError, match='moves 0.25 times as far'):
                import_table(path, servo)
        else:
            import_table(path, servo)


SOFT = """servo: soft
drive: {{type: current, gain: 1.0, torque_constant: 0.2}}
mechanism: {{type: two_inertia, rotor_inertia: 1.0e-3, load_inertia: 1.0e-2, ratio: 1.0,
            stiffness: {}, damping: 1.0e-3}}
"""


def test_it_leaves_unknown_columns_and_repeated_times_out_with_a_warning(tmp_path):
    time = TIME.copy()
    time[50:] -= 1e-3
    recording = import_table(
        write_csv(tmp_path / 'a.csv', table(t=time, humidity=TIME)), SERVO)
    assert len(recording) == 199
    assert "columns ['humidity'] are left out" in recording.note
    assert any('1 rows repeat the time' in warning and 'row 51' in warning
               for warning in recording.warnings)
    assert recording.note.endswith('\n'.join(recording.warnings))


def test_it_says_what_bags_hold(tmp_path, capsys):
    columns = table(motor_position=np.where(TIME == TIME[9], np.nan, TIME))
    convert(write_csv(tmp_path / 'a.csv', columns), tmp_path / 'bag', '--family', 'chirp')
    capsys.readouterr()
    assert main(['info', str(tmp_path / 'bag'), str(tmp_path / 'nowhere')]) == 2
    said = capsys.readouterr()
    assert '0.2 s at 1000 Hz' in said.out and 'family chirp' in said.out
    assert 'not measured' in said.out and 'motor_position is missing in 1 row,' in said.out
    assert 'nowhere does not exist' in said.err


def test_the_command_starts_without_torch_and_ros():
    code = ('import sys; from servo_identify.cli import main; main([]); '
            'sys.exit(bool({"torch", "rclpy", "numba", "numpy"} & set(sys.modules)))')
    assert subprocess.run([sys.executable, '-c', code], stdout=subprocess.DEVNULL).returncode == 0


def test_it_names_an_unknown_command(capsys):
    assert main(['fly']) == 2
    assert "there is no command 'fly'; there are ['init', 'schema'" in capsys.readouterr().err


@pytest.mark.parametrize(('header', 'meant'), [
    ('stamp', 't'), ('u', 'voltage'), ('i', 'current'), ('theta', 'motor_position')])
def test_a_short_name_is_refused_with_the_name_that_is_meant(tmp_path, header, meant):
    names = {'t': 't', 'voltage': 'voltage', 'motor_position': 'motor_position'} | {meant: header}
    table = tmp_path / 'short.csv'
    table.write_text(','.join(names.values()) + '\n' + ','.join('0' * len(names)) + '\n')
    with pytest.raises(ValueError, match=f"no column '{header}'; is it '{meant}'"):
        named_columns(read_table(table), None, [])


def test_what_was_commanded_is_not_taken_for_a_measured_angle(tmp_path):
    table = tmp_path / 'drive.csv'
    table.write_text('time,Commanded Position,Actual Motor Position\n0,1,2\n')
    with pytest.raises(ValueError, match="'Commanded Position'; is it 'reference_position'"):
        named_columns(read_table(table), None, [])


@pytest.mark.parametrize(('header', 'meant'), [
    ('Goal Position', 'reference_position'), ('Sollposition', 'reference_position'),
    ('Present Position', 'motor_position'), ('laod_position', 'load_position'),
    ('Present Velocity', ''), ('torque_cmd', ''), ('humidity', '')])
def test_a_reference_is_not_named_as_what_was_measured_nor_the_other_way(header, meant):
    assert likely(header, list(NAMES)) == meant


def test_all_short_names_are_named_at_once_and_time_needs_no_question(tmp_path):
    table = tmp_path / 'short.csv'
    table.write_text('time,u,i,theta\n0,1,2,3\n')
    with pytest.raises(ValueError, match=r"'u'; is it 'voltage'\?; 'i': is it 'current'\?; "
                       r"'theta': is it 'motor_position'\? .*servo-identify init"):
        named_columns(read_table(table), None, [])


@pytest.mark.parametrize(('named', 'text'), [
    ('.', 'names 2 files, and init takes one, such as'),
    ('empty', 'is a folder without a table'),
    ('*.csv', 'names 2 files, and init takes one, such as'),
    ('*.parquet', 'no file or folder has a name of this pattern')])
def test_what_takes_one_table_says_so_of_a_folder_and_of_a_pattern(tmp_path, capsys, named, text):
    for name in 'ab':
        write_csv(tmp_path / f'{name}.csv', table())
    (tmp_path / 'empty').mkdir()
    assert main(['init', str(tmp_path / named), '-o', str(tmp_path / 'new')]) == 2
    assert text in capsys.readouterr().err


def test_a_wrong_choice_is_answered_by_its_sentence_alone(capsys):
    with pytest.raises(SystemExit):
        main(['init', 'a.csv', '-o', 's.yaml', '--drive', 'volt'])
    said = capsys.readouterr().err
    assert said.startswith('servo-identify init: argument --drive: invalid choice')
    assert said.count('\n') == 1


def test_it_takes_the_name_of_a_shipped_servo_and_says_which_there_are(tmp_path, capsys):
    table = tmp_path / 'a.csv'
    table.write_text('t [s],voltage [V],motor_position [rad]\n' + ''.join(
        f'{0.001 * k:.3f},1.0,{0.01 * k:.3f}\n' for k in range(200)))
    ends = ['-o', str(tmp_path / 'bag')]
    with pytest.raises(SystemExit):
        main(['import', str(table), '--servo', 'gearmotor', *ends])
    assert 'dc_gearmotor' in capsys.readouterr().err
    assert main(['import', str(table), '--servo', 'dc_gearmotor', *ends]) == 0
