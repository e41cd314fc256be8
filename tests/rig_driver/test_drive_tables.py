"""Tables and driver files of drives: what cannot be is named before a drive moves."""


from drive_bench import CONFIG
import pytest
import yaml

from servo_rig_driver.devices.device import DeviceError
from servo_rig_driver.devices.drive_settings import DriveSettings
from servo_rig_driver.devices.mit_table import load_mit_table
from servo_rig_driver.devices.moteus_registers import (
    MoteusTable,
)
from servo_rig_driver.devices.odrive import load_odrive
from servo_rig_driver.devices.protocols import PROTOCOLS
from servo_rig_driver.devices.tables import SHIPPED
from servo_rig_driver.driver.driver_parameters import contradiction, DECLARED
from servo_rig_driver.driver.rig_health import RigHealth
from servo_rig_driver.emulated.drives.by_protocol import driver_parameters


@pytest.mark.parametrize('load, name', [
    (load_mit_table, 'robstride'), (load_odrive, ''), (MoteusTable, 'nothing')])
def test_a_table_that_is_missing_is_named_with_the_choice(load, name):
    with pytest.raises(DeviceError, match=f"device.table = '{name}' is neither a file nor one of"):
        load(name)


@pytest.mark.parametrize('change, words', [
    (lambda c: c['frames'].pop('stop'), "has no frame .'stop'."),
    (lambda c: c['frames']['stop'].update(identifier=['drive 9']), 'its identifier has 9 bits'),
    (lambda c: c['frames']['stop'].update(data=['all the bits']), "must read 'name bits'"),
    (lambda c: c['frames']['stop'].update(data=['odd 5']), 'its data has 5 bits'),
    (lambda c: c.pop('ranges'), 'is no table of an actuator in MIT mode'),
    (lambda c: c['ranges'].pop('torque'), 'ranges are given of .*; they are needed of'),
    (lambda c: c['ranges'].update(torque=[0, 18]), 'of torque has no 0 within'),
    (lambda c: c['ranges'].update(kp=[-5, 500]), 'range of kp begins at -5'),
    (lambda c: c['frames']['control'].update(data=['position 16', 'kp 16', 'kd 16', 'torque 16']),
     "frame 'control' lacks .'velocity'."),
    (lambda c: c['frames']['feedback'].update(data=['position 16', 'position 16', 'torque 16']),
     'are there twice'),
    (lambda c: c['frames']['stop'].update(identifier=['all 11 = 1']), "'stop' lacks .'drive'."),
    (lambda c: c['faults'].update(by='bits'), "faults: by = 'bits'; it is one of"),
    (lambda c: c.update(position_wraps='no'), "position_wraps = 'no'; it is one of"),
    (lambda c: c.update(range={}), "has no entry .'range'."),
    (lambda c: c['frames'].update(watchdog={'identifier': ['drive 11'], 'data': ['time 32']}),
     'watchdog_rate = 0 counts a second'),
])
def test_a_table_that_is_none_is_named(change, words, tmp_path):
    content = yaml.safe_load((SHIPPED / 'cubemars_ak80_9.yaml').read_text())
    change(content)
    path = tmp_path / 'own.yaml'
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(DeviceError, match=words):
        load_mit_table(str(path))


@pytest.mark.parametrize('file', sorted(CONFIG.glob('drivers/*.yaml')), ids=lambda file: file.stem)
def test_every_driver_file_names_parameters_that_there_are_and_a_device_that_can_be_made(file):
    of = {one.name: one.default for one in DECLARED}
    given_ = driver_parameters(file)
    assert set(given_) <= set(of)
    assert not contradiction(of | given_)
    device, _ = PROTOCOLS[given_.get('protocol', 'canopen')](of | given_, RigHealth())
    assert device.modes()


@pytest.mark.parametrize('name, given_, words', [
    ('odrive', {'device.id': 64}, 'device.id = 64; an ODrive axis has one up to 63'),
    ('moteus', {'device.host': 128}, 'device.host = 128; a moteus answers hosts up to 127'),
    ('robstride', {'device.kd': 6.0}, r'device.kd = 6 is beyond what .* carries, \[0, 5\]'),
    ('cubemars', {'device.brake': 6.0}, 'device.brake = 6 is beyond')])
def test_what_the_frames_of_a_drive_do_not_carry_is_refused_before_it_moves(name, given_, words):
    of = {one.name: one.default for one in DECLARED}
    of |= driver_parameters(CONFIG / 'drivers' / f'{name}.yaml')
    with pytest.raises(DeviceError, match=words):
        PROTOCOLS[of['protocol']](of | given_, RigHealth())


def test_what_a_data_sheet_has_to_say_has_no_default():
    with pytest.raises(DeviceError, match='device.ratio = 0; it must be given, above 0'):
        DriveSettings(1, 0, 0.0, 0.1, 0.1)


@pytest.mark.parametrize(('given', 'said'), [
    ({'sync_period': 0.05}, 'device.watchdog = 0.1 s is less than 3 times sync_period = 0.05 s'),
    ({'sync_period': 0.05, 'device.watchdog': 0.15}, ''),
    ({'sync_period': 0.05, 'protocol': 'canopen'}, ''),
    ({'joint_names': ['hip', 'hip']}, 'it holds two names that differ'),
    ({'joint_names': ['hip', '']}, 'it holds two names that differ')])
def test_parameters_that_cannot_hold_together_are_refused(given, said):
    of = {one.name: one.default for one in DECLARED} | {'protocol': 'moteus'}
    assert not contradiction(of)
    told = contradiction(of | given)
    assert said in told and bool(said) == bool(told)
