"""From a file of data to a servo file and a mapping file: init ..."""

from pathlib import Path
import sys

from init_bench import COUNT, gear_motor, init, write
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.reading import read_recordings
from servo_identify.init.flag_names import TYPES, VALUES
from servo_identify.init.machine import flags, SECTIONS
from servo_identify.init.sensor_noise import noise_of
from servo_identify.init.sources import offered
from servo_twin.bag import write_recording
from servo_twin.description.servo_file import load
from servo_twin.recording.recording import COLUMNS, Recording

SERVO = Path(__file__).resolve().parents[2] / 'config' / 'servos' / 'geared_dc.yaml'


@pytest.fixture(scope='module')
def run():
    return gear_motor()


def test_its_flags_are_those_of_the_declarations():
    assert {section: tuple(types) for section, types in SECTIONS.items()} == TYPES
    assert {name: tuple(dict.fromkeys(kind for _, kind in owners))
            for name, owners in flags().items()} == VALUES


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


def test_it_takes_any_name_of_a_servo(run, tmp_path):
    data, given = write(tmp_path / 'a.csv', run), "arm's 2nd: joint #3 {left}"
    assert init(data, tmp_path, '--name', given, '--si', '--column', 'motor_position=theta',
                '--mechanism', 'rigid') == 0
    assert load(tmp_path / 'new' / 's.yaml').name == given


def test_it_asks_of_which_controller_a_gain_is(run, tmp_path, capsys):
    data = write(tmp_path / 'a.csv', run)
    assert init(data, tmp_path, '--kp', '3 V s/rad', '--si') == 2
    assert '--kp: of which controller? Say --controller, one of vel' in capsys.readouterr().err


def test_it_names_all_that_is_missing_at_once_and_writes_nothing(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'theta')})
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions',
                 '--mechanism', 'rigid']) == 2
    said = capsys.readouterr().err
    for word in ('motor_position=theta', "voltage=u:UNIT'", '--drive', '--rotor-inertia',
                 '--load-inertia', '--ratio'):
        assert word.rstrip("'") in said
    assert not (tmp_path / 's.yaml').exists()
    # the values hang on the drive, and are named for each
    assert "--drive voltage --resistance '2.1 ohm' --back-emf '45 mV s/rad'" in said
    assert "--drive current --gain '0.5 A/V'" in said
    assert 'UNIT is one such as V' in said


def test_the_flags_that_it_names_are_enough_for_the_next_call(run, tmp_path, capsys):
    columns = {'time': run['time'], 'u': run['u'], 'i': run['i'], 'theta_motor': run['theta'],
               'theta_load': run['q']}
    data = write(tmp_path / 'run.csv', columns)
    words = ['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions']
    assert main(words) == 2
    said = capsys.readouterr().err
    given = [('--column', 'motor_position=theta_motor:rad'), ('--column', 'voltage=u:V'),
             ('--column', 'current=i:A'), ('--column', 'load_position=theta_load:rad'),
             ('--drive', 'voltage'), ('--resistance', '2.1 ohm'), ('--back-emf', '212 rpm/V'),
             ('--torque-constant', '45 mN m/A'), ('--mechanism', 'rigid'),
             ('--rotor-inertia', '320 g cm2'), ('--load-inertia', '120 kg cm2'), ('--ratio', '50')]
    for flag, value in given:
        named = f'{value.rpartition(":")[0]}' if flag == '--column' else flag
        assert named in said
    assert main([*words, *(word for pair in given for word in pair)]) == 0


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


def test_two_encoders_alone_take_any_drive_and_lead_to_a_diagnosis(tmp_path, capsys):
    turned = 0.5 * (1.0 - np.cos(0.5 * np.arange(2000) * 0.01))
    data = write(tmp_path / 'axis.csv', {
        'time': np.arange(2000) * 0.01, 'motor_position': 20.0 * turned, 'load_position': turned})
    known = ['--si', '--mechanism', 'rigid', '--rotor-inertia', '1 g cm2', '--load-inertia',
             '1 kg cm2', '--ratio', '20']
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions', *known]) == 2
    assert 'the values of the drive take no part in it' in capsys.readouterr().err
    drive = ['--drive', 'current', '--gain', '1 A/V', '--torque-constant', '1 N m/A']
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions', *known,
                 *drive]) == 0
    assert 'next:    servo-identify diagnose' in capsys.readouterr().out


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


@pytest.mark.parametrize('share', ['10 %', '0.1'])
def test_a_tolerance_is_a_share_or_a_percentage(run, tmp_path, share):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'i', 'theta')})
    assert init(data, tmp_path, '--si', '--column', 'motor_position=theta:rad', '--tolerance',
                share) == 0
    servo = load(tmp_path / 'new' / 's.yaml')
    low, high = servo.tolerance['drive.resistance']
    assert (low, high) == pytest.approx((0.9 * servo.values['drive.resistance'],
                                         1.1 * servo.values['drive.resistance']))


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


def test_it_refuses_a_bag_of_this_project_and_says_what_to_do(run, tmp_path):
    columns = {name: np.full(len(run['time']), np.nan) for name in COLUMNS}
    bag = write_recording(tmp_path / 'bag', Recording('bag', 2e-3, {
        **columns, 'load_position': run['q']}))
    with pytest.raises(ValueError, match='a bag of this project already'):
        offered(bag)


def test_ctrl_c_while_a_command_is_loaded_is_told_by_the_exit_status_alone(monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr('servo_twin.cli.import_module', interrupted)
    assert main(['check', 'run.csv', '--servo', 'rv_bench']) == 130
    assert capsys.readouterr().err == ''


def test_a_folder_beside_that_is_named_like_a_table_is_no_table(run, tmp_path):
    data = write(tmp_path / 'a.csv', {name: run[name] for name in ('time', 'u', 'i', 'theta')})
    (tmp_path / 'old.csv').mkdir()
    assert init(data, tmp_path, '--column', 'motor_position=theta:rad', '--si') == 0
