"""The recordings of real machines: imported, replayed, and as well answered as is known."""

from pathlib import Path
import subprocess
import sys

import pytest

from servo_twin.bag import read_recording
from servo_twin.balances.goodness_of_fit import fit_of
from servo_twin.commands.replay import servo_of
from servo_twin.lockstep.lockstep import Settings
from servo_twin.lockstep.whole_recording import answer

CONFIG = Path(__file__).resolve().parents[2] / 'config'
XL330 = [f'kp{gain}_{name}' for gain in (100, 400)
         for name in ('lift_and_drop', 'sin_sin', 'sin_time_square', 'up_and_down')]


def imported(table, machine, bag):
    """Import a table as a bag and return the recording."""
    done = subprocess.run(
        [sys.executable, '-m', 'servo_identify.cli', 'import', str(table), '--mapping',
         str(CONFIG / 'imports' / f'{machine}.yaml'), '--servo',
         str(CONFIG / 'servos' / f'{machine}.yaml'), '-o', str(bag)],
        capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return read_recording(bag)


def fits(recording, mode='measured_input'):
    """Return R by channel and the residuals by balance, with the servo file in the bag."""
    servo = servo_of(recording, None)
    fit = fit_of(recording, answer(recording, servo, Settings(mode=mode)), servo)
    return ({row.channel: row.goodness for row in fit.channels},
            {row.balance: row.over_noise for row in fit.balances})


@pytest.fixture(scope='module')
def emps(shared_data, tmp_path_factory):
    return imported(shared_data / 'emps' / 'DATA_EMPS.mat', 'emps',
                    tmp_path_factory.mktemp('emps') / 'bag')


def test_emps_runs_free_as_a_coulomb_viscous_model_can(emps):
    channels, balances = fits(emps)
    assert channels['motor_speed'] > 0.8  # the position drifts by the offset that it lacks
    assert 5.0 < balances['torque_balance'] < 100.0


def test_emps_in_closed_loop_tracks_to_microns_and_needs_almost_the_same_command(emps):
    channels, _ = fits(emps, 'closed_loop')
    assert channels['motor_position'] > 0.9999
    assert channels['motor_speed'] > 0.998


@pytest.mark.slow
@pytest.mark.parametrize('name', XL330)
def test_xl330_is_followed_as_an_observer_and_departs_in_the_torque_balance(
        shared_data, tmp_path, name):
    recording = imported(shared_data / 'xl330' / f'{name}.json', 'xl330', tmp_path / 'bag')
    channels, balances = fits(recording, 'observer')
    assert channels['motor_position'] > 0.97
    assert 1.0 < balances['torque_balance'] < 100.0


def test_xl330_swings_free_under_its_measured_voltage(shared_data, tmp_path):
    recording = imported(shared_data / 'xl330' / 'kp100_sin_time_square.json', 'xl330',
                         tmp_path / 'bag')
    channels, _ = fits(recording)
    assert channels['motor_position'] > 0.7
    assert channels['motor_speed'] > 0.7


def test_a_rigid_twin_of_the_two_mass_bench_lacks_its_resonance(shared_data, tmp_path):
    recording = imported(shared_data / 'two_mass' / 'MultisineTypeA.mat', 'two_mass',
                         tmp_path / 'bag')
    channels, balances = fits(recording)
    assert channels['current'] > 0.8
    assert 0.2 < channels['motor_speed'] < 0.7
    assert max(balances.values()) > 10.0
