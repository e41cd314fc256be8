"""Tables become bags, or a sentence says why not."""

import json
from pathlib import Path
import subprocess
import sys

import numpy as np
import pyarrow as pa
from pyarrow import csv, parquet
import pytest
from scipy.io import savemat

from servo_identify.cli import main
from servo_identify.data.check import check
from servo_identify.data.column_units import named_columns
from servo_identify.data.table_import import import_table
from servo_identify.data.tables import read_table
from servo_identify.data.time_units import WORDS
from servo_twin.bag import read_recording
from servo_twin.description.servo_file import load
from servo_twin.recording.recording import COLUMNS

CONFIG = Path(__file__).parents[2] / 'config'
SERVO = CONFIG / 'servos' / 'rv_bench.yaml'
LINEAR = CONFIG / 'servos' / 'emps.yaml'
TIME = np.arange(200) * 1e-3


def table(**columns) -> dict[str, np.ndarray]:
    return {'t': TIME, 'voltage': np.sin(TIME), 'motor_position': TIME**2} | columns


def write_csv(path: Path, columns: dict) -> Path:
    csv.write_csv(pa.table(columns), path)
    return path


def convert(path: Path, bag: Path, *options: str) -> int:
    return main(['import', str(path), '--servo', str(SERVO), '-o', str(bag), *options])


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
    ({'t': TIME[::-1].copy()}, 'time runs backwards from 0.199 s in row 1 to 0.198 s in row 2'),
    ({'t': np.where(TIME == TIME[7], np.nan, TIME)}, 't = nan in row 8; every row needs a time'),
    ({'t': np.full(200, 3.0)}, '199 of 200 rows repeat the time of the row before, and 50%'),
    ({'voltage': np.where(TIME == TIME[4], np.inf, TIME)}, 'voltage is infinite in row 5'),
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


