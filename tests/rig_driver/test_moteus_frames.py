"""Frames of the documents of moteus, with their arithmetic: what goes out, and what is read."""

from math import isnan, nan

from hypothesis import given
from hypothesis import strategies as st
from made_device import made
import pytest
import yaml

from servo_rig_driver.can_bus.unix_frames import EXTENDED, FD
from servo_rig_driver.devices.drive_master import DriveState, MAY_PUSH, Order
from servo_rig_driver.devices.moteus import Moteus
from servo_rig_driver.devices.moteus_registers import (
    identifier,
    MoteusTable,
    padded,
    read_varuint,
    varuint,
)
from servo_rig_driver.devices.pdo_table import FrameError
from servo_rig_driver.devices.tables import SHIPPED
from servo_rig_driver.driver.limits import Mode, Setpoint


def doc_table(folder, **types):
    """Return the shipped registers under other types, as the documents' examples have them."""
    content = yaml.safe_load((SHIPPED / 'moteus.yaml').read_text())
    for name, kind in types.items():
        content['registers'][name][2] = kind
    path = folder / 'moteus.yaml'
    path.write_text(yaml.safe_dump(content))
    return MoteusTable(str(path))


def test_moteus_writes_the_frame_of_its_documentation(tmp_path):
    table = doc_table(tmp_path, command_position='int16', command_velocity='int16',
                      feedforward_torque='int16', mode='int8')
    # 01 00 0a: mode 10; 07 20: three int16 from 0x020: 96 * 0.0001 rev, 288 * 0.00025 rev/s,
    # -176 * 0.01 N m
    written = table.write({'mode': 10, 'command_position': 0.0096, 'command_velocity': 0.072,
                           'feedforward_torque': -1.76})
    assert written.hex() == '01000a07206000200150ff'
    assert written.hex() + '140400' + '130d' == '01000a07206000200150ff140400130d'


def test_moteus_asks_as_the_vendors_library_does(tmp_path):
    table = doc_table(tmp_path, position='float', velocity='float', torque='float')
    reads = [table.registers[name] for name in ('mode', 'position', 'velocity', 'torque',
                                                'voltage', 'temperature', 'fault')]
    assert table.read(reads).hex() == '11001f01130d'  # moteus_protocol_test.cc, QueryMake


def test_moteus_replies_are_read_as_in_its_documentation():
    table = MoteusTable('moteus')
    told, asked = table.parse(bytes.fromhex('2404000a005000000170ff230d181400'))
    assert asked == []
    # 80 * 0.0001 rev, 256 * 0.00025 rev/s, -144 * 0.01 N m, 24 * 0.5 V
    assert told == pytest.approx({'mode': 10, 'position': 0.008, 'velocity': 0.064,
                                  'torque': -1.44, 'voltage': 12.0, 'temperature': 20.0,
                                  'fault': 0})
    # moteus_protocol_test.cc, QueryMinimal
    told, _ = table.parse(bytes.fromhex('2404000a00100200fe2000230d203040'))
    assert told == pytest.approx({'mode': 10, 'position': 0.0528, 'velocity': -0.128,
                                  'torque': 0.32, 'voltage': 16.0, 'temperature': 48.0,
                                  'fault': 64})
    assert table.parse(bytes([0x21, 0x03, 0x96]))[0] == {'torque': -106 * 0.5}  # multiplex_test.py
    assert isnan(table.parse(bytes([0x25, 0x01, 0x00, 0x80]))[0]['position'])
    assert [one.number for one in table.parse(bytes([0x17, 0x01]))[1]] == [1, 2, 3]
    assert table.parse(b'\x50\x50') == ({}, [])


@pytest.mark.parametrize('data, words', [
    ('2404000a00', 'a frame of 5 bytes ends within register 0x001'),
    ('24', 'a frame of 1 bytes ends within a number'),
    ('31 81 03 07', 'refuses register 0x181, error 7'),
    ('70', 'subframe 0x70 is unknown'),
])
def test_moteus_frames_that_are_none_are_named(data, words):
    with pytest.raises(FrameError, match=words):
        MoteusTable('moteus').parse(bytes.fromhex(data))


def test_moteus_identifiers_and_padding_are_those_of_its_documentation():
    assert identifier(0, 1, reply=True) == 0x8001 | FD | EXTENDED
    assert identifier(1, 0) == 0x100 | FD
    assert padded(bytes(9)) == bytes(9) + b'\x50' * 3  # CAN FD has 12 bytes, not 9
    assert varuint(0x181) == b'\x81\x03'
    assert read_varuint(b'\x81\x03', 0) == (0x181, 2)


