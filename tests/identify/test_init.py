"""From a file of data to a servo file and a mapping file: init ..."""

import json
from pathlib import Path
import sys

import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.reading import read_recordings
from servo_identify.init.flag_names import TYPES, VALUES
from servo_identify.init.machine import flags, SECTIONS
from servo_identify.init.noise import noise_of
from servo_identify.init.sources import offered
from servo_twin.bag import write_recording
from servo_twin.description.servo_file import load
from servo_twin.recording.recording import COLUMNS, Recording

SERVO = Path(__file__).resolve().parents[2] / 'config' / 'servos' / 'geared_dc.yaml'
GIVEN = ['--drive', 'voltage', '--resistance', '2100 mohm', '--back-emf', '212 rpm/V',
         '--torque-constant', '45 mN m/A', '--rotor-inertia', '320 g cm2', '--load-inertia',
         '120 kg cm2', '--ratio', '50', '--no-questions']
COUNT = 2.0 * np.pi / 4096


@pytest.fixture(scope='module')
def run():
    """Return columns of a gear motor under a position loop, 4 s at 500 Hz."""
    period, ratio, inertia = 1e-4, 50.0, 3.2e-5 + 0.012 / 2500
    time = np.arange(0.0, 4.0, period)
    angle = speed = command = 0.0
    rows = []
    for k, t in enumerate(time):
        if k % 20 == 0:
            target = 0.6 * np.sin(2.5 * t) + 0.3 * np.sin(8.0 * t)
            command = float(np.clip(60.0 * (target - angle / ratio), -24.0, 24.0))
        current = (command - 0.045 * speed) / 2.1
        if k % 20 == 0:
            rows.append((t, command, current, round(angle / COUNT) * COUNT, angle / ratio))
        friction = 0.004 * np.tanh(2.0 * speed) + 2e-5 * speed
        speed += period * (0.045 * current - friction) / inertia
        angle += period * speed
    return dict(zip(('time', 'u', 'i', 'theta', 'q'), np.array(rows).T, strict=True))


def write(path, columns, delimiter=',', decimal='.', names=True):
    lines = [delimiter.join(columns)] if names else []
    lines += [delimiter.join(f'{v:.9g}'.replace('.', decimal) for v in row)
              for row in zip(*columns.values(), strict=True)]
    path.write_text('\n'.join(lines) + '\n')
    return path


def init(data, folder, *more):
    return main(['init', str(data), '-o', str(folder / 'new' / 's.yaml'), '--mapping-out',
                 str(folder / 'new' / 'm.yaml'), *GIVEN, *more])


def test_its_flags_are_those_of_the_declarations():
    assert {section: tuple(types) for section, types in SECTIONS.items()} == TYPES
    assert {name: tuple(dict.fromkeys(kind for _, kind in owners))
            for name, owners in flags().items()} == VALUES


@pytest.mark.parametrize('how', ['plain', 'bare', 'german', 'milliseconds and degrees', 'json'])
def test_both_files_pass_the_check_for_awkward_tables(run, tmp_path, how, capsys):
    columns = {name: run[name] for name in ('time', 'u', 'i', 'theta')}
    more = ['--column', 'motor_position=theta:rad']
    data = tmp_path / 'run.csv'
    if how == 'bare':
        write(data, columns, names=False)
        more = ['--column', 't=column_1', '--column', 'voltage=column_2', '--column',
                'current=column_3', '--column', 'motor_position=column_4:rad']
    elif how == 'german':
        write(data, dict(zip(('Zeit', 'Spannung', 'Strom', 'Winkel'), columns.values(),
                             strict=True)), ';', ',')
        more = ['--column', 'motor_position=Winkel:rad']
    elif how == 'json':
        data = tmp_path / 'run.json'
        data.write_text(json.dumps({'name': 'x', 'entries': [
            dict(zip(columns, row, strict=True))
            for row in np.array(list(columns.values())).T.tolist()]}))
    elif how == 'plain':
        write(data, columns)
    else:
        write(data, {**columns, 'time': 1e3 * run['time'], 'theta': np.degrees(run['theta'])})
        more = ['--column', 'motor_position=theta:deg']
    assert init(data, tmp_path, '--si', *more) == 0
    servo, mapping = tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml'
    assert main(['check', str(data), '--servo', str(servo), '--mapping', str(mapping)]) == 0
    made = load(servo)
    assert made.values['drive.resistance'] == pytest.approx(2.1)
    assert made.values['drive.back_emf'] == pytest.approx(30 / np.pi / 212, rel=1e-5)
    assert made.values['mechanism.rotor_inertia'] == pytest.approx(3.2e-5)
    one, = read_recordings([data], servo, mapping)
    assert one.period == pytest.approx(0.002)
    assert np.allclose(one['motor_position'], run['theta'], atol=1e-6)
    assert 'given as 212 rpm/V' in servo.read_text() and '# effects:' in servo.read_text()


