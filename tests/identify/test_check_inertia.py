"""The inertia that a recording shows, held against that of the servo file: the check ..."""

from dataclasses import replace
from pathlib import Path

from bench_recording import bench_recording
from checked_bench import BENCH, changed, of_level
import numpy as np
import pytest

from servo_identify.data.recording_check import check
from servo_rig_driver.emulated.make_recording import make_recording
from servo_twin.description.servo_file import load
from servo_twin.recording.recording import COLUMNS, Recording

CONFIG = Path(__file__).resolve().parents[2] / 'config'


@pytest.fixture(scope='module')
def good():
    return bench_recording(4.0)


def test_it_warns_of_an_inertia_that_is_far_from_that_of_the_file(good):
    heavy = BENCH.with_values({'mechanism.load_inertia': 10 * 5.76,
                               'mechanism.rotor_inertia': 1.14e-3})
    servo = replace(heavy, tolerance={})
    assert any('times the inertia' in one.sentence for one in of_level('amber', good, servo))


@pytest.mark.parametrize('rig', ['dc_gearmotor', 'ema_bench', 'rv_bench', 'rv_plain'])
def test_friction_of_a_creeping_motion_is_no_inertia(rig):
    made = make_recording('slow_reversals', CONFIG / 'rigs' / f'{rig}.yaml', duration=5.0,
                          rate=500.0, seed=1)
    one = Recording(rig, 0.002, {name: made[name] for name in COLUMNS if name in made})
    assert not [finding for finding in check([one], load(CONFIG / 'servos' / f'{rig}.yaml'))
                if 'times the inertia' in finding.sentence]


def test_command_and_current_in_milliamperes_are_red_where_the_inertia_alone_speaks():
    servo = load(CONFIG / 'servos' / 'odrive.yaml')
    values = servo.values
    time = np.arange(4000) * 1e-3
    angle = 4.0 * np.sin(9.0 * time) + 2.0 * np.sin(31.0 * time)
    acceleration = -4.0 * 81.0 * np.sin(9.0 * time) - 2.0 * 961.0 * np.sin(31.0 * time)
    current = 1e3 * acceleration / values['drive.torque_constant'] * (
        values['mechanism.rotor_inertia']
        + values['mechanism.load_inertia'] / values['mechanism.ratio']**2)
    nothing = {name: np.full(len(time), np.nan) for name in COLUMNS}
    one = Recording('arm', 1e-3, {**nothing, 'motor_position': angle, 'voltage': current,
                                  'current': current})
    red, = of_level('red', one, servo)
    assert 'times the inertia' in red.sentence and 'thousandths' in red.sentence


def gear_motor(ratio=50.0):
    """Return one encoder, command and current of a voltage drive, with noise; and its servo."""
    servo = load(CONFIG / 'servos' / 'geared_dc.yaml')
    values, period = servo.values, 1e-3
    time = np.arange(4000) * period
    speed = 60.0 * np.sin(3.0 * time) + 30.0 * np.sin(17.0 * time)
    angle = np.cumsum(speed) * period
    inertia = (values['mechanism.rotor_inertia']
               + values['mechanism.load_inertia'] / values['mechanism.ratio']**2)
    current = (inertia * np.gradient(speed, period) + 1e-3 * np.sign(speed)) / values[
        'drive.torque_constant']
    voltage = (values['drive.resistance'] * current + values['drive.back_emf'] * speed) / values[
        'drive.gain']
    nothing = np.full(len(time), np.nan)
    columns = {name: nothing for name in COLUMNS} | {
        'voltage': voltage, 'current': current, 'motor_position': angle}
    return Recording('motor', period, columns), servo


def test_it_sees_an_encoder_on_the_other_shaft_by_the_back_emf():
    one, servo = gear_motor()
    assert servo.drive.name == 'voltage_drive'
    assert not of_level('red', one, servo)
    wrong = changed(one, load_position=one['motor_position'],
                    motor_position=np.full(len(one), np.nan))
    red = of_level('red', wrong, servo)
    assert any('other shaft' in finding.sentence for finding in red), red


def test_a_slow_recording_does_not_outvote_the_one_that_shows_the_inertia(good):
    turned = changed(good, current=-good['current'], voltage=-good['voltage'])
    slow = replace(good, name='slow', columns={**good.columns, **{
        name: good[name][0] + 1e-3 * (good[name] - good[name][0])
        for name in ('motor_position', 'load_position')}})
    assert any(one.level == 'red' for one in check([turned, slow], BENCH))


def test_where_one_recording_shows_the_inertia_as_well_another_is_not_asked_for_it(good):
    heavy = BENCH.with_values({'mechanism.load_inertia': 10 * 5.76,
                               'mechanism.rotor_inertia': 1.14e-3})
    servo = replace(heavy, tolerance={})
    strong = replace(good, name='strong', columns={**good.columns, **{
        name: 10.0 * good[name] for name in ('current', 'voltage', 'torque')}})
    asked = [one for one in check([strong, good], servo) if 'times the inertia' in one.sentence]
    assert asked == [] and of_level('amber', good, servo)