def test_moteus_brakes_by_zero_velocity_and_lets_go_by_stopped():
    drive = made(Moteus, MoteusTable('moteus'))
    drive._state = DriveState.OPERATION_ENABLED
    (name, data), = drive.frames(Order.QUICK_STOP, None, 0)
    assert name == 0x8001 | FD | EXTENDED
    # mode 12, and 0x027: int16, 0.1 s = 100 counts of a millisecond
    assert data.startswith(bytes.fromhex('01000c 0527 6400'))
    (_, data), = drive.frames(Order.NO_TORQUE, None, 0)
    assert data.startswith(bytes.fromhex('010000'))
    # no torque: feed-forward 0 with both gains scaled to 0, position "not given"
    (_, data), = drive.frames(Order.ENABLE, None, 0)
    told, asked = drive.table.parse(data)
    assert told['mode'] == 10 and isnan(told['command_position'])
    assert [told[key] for key in ('feedforward_torque', 'kp_scale', 'kd_scale')] == [0, 0, 0]
    assert [one.name for one in asked] == [one.name for one in drive.table.reads]


def test_a_moteus_whose_watchdog_ran_out_is_stopped_before_it_is_reset():
    drive = made(Moteus, MoteusTable('moteus'))

    def tells(mode):
        told = {one.name: 0.0 for one in drive.table.reads} | {'mode': mode}
        drive.hear(identifier(1, 0), drive.table.reply(told))
        return drive.state

    def says(order):
        (_, data), = drive.frames(order, None, 0)
        return drive.table.parse(data)[0].get('mode')
    assert tells(11) in MAY_PUSH  # what its motor does then is a setting of the drive
    assert says(Order.NO_TORQUE) == 0
    assert tells(0) is DriveState.FAULT and drive.missed
    assert says(Order.NO_TORQUE) == 0
    assert says(Order.RESET) == 0
    assert tells(0) is DriveState.SWITCH_ON_DISABLED and not drive.missed
    assert tells(1) is DriveState.FAULT and not drive.missed
    assert says(Order.NO_TORQUE) is None  # a stop would clear the fault


@given(st.binary(max_size=64))
def test_any_bytes_are_registers_or_refused(data):
    try:
        values, asked = MoteusTable('moteus').parse(data)
    except FrameError:
        return
    assert len(values) + len(asked) <= 3 * 16384


@pytest.mark.parametrize('what', ['mode', 'fault'])
def test_a_moteus_that_does_not_tell_its_mode_is_left_out_with_a_word(what):
    drive = made(Moteus, MoteusTable('moteus'))
    told = {one.name: 0.0 for one in drive.table.reads} | {what: nan}
    with pytest.raises(FrameError, match=f'the drive tells .*{what} nan'):
        drive.hear(identifier(1, 0), drive.table.reply(told))


@pytest.mark.parametrize('side', [1.0, -1.0])
def test_a_velocity_closes_no_position_loop_where_the_register_of_the_position_ends(side):
    drive = made(Moteus, MoteusTable('moteus'))
    told = dict.fromkeys((one.name for one in drive.table.reads), 0.0) | {'mode': 10}

    def gains(turns):
        """Return position, kp and kd scale that go out once a position was told."""
        drive.take(identifier(1, 0), padded(drive.table.reply(told | {'position': turns})), 1)
        (_, data), = drive.frames(Order.ENABLE, Setpoint(0, Mode.VELOCITY, side, None), 0)
        written, _ = drive.table.parse(data)
        return [written[name] for name in ('command_position', 'kp_scale', 'kd_scale')]

    # int32 of 0.00001 rev: 2147483647 counts are 21474.83647 rev, and a shaft beyond tells those
    position, *scales = gains(side * 30_000.0)
    assert isnan(position) and scales == pytest.approx([0.0, 1.0])
    assert isnan(drive.reading.motor_position)
    assert 'does not tell where it stands, as from 134930 rad on' in drive.no_position
    assert gains(side * 21_474.0) == pytest.approx([side * 21_474.0, 1.0, 1.0])
    assert not drive.no_position
    position, *scales = gains(side * 30_000.0)  # the loop that is closed goes on by itself
    assert isnan(position) and scales == pytest.approx([1.0, 1.0])