def test_an_encoder_that_wraps_around_is_put_together_and_what_is_left_out_is_said(
        run, tmp_path, capsys):
    angle = np.degrees(run['theta'])
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'voltage': run['u'], 'current': run['i'],
        'motor_position [deg]': (angle + 180.0) % 360.0 - 180.0, 'speed [rpm]': run['q']})
    assert init(data, tmp_path) == 0
    said = capsys.readouterr().out
    assert 'wraps around at each 360 of them' in said and "left out             'speed" in said
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert np.allclose(one['motor_position'], run['theta'], atol=1e-6)


def test_a_counter_that_wraps_around_is_put_together(run, tmp_path, capsys):
    counts = np.round(run['theta'] / COUNT)
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'voltage': run['u'], 'current': run['i'],
        'counter': (counts + 16384) % 32768 - 16384})
    assert init(data, tmp_path, '--column', 'motor_position=counter:1/4096 rev') == 0
    assert 'wraps around at each 32768 of them' in capsys.readouterr().out
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert np.allclose(one['motor_position'], run['theta'], atol=1e-6)


def test_it_writes_a_step_that_the_springs_of_the_machine_bear(run, tmp_path):
    data = write(tmp_path / 'a.csv', run)
    elastic = ['--mechanism', 'two_inertia', '--damping', '1 N m s/rad', '--si', '--column',
               'motor_position=theta', '--stiffness']
    for stiffness, step in (('2e4 N m/rad', 1e-4), ('1e8 N m/rad', 1e-5)):
        assert init(data, tmp_path, *elastic, stiffness, '--force') == 0
        assert load(tmp_path / 'new' / 's.yaml').step == step


def test_it_asks_whether_a_ratio_below_one_was_meant_the_other_way_round(run, tmp_path, capsys):
    data = write(tmp_path / 'a.csv', run)
    assert init(data, tmp_path, '--ratio', '0.02', '--si', '--column', 'motor_position=theta',
                '--mechanism', 'rigid') == 2
    assert 'turns of the motor for one of the load: is it 50?' in capsys.readouterr().err


@pytest.mark.parametrize('mark', ['_', '/', ', '])
def test_a_unit_may_be_the_last_word_of_a_name(run, tmp_path, mark):
    data = write(tmp_path / 'run.csv', {name.replace(' ', mark): column for name, column in {
        'time ms': 1e3 * run['time'], 'supply V': 24.0 + 0.0 * run['u'], 'command V': run['u'],
        'current mA': 1e3 * run['i'], 'motor_position deg': np.degrees(run['theta'])}.items()},
        ';')
    assert init(data, tmp_path) == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert one.period == pytest.approx(0.002)
    np.testing.assert_allclose(one['current'], run['i'], atol=1e-8)
    np.testing.assert_allclose(one['motor_position'], run['theta'], atol=1e-6)


def test_it_names_time_and_encoder_of_a_table_without_names_at_once(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'theta')},
                 names=False)
    assert init(data, tmp_path) == 2
    said = capsys.readouterr().err
    assert '--column t=SOURCE' in said and '--column motor_position=SOURCE' in said


def test_it_names_all_that_is_missing_in_one_sentence_and_writes_nothing(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'theta')})
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions',
                 '--mechanism', 'rigid']) == 2
    said = capsys.readouterr().err
    for word in ('motor_position=theta', "voltage=u:UNIT'", '--drive', '--rotor-inertia',
                 '--load-inertia', '--ratio'):
        assert word.rstrip("'") in said
    assert said.count('\n') == 1 and not (tmp_path / 's.yaml').exists()