@pytest.mark.parametrize('rows, refused', [(2, False), (5, True)])
def test_stamps_that_are_coarser_than_the_rows_are_refused_above_a_half(tmp_path, rows, refused):
    path = write_csv(tmp_path / 'a.csv', table(t=TIME // (rows * 1e-3) * rows * 1e-3))
    if refused:
        with pytest.raises(ValueError, match='coarser than the rows. Write .* with more digits'):
            import_table(path, SERVO)
    else:
        assert len(import_table(path, SERVO)) < 120


@pytest.mark.parametrize('time, unit', [
    (1e9 * TIME, 'ns'), (1e3 * TIME, 'ms'), (1e6 * TIME, 'us'),
    (45_352.4 + 2.0 * TIME / 86_400.0, 'days')])
def test_it_asks_for_the_unit_of_the_time_that_its_size_tells(tmp_path, time, unit):
    path = write_csv(tmp_path / 'a.csv', table(t=time))
    recording = import_table(path, SERVO)
    told = next((one.sentence for one in check([recording], load(SERVO))
                 if one.level == 'red'), '')
    assert f'for a servo; the time may be in {WORDS[unit]}.' in told
    assert unit == 'ms' or f'is t in {unit}?' in recording.note


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


def test_it_reads_the_signals_of_a_scope_by_their_labels(tmp_path):
    signals = np.zeros((1, 2), [('values', 'O'), ('label', 'O')])
    signals[0, 0] = (np.array([[1.0], [2.0], [3.0]]), 'u')
    signals[0, 1] = (np.array([[0.0], [0.5], [1.0]]), 'motor angle')
    savemat(tmp_path / 'a.mat', {'scope': {'time': np.arange(3.0)[:, None], 'signals': signals}})
    read = read_table(tmp_path / 'a.mat')
    assert read['scope.signals[u].values'].tolist() == [1.0, 2.0, 3.0]
    assert read['scope.signals[motor angle].values'].tolist() == [0.0, 0.5, 1.0]
    savemat(tmp_path / 'b.mat', {'Ts': 0.002})
    with pytest.raises(ValueError, match='timeseries'):
        read_table(tmp_path / 'b.mat')


def test_a_record_may_stand_in_each_line_and_hold_another(tmp_path):
    path = tmp_path / 'a.jsonl'
    path.write_text(''.join(json.dumps({'t': 0.1 * k, 'mode': 'run', 'motor': {'q': k, 'u': 1}})
                            + '\n' for k in range(3)))
    read = read_table(path)
    assert read['motor.q'].tolist() == [0.0, 1.0, 2.0] and 'mode' in read.refused
    path.write_text('{"t": 0}\n{"t":')
    with pytest.raises(ValueError, match='is no JSON file'):
        read_table(path)


def test_an_array_of_objects_that_nobody_asks_for_is_no_harm(tmp_path):
    np.savez(tmp_path / 'a.npz', t=np.arange(3.0), motor_position=np.arange(3.0),
             about=np.array({'rig': 1}, dtype=object))
    assert len(import_table(tmp_path / 'a.npz', SERVO)) == 3
    with pytest.raises(ValueError, match="'about' is no plain array"):
        read_table(tmp_path / 'a.npz')['about']


def test_it_reads_feather_and_single_arrays_of_numpy(tmp_path):
    import pyarrow
    from pyarrow import feather
    columns = {'t': [0.0, 0.1, 0.2], 'voltage': [1.0, 2.0, 3.0], 'motor_position': [0.0, 0.5, 1.0]}
    since = pyarrow.array([0, 100_000, 200_000], pyarrow.duration('us'))
    feather.write_feather(pyarrow.table({**columns, 't': since}), tmp_path / 'a.feather')
    assert import_table(tmp_path / 'a.feather', SERVO).period == pytest.approx(0.1)
    rows = list(zip(*columns.values(), strict=True))
    np.save(tmp_path / 'a.npy', np.array(rows, [(name, float) for name in columns]))
    assert import_table(tmp_path / 'a.npy', SERVO)['voltage'].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize('name, content, text', [
    ('a.csv', '', 'has no rows'), ('a.csv', 't,voltage,motor_position\n', 'has no rows'),
    ('a.csv', 't,voltage,motor_position\n1,2\n', 'is no table'),
    ('a.csv', 't,t,motor_position\n1,2,3\n', r"no column t; it has \['t \(1\)', 't \(2\)'"),
    ('a.xyz', 'x', "suffix '.xyz' is not a table"), ('a.parquet', 'x', 'is no Parquet file'),
    ('a.json', '[]', 'has no rows'), ('nowhere.csv', None, 'does not exist')])
def test_it_says_what_is_no_table(tmp_path, name, content, text):
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises((ValueError, OSError), match=text):
        import_table(tmp_path / name, SERVO)


def test_a_clock_that_jumps_by_years_is_no_pause_of_the_logger(tmp_path):
    time = np.arange(100) * 2e-3
    time[50:] += 1.7e9
    path = write_csv(tmp_path / 'a.csv', {'t': time, 'voltage': time, 'motor_position': time})
    with pytest.raises(ValueError, match=r'time jumps from 0.098 s in row 50 to 1.7e\+09'):
        import_table(path, SERVO)


def test_it_resamples_measurements_linearly_and_commands_by_holding(tmp_path):
    random = np.random.default_rng(4)
    time = np.cumsum(random.uniform(4e-3, 6e-3, 400))
    columns = {'t': time, 'voltage': np.arange(400.0), 'motor_position': 3.0 * time + 1.0}
    recording = import_table(write_csv(tmp_path / 'a.csv', columns), SERVO, period=2e-3)
    grid = recording.start + recording.time
    assert recording.period == 2e-3 and 'resampled to 0.002 s' in recording.warnings[0]
    assert np.allclose(recording['motor_position'], 3.0 * grid + 1.0)
    assert np.array_equal(recording['voltage'], np.searchsorted(time, grid + 1e-12, 'right') - 1)


def test_it_makes_nothing_up_across_a_hole(tmp_path):
    keep = (TIME < 0.05) | (TIME > 0.15)
    recording = import_table(write_csv(tmp_path / 'a.csv', {
        name: column[keep] for name, column in table().items()}), SERVO)
    assert len(recording) == 200 and recording.period == pytest.approx(1e-3)
    lost = np.isnan(recording['motor_position'])
    assert 100 <= lost.sum() <= 102 and np.isnan(recording['voltage'][lost]).all()
    assert any('holes of more than 3 periods' in warning for warning in recording.warnings)


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


def test_all_short_names_are_named_at_once_and_time_needs_no_question(tmp_path):
    table = tmp_path / 'short.csv'
    table.write_text('time,u,i,theta\n0,1,2,3\n')
    with pytest.raises(ValueError, match=r"'u'; is it 'voltage'\?; 'i': is it 'current'\?; "
                       r"'theta': is it 'motor_position'\? .*servo-identify init"):
        named_columns(read_table(table), None, [])


def test_a_frame_of_pandas_in_json_is_read_column_by_column(tmp_path):
    path = tmp_path / 'a.json'
    path.write_text(json.dumps({name: {str(k): float(x) for k, x in enumerate(column)}
                                for name, column in table().items()}))
    assert np.array_equal(import_table(path, SERVO)['motor_position'], TIME**2)


@pytest.mark.parametrize(('named', 'text'), [
    ('.', "is a folder and no table; it holds tables, which are '"),
    ('*.csv', 'names 2 files, and init takes one, such as'),
    ('*.parquet', 'no file or folder has a name of this pattern')])
def test_what_takes_one_table_says_so_of_a_folder_and_of_a_pattern(tmp_path, capsys, named, text):
    for name in 'ab':
        write_csv(tmp_path / f'{name}.csv', table())
    assert main(['init', str(tmp_path / named), '-o', str(tmp_path / 'new')]) == 2
    assert text in capsys.readouterr().err


def test_a_wrong_choice_is_answered_by_its_sentence_alone(capsys):
    with pytest.raises(SystemExit):
        main(['init', 'a.csv', '-o', 's.yaml', '--drive', 'volt'])
    said = capsys.readouterr().err
    assert said.startswith('servo-identify init: argument --drive: invalid choice')
    assert said.count('\n') == 1


def test_mat_and_json_files_with_our_names_need_no_mapping(tmp_path):
    columns = table(pair=np.ones((200, 2)))
    savemat(tmp_path / 'a.mat', columns)
    (tmp_path / 'a.json').write_text(json.dumps(
        {name: np.asarray(column).tolist() for name, column in columns.items() if name != 'pair'}))
    for name in ('a.mat', 'a.json'):
        assert np.array_equal(import_table(tmp_path / name, SERVO)['motor_position'], TIME**2)
    savemat(tmp_path / 's.mat', {'log': columns})
    assert {'log.t', 'log.pair[1]'} <= set(read_table(tmp_path / 's.mat').columns)


def test_jitter_and_lost_rows_leave_the_period_what_it_was(tmp_path):
    random = np.random.default_rng(5)
    time = (TIME + random.uniform(-2e-5, 2e-5, 200))[random.random(200) > 0.05]
    columns = {'t': time, 'voltage': time, 'motor_position': time}
    assert import_table(write_csv(tmp_path / 'a.csv', columns), SERVO).period == pytest.approx(
        1e-3, rel=5e-4)


def test_an_npz_file_is_a_table_of_its_rows(tmp_path):
    np.savez(tmp_path / 'run.npz', t=np.arange(3), voltage=np.ones(3), gain=2.0, pair=np.ones(2))
    table = read_table(tmp_path / 'run.npz')
    assert set(table.columns) == {'t', 'voltage'}
    assert table.facts == {'gain': 2.0}
    (tmp_path / 'bad.npz').write_text('no archive')
    with pytest.raises(ValueError, match='is no NPZ file'):
        read_table(tmp_path / 'bad.npz')


def test_it_takes_the_name_of_a_shipped_servo_and_says_which_there_are(tmp_path, capsys):
    table = tmp_path / 'a.csv'
    table.write_text('t [s],voltage [V],motor_position [rad]\n' + ''.join(
        f'{0.001 * k:.3f},1.0,{0.01 * k:.3f}\n' for k in range(200)))
    ends = ['-o', str(tmp_path / 'bag')]
    with pytest.raises(SystemExit):
        main(['import', str(table), '--servo', 'gearmotor', *ends])
    assert 'dc_gearmotor' in capsys.readouterr().err
    assert main(['import', str(table), '--servo', 'dc_gearmotor', *ends]) == 0


def test_a_lost_row_leaves_the_others_as_they_are_though_their_stamps_jitter(tmp_path):
    chance, kept = np.random.default_rng(1), np.delete(np.arange(4000), [100, 101, 2000])
    time = 1e-3 * np.arange(4000) + 2e-6 * chance.standard_normal(4000)
    columns = {'t': time, 'voltage': np.ones(4000), 'motor_position': chance.normal(size=4000)}
    recording = import_table(write_csv(tmp_path / 'a.csv', {
        name: column[kept] for name, column in columns.items()}), SERVO)
    assert recording.period == 1e-3 and len(recording) == 4000
    assert np.array_equal(recording['motor_position'][kept], columns['motor_position'][kept])


def test_a_hole_of_three_periods_is_filled_wherever_it_is(tmp_path):
    kept = np.delete(np.arange(6000), [1234, 1235, 4000, 4001, 5000, 5001])
    columns = {'t': np.round(1e-3 * kept, 3), 'voltage': np.ones(len(kept)),
               'motor_position': 1e-3 * kept}
    recording = import_table(write_csv(tmp_path / 'a.csv', columns), SERVO)
    assert not any('holes' in warning for warning in recording.warnings)
    assert np.allclose(recording['motor_position'], 1e-3 * np.arange(6000))
