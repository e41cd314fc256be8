"""Torques that stand for a current or a command: init ..."""

from init_bench import gear_motor, write
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.commands import init as command
from servo_identify.data.reading import read_recordings
from servo_twin.description.servo_file import load

MACHINE = ['--rotor-inertia', '320 g cm2', '--load-inertia', '120 kg cm2', '--ratio', '50']


def joint(folder, **columns):
    """Write the log of a joint: time and angle of the motor, and more."""
    run = gear_motor()
    return write(folder / 'run.csv', {'t': run['time'], 'motor_position': run['theta'], **columns})


def init(data, *more):
    return main(['init', str(data), '-o', str(data.parent / 's.yaml'), *MACHINE, '--force',
                 '--no-questions', *more])


def read(data):
    servo = data.parent / 's.yaml'
    one, = read_recordings([data], servo, data.parent / 's_columns.yaml')
    return one, load(servo).values


@pytest.mark.parametrize('name', ['tau_est', 'effort', 'tau', 'Actual Torque'])
def test_it_asks_of_a_torque_without_a_sensor_whether_the_drive_computed_it(
        tmp_path, capsys, name):
    data = joint(tmp_path, **{name: 0.045 * gear_motor()['i']})
    assert init(data) == 2
    said = capsys.readouterr().err
    assert f"--column 'current={name}:N m' of the motor" in said
    assert f"'torque={name}:N m' where a sensor measured it" in said
    assert init(data, '--column', f'current={name}:N m') == 0
    said = capsys.readouterr().out
    assert 'torque_constant is 1 N m/A, as' in said and 'gain           is 1 A/A' in said
    one, values = read(data)
    np.testing.assert_allclose(one['current'], 0.045 * gear_motor()['i'], atol=1e-9)
    assert values['drive.torque_constant'] == values['drive.gain'] == 1.0
    assert "source: '1 N m/A, as" in (tmp_path / 's.yaml').read_text()


def test_a_torque_of_the_joint_comes_to_the_motor_and_is_divided_by_a_known_constant(tmp_path):
    data = joint(tmp_path, tau_est=50.0 * 45.0 * gear_motor()['i'])
    assert init(data, '--column', 'current=tau_est:1/50 mN m', '--torque-constant',
                '45 mN m/A') == 0
    one, values = read(data)
    np.testing.assert_allclose(one['current'], gear_motor()['i'], atol=1e-7)
    assert values['drive.torque_constant'] == pytest.approx(0.045)


def test_a_torque_that_was_told_is_the_command_beside_a_measured_current(tmp_path, capsys):
    data = joint(tmp_path, iq=gear_motor()['i'], tau_des=0.045 * gear_motor()['i'])
    given = ['--column', 'current=iq:A', '--torque-constant', '45 mN m/A']
    assert init(data, *given) == 2
    assert "--column 'voltage=tau_des:N m' of the motor" in capsys.readouterr().err
    assert init(data, *given, '--column', 'voltage=tau_des:N m') == 0
    one, values = read(data)
    np.testing.assert_allclose(one['voltage'], gear_motor()['i'], atol=1e-7)
    assert values['drive.gain'] == 1.0


def test_a_measured_current_leaves_the_torque_constant_to_be_given(tmp_path, capsys):
    data = joint(tmp_path, iq=gear_motor()['i'], tau_des=gear_motor()['i'])
    assert init(data, '--column', 'current=iq:A', '--column', 'voltage=tau_des:N m') == 2
    assert "--torque-constant '45 mN m/A'" in capsys.readouterr().err


def test_it_says_of_a_computed_torque_beside_a_current_that_it_is_left_out(tmp_path, capsys):
    data = joint(tmp_path, current=gear_motor()['i'], voltage=gear_motor()['i'],
                 tau_est=0.045 * gear_motor()['i'])
    assert init(data, '--drive', 'current', '--gain', '1 A/A', '--torque-constant',
                '45 mN m/A') == 0
    assert "note                 'tau_est' tells nothing beside the current" in (
        capsys.readouterr().out)


def test_it_names_the_set_point_where_it_may_be_the_command(tmp_path, capsys):
    data = joint(tmp_path, **{'I_meas [A]': gear_motor()['i'], 'I_cmd [A]': gear_motor()['i']})
    assert init(data, '--drive', 'current', '--gain', '0.5 A/A', '--torque-constant',
                '45 mN m/A') == 0
    assert "--column 'voltage=I_cmd [A]:A' where it is what the drive received" in (
        capsys.readouterr().out)


@pytest.mark.parametrize(('answer', 'factor'), [('motor', 1.0), ('joint', 1.0 / 50.0)])
def test_on_a_terminal_it_asks_for_the_shaft_of_a_computed_torque(
        tmp_path, monkeypatch, answer, factor):
    data = joint(tmp_path, effort=0.045 / factor * gear_motor()['i'])

    def answered(question, default):
        if "'effort' measured by a torque sensor" not in question:
            return default
        assert default == ''  # nothing stands to reason
        return answer

    monkeypatch.setattr('sys.stdin.isatty', lambda: True)
    monkeypatch.setattr(command, '_ask', answered)
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), *MACHINE]) == 0
    one, _ = read(data)
    np.testing.assert_allclose(one['current'], 0.045 * gear_motor()['i'], atol=1e-7)


def test_it_names_all_torques_that_may_be_the_command_or_the_current(tmp_path, capsys):
    made = gear_motor()['i']
    data = joint(tmp_path, **{'effort_controller.commands[0]': made,
                              'effort_controller.commands[1]': made, 'effort_a': made,
                              'effort_b': made})
    assert init(data) == 2
    said = capsys.readouterr().err
    assert "of the joint, or of ['effort_controller.commands[1]'], (the command)" in said
    assert "of the joint, or of ['effort_b'], where the drive computes it" in said