def test_degrees_that_were_called_radians_are_found_out_and_nothing_is_written(
        run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'i')} | {
        'theta': np.degrees(run['theta'])})
    assert init(data, tmp_path, '--column', 'motor_position=theta:rad', '--si') == 1
    assert 'degrees' in capsys.readouterr().out
    assert not (tmp_path / 'new').exists()


def test_it_asks_on_a_terminal_until_the_answer_can_be(run, tmp_path, monkeypatch, capsys):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'i', 'theta')})
    answers = iter(['motor', 'V', 'A', 'furlong', 'rad', 'voltage', '2.1', '2.1 ohm', '212 rpm/V',
                    '45 mN m/A', '320 g cm2', '120 kg cm2', '50'])
    monkeypatch.setattr('builtins.input', lambda _: next(answers))
    monkeypatch.setattr(sys.stdin, 'isatty', lambda: True, raising=False)
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--mapping-out',
                 str(tmp_path / 'm.yaml')]) == 0
    assert "'2.1' has no unit" in capsys.readouterr().out
    assert load(tmp_path / 's.yaml').values['drive.resistance'] == 2.1


def test_it_writes_over_nothing_without_force(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'i', 'theta')})
    more = ['--column', 'motor_position=theta:rad', '--si']
    assert init(data, tmp_path, *more) == 0
    assert init(data, tmp_path, *more) == 2
    assert '--force' in capsys.readouterr().err
    assert init(data, tmp_path, *more, '--force') == 0


def test_it_finds_the_noise_of_an_encoder_and_of_a_current_sensor(run, tmp_path):
    noisy = {**run, 'i': run['i'] + 0.01 * np.random.default_rng(1).standard_normal(2000)}
    data = write(tmp_path / 'run.csv', {'t': run['time'], 'voltage': run['u'],
                                        'current': noisy['i'], 'motor_position': run['theta']})
    one, = read_recordings([data], SERVO)
    found = noise_of(one, load(SERVO))
    assert found['motor_encoder'][0] == pytest.approx(COUNT / np.sqrt(12.0), rel=0.01)
    assert found['current_sensor'][0] == pytest.approx(0.01, rel=0.1)


LINEAR = ['--linear', '--drive', 'voltage', '--resistance', '2.1 ohm', '--back-emf', '212 rpm/V',
          '--torque-constant', '0.045 N m/A', '--rotor-inertia', '0.32 kg cm2', '--load-inertia',
          '12 g', '--no-questions', '--column', 'motor_position=theta:rad', '--column',
          'load_position=q:m', '--mechanism', 'rigid', '--si']


def belt(folder, run, *more):
    data = write(folder / 'run.csv', run)
    return main(['init', str(data), '-o', str(folder / 's.yaml'), '--mapping-out',
                 str(folder / 'm.yaml'), *LINEAR, *more])


@pytest.mark.parametrize('ratio', ['50 rad/m', '125.663706 mm/rev'])
def test_a_motor_that_turns_may_have_a_linear_load(run, tmp_path, ratio):
    assert belt(tmp_path, run, '--ratio', ratio) == 0
    made = load(tmp_path / 's.yaml')
    assert made.linear and made.turning
    assert made.values['mechanism.ratio'] == pytest.approx(50.0, rel=1e-5)
    assert made.values['mechanism.rotor_inertia'] == pytest.approx(3.2e-5)
    text = (tmp_path / 's.yaml').read_text()
    for unit in ('unit: rad/m', 'unit: N m/A', 'unit: kg m2', 'unit: kg,', 'unit: rad,',
                 'unit: m,'):
        assert unit in text


def test_a_ratio_without_unit_is_asked_for_one_and_a_linear_motor_for_none(run, tmp_path, capsys):
    assert belt(tmp_path, run, '--ratio', '50') == 2
    assert "'50' has no unit; say 50 rad/m" in capsys.readouterr().err
    assert belt(tmp_path, run, '--ratio', '1') == 2
    assert "--torque-constant: 'N m/A' is no unit of N/A" in capsys.readouterr().err


def test_the_noise_of_a_current_is_more_than_its_resolution_and_less_than_what_the_command_does(
        run, tmp_path):
    chance = np.random.default_rng(2)
    jerky = run['u'] + 0.4 * chance.standard_normal(2000)  # a controller on a coarse encoder
    current = run['i'] + (jerky - run['u']) / 2.1 + 0.012 * chance.standard_normal(2000)
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'voltage': jerky, 'current': 0.01 * np.round(current / 0.01),
        'motor_position': run['theta']})
    one, = read_recordings([data], SERVO)
    servo = load(SERVO).with_values({'drive.resistance': 2.1, 'drive.gain': 1.0})
    size, unit, said = noise_of(one, servo)['current_sensor']
    assert size == pytest.approx(np.hypot(0.012, 0.01 / np.sqrt(12.0)), rel=0.1)
    assert unit == 'A' and 'encoder' not in said and 'scatter' in said


def test_a_ratio_gets_no_tolerance_but_a_hint_for_belts(run, tmp_path):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'i', 'theta')})
    assert init(data, tmp_path, '--si', '--column', 'motor_position=theta:rad', '--tolerance',
                '5 %') == 0
    text = (tmp_path / 'new' / 's.yaml').read_text()
    assert '  drive.resistance: 5 %' in text
    assert '#   mechanism.ratio: 0.5 %' in text and 'belt' in text
    assert 'mechanism.ratio' not in load(tmp_path / 'new' / 's.yaml').tolerance


def test_it_says_which_mechanism_it_chose_why_and_what_else_there_is(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'i', 'theta')})
    more = ['--si', '--column', 'motor_position=theta:rad']
    chosen = ('rigid, as one encoder does not show what bends '
              '(--mechanism takes two_inertia, ball_screw too)')
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions', *more]) == 2
    assert chosen in capsys.readouterr().err
    assert init(data, tmp_path, *more) == 0
    assert f'mechanism            is {chosen}' in capsys.readouterr().out
    assert f'# {chosen}\nmechanism:\n' in (tmp_path / 'new' / 's.yaml').read_text()
    assert init(data, tmp_path, *more, '--mechanism', 'rigid', '--force') == 0
    assert 'bends' not in capsys.readouterr().out
    assert 'bends' not in (tmp_path / 'new' / 's.yaml').read_text()


def test_a_table_of_a_german_logger_needs_no_column_named_but_the_shaft(tmp_path, run, capsys):
    folder = tmp_path / 'Läufe im Mai'
    folder.mkdir()
    table = {'Zeit [s]': run['time'], 'Lastwinkel [deg]': np.degrees(run['q']),
             'Strom [mA]': 1e3 * run['i'], 'Sollstrom [mA]': 1e3 * run['i']}
    for number in (1, 2):
        write(folder / f'sinus_{number}.csv', table, ';', ',')
    servo = tmp_path / 's.yaml'
    assert main(['init', str(folder / 'sinus_1.csv'), '-o', str(servo), '--drive', 'current',
                 '--gain', '1 A/A', '--torque-constant', '45 mN m/A', '--rotor-inertia',
                 '320 g cm2', '--load-inertia', '120 kg cm2', '--ratio', '50',
                 '--no-questions']) == 0
    assert "Läufe im Mai/*.csv'" in capsys.readouterr().out.splitlines()[-1]
    two = read_recordings([folder / '*.csv'], servo, tmp_path / 's_columns.yaml')
    assert len(two) == 2
    np.testing.assert_allclose(two[0]['voltage'], run['i'], atol=1e-8)
    np.testing.assert_allclose(two[0]['load_position'], run['q'], atol=1e-8)


@pytest.mark.parametrize(('beside', 'named'), [('2,1,0,1\n3,1,0,1\n', '*.txt'),
                                               ('', 'run.txt'), ('Notes of May', 'run.txt')])
def test_it_names_next_all_tables_that_are_like_one_without_names(
        run, tmp_path, capsys, beside, named):
    columns = {name: run[name] for name in ('time', 'u', 'i', 'theta')}
    data = write(tmp_path / 'run.txt', columns, names=False)
    (tmp_path / 'beside.txt').write_text(beside)
    more = [word for k, name in enumerate(('t', 'voltage', 'current', 'motor_position'), 1)
            for word in ('--column', f'{name}=column_{k}')]
    assert init(data, tmp_path, '--si', *more) == 0
    assert f'{tmp_path.name}/{named}' in capsys.readouterr().out.splitlines()[-1]


def test_the_set_point_is_not_the_command_of_an_amplifier_with_another_gain(tmp_path, run, capsys):
    data = write(tmp_path / 'run.csv', {'t': run['time'], 'load_position': run['q'],
                                        'current': run['i'], 'current_reference': run['i']})
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--drive', 'current',
                 '--gain', '0.5 A/V', '--torque-constant', '45 mN m/A', '--rotor-inertia',
                 '320 g cm2', '--load-inertia', '120 kg cm2', '--ratio', '50',
                 '--no-questions']) == 0
    assert 'there is no voltage' in capsys.readouterr().out


def test_a_count_of_the_vendor_is_a_unit_too(run, tmp_path):
    data = write(tmp_path / 'run.csv', {
        'time': run['time'], 'voltage': run['u'], 'motor_position': run['theta'],
        'current': np.round(run['i'] / 0.00269)})
    assert init(data, tmp_path, '--column', 'current=current:2.69 mA') == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert np.allclose(one['current'], run['i'], atol=0.0014)


def test_it_refuses_a_bag_of_this_project_and_says_what_to_do(run, tmp_path):
    columns = {name: np.full(len(run['time']), np.nan) for name in COLUMNS}
    bag = write_recording(tmp_path / 'bag', Recording('bag', 2e-3, {
        **columns, 'load_position': run['q']}))
    with pytest.raises(ValueError, match='a bag of this project already'):
        offered(bag)


def test_a_folder_of_tables_is_answered_by_their_pattern(run, tmp_path):
    write(tmp_path / 'run.csv', run)
    with pytest.raises(ValueError, match=r"it holds tables, which are '.*/\*\.csv'"):
        read_recordings([tmp_path], SERVO)


def test_ctrl_c_while_a_command_is_loaded_is_told_by_the_exit_status_alone(monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr('servo_twin.cli.import_module', interrupted)
    assert main(['check', 'run.csv', '--servo', 'rv_bench']) == 130
    assert capsys.readouterr().err == ''


def test_the_scope_of_a_drive_has_its_reference_at_the_motor(run, tmp_path, capsys):
    counts = np.round(run['theta'] / COUNT)
    data = write(tmp_path / 'scope.csv', {
        'Time (ms)': 1e3 * run['time'], 'Actual Motor Position (counts)': counts,
        'Commanded Position (counts)': counts + 2.0, 'Actual Current (A)': run['i'],
        'Voltage Command (V)': run['u']})
    motor = ['--column', 'motor_position=Actual Motor Position (counts):1/4096 rev', '--column']
    assert init(data, tmp_path, *motor[:2]) == 2
    assert 'or --column reference_position= without it' in capsys.readouterr().err
    given = 'reference_position=Commanded Position (counts):1/{} rev'
    assert init(data, tmp_path, *motor, given.format(4096)) == 2
    assert f'1/4096 rev becomes 1/{4096 * 50} rev' in capsys.readouterr().err
    assert init(data, tmp_path, *motor, given.format(4096 * 50)) == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert np.allclose(one['reference_position'], run['theta'] / 50.0, atol=1e-3)
    capsys.readouterr()
    assert init(data, tmp_path, *motor, 'reference_position=', '--force') == 0
    assert "left out             'Commanded Position (counts)'" in capsys.readouterr().out
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert not one.has('reference_position')


@pytest.mark.parametrize('name', ['actual_q_0', 'q_0'])
def test_a_name_that_ends_with_the_number_of_a_joint_has_no_unit_there(run, tmp_path, name):
    data = write(tmp_path / 'run.csv', {'time': run['time'], 'voltage': run['u'],
                                        'current': run['i'], name: run['theta']})
    assert init(data, tmp_path, '--column', f'motor_position={name}:rad') == 0
