"""Frames of the vendors' documents, with their arithmetic: what goes out, and what is read."""

from math import isnan, pi, tau
import struct

from hypothesis import given
from hypothesis import strategies as st
from made_device import made
import pytest

from servo_rig_driver.can_bus.unix_frames import EXTENDED, REMOTE
from servo_rig_driver.devices.drive_master import DriveState, MAY_PUSH, Order
from servo_rig_driver.devices.mit_mode import MitMode
from servo_rig_driver.devices.mit_table import load_mit_table
from servo_rig_driver.devices.odrive import load_odrive, Odrive
from servo_rig_driver.devices.pdo_table import FrameError
from servo_rig_driver.driver.setpoints import Mode, Setpoint


def point(mode, reference):
    return Setpoint(0, mode, reference, None)


# ODrive CAN Simple.

@pytest.fixture
def axis():
    return made(Odrive, load_odrive('odrive_cansimple'))


def beat(axis, state, errors=0):
    axis.hear(0x21, struct.pack('<IBBBB', errors, state, 0, 0, 0))


def test_odrive_frames_out_are_those_of_its_documentation(axis):
    beat(axis, 8)
    # "axis id 0x01, command 0x0C: 0x01 << 5 | 0x0C = 0x2C"; revolutions of the motor
    frames = axis.frames(Order.ENABLE, point(Mode.POSITION, tau / 10.0 * 1.5), 0)
    assert frames[1] == (0x2B, struct.pack('<II', 3, 1))  # position control, passthrough
    assert frames[0] == frames[2] == (0x2C, struct.pack('<fhh', 1.5, 0, 0))
    # -2.5 = -1.25 * 2: 0xC0200000
    frames = axis.frames(Order.ENABLE, point(Mode.VELOCITY, -2.5 * tau / 10.0), 0)
    told = 0x2D, bytes.fromhex('000020c0 00000000')
    assert frames[:3] == [told, (0x2B, struct.pack('<II', 2, 1)), told]
    # 2.5 A * 0.1 N m/A = 0.25 N m = 2^-2: 0x3E800000
    frames = axis.frames(Order.ENABLE, point(Mode.CURRENT, 2.5), 0)
    assert frames[0] == frames[2] == (0x2E, bytes.fromhex('0000803e 00000000'))
    assert frames[3:5] == [(0x29 | REMOTE, b''), (0x34 | REMOTE, b'')]


def test_odrive_is_enabled_and_taken_down_by_axis_states_asked_for_once(axis):
    beat(axis, 1)
    frames = axis.frames(Order.ENABLE, None, 0)
    assert (0x27, struct.pack('<II', 8, 0)) in frames  # closed loop control
    assert (0x2E, bytes(8)) in frames  # not before its input is zero torque
    assert 0x27 not in [one for one, _ in axis.frames(Order.ENABLE, None, 100_000_000)]
    assert 0x27 in [one for one, _ in axis.frames(Order.ENABLE, None, 300_000_000)]
    beat(axis, 8)
    assert axis.frames(Order.NO_TORQUE, None, 0)[0] == (0x27, struct.pack('<II', 1, 0))  # idle
    assert axis.off() == [(0x27, struct.pack('<II', 1, 0))]


def test_odrive_answers_are_read_as_its_example_program_does(axis):
    assert axis.hear(0x29, struct.pack('<ff', 0.25, -1.5)) == 0
    assert axis.hear(0x34, struct.pack('<ff', 2.0, 1.75)) == 1
    assert axis.reading.motor_position == pytest.approx(0.25 * tau)
    assert axis.reading.load_speed == pytest.approx(-1.5 * tau / 10.0)
    assert (axis.reading.current_reference, axis.reading.current) == (2.0, 1.75)
    beat(axis, 1, 0x01000000 | 0x200)
    assert axis.state is DriveState.FAULT
    assert axis.fault == 'DC bus under-voltage, watchdog timer expired'
    assert axis.hear(0x49, bytes(8)) is None  # of node 2
    with pytest.raises(FrameError, match='0x009 .Get_Encoder_Estimates. has 4 bytes, expected 8'):
        axis.hear(0x29, bytes(4))


def test_a_heartbeat_that_comes_twice_is_one_of_the_two_that_settle_a_state(axis):
    def take(at):
        axis.take(0x21, struct.pack('<IBBBB', 0, 1, 0, 0, 0), at)

    take(0)
    axis.off()
    for at, settled in ((50_000_000, False), (50_100_000, False), (150_000_000, True)):
        take(at)
        assert axis.settled is settled


def test_odrive_tells_another_driver_from_the_button_of_an_emergency_stop(axis):
    assert axis.foreign(0x2D, bytes(8)) == 'Set_Input_Vel (0x02D)'
    assert axis.foreign(0x29 | REMOTE, b'') == 'Get_Encoder_Estimates (0x029)'
    assert axis.foreign(0x22, b'') == ''


# MIT mode.

def test_robstride_identifiers_are_those_of_its_manual():
    drive = made(MitMode, load_mit_table('robstride_rs02'), host=0xFD)
    # its example: 90 07 e8 0c, shifted by three bits, is 0x1200FD01: type 18, host FD, motor 1;
    # the index of a parameter goes low byte first, as 0x7005 does there: 05 70
    (name, data), = drive.frames(Order.ENABLE, None, 0)
    assert name == EXTENDED | 0x9007E80C >> 3 == EXTENDED | 0x1200FD01
    # canTimeout 0x7028; "20000 is 1s": 0.1 s is 2000 = 0x07D0
    assert data == bytes.fromhex('2870 0000 d0070000')
    drive.obeyed('watchdog')
    drive._state = DriveState.SWITCH_ON_DISABLED
    assert drive.frames(Order.ENABLE, None, 0) == [(EXTENDED | 0x0300FD01, bytes(8))]
    assert drive.off() == [(EXTENDED | 0x0400FD01, bytes(8))]
    assert drive.frames(Order.RESET, None, 0) == [(EXTENDED | 0x0400FD01, b'\x01' + bytes(7))]


@pytest.mark.parametrize('table, torque, speed, expected', [
    # (0 + 44) 65535 / 88 = 32767.5; (1 + 44) 65535 / 88 = 33512.2 = 0x82E8
    ('robstride_rs02', 17.0, 0x82E8, 0x7FFF),
    # (1 + 30) 65535 / 60 = 33859.75 = 0x8443
    ('cybergear', 12.0, 0x8443, 0x7FFF),
])
def test_a_velocity_is_a_speed_with_a_gain(table, torque, speed, expected):
    drive = made(MitMode, load_mit_table(table))
    drive._state = DriveState.OPERATION_ENABLED
    drive.obeyed('watchdog')
    (name, data), = drive.frames(Order.ENABLE, point(Mode.VELOCITY, 1.0), 0)
    # torque 0: 65535 / 2 = 32767.5, truncated; kd 3 of 5: 39321 = 0x9999
    assert name == EXTENDED | 0x01000001 | expected << 8
    assert struct.unpack('>HHHH', data) == (0x7FFF, speed, 0, 0x9999)
    (name, data), = drive.frames(Order.ENABLE, point(Mode.CURRENT, torque / 2), 0)
    # half the range above 0: 3/4 of 65535 = 49151.25 = 0xBFFF; 1 N m/A at the load
    assert name == EXTENDED | 0x01BFFF01
    assert data[4:] == bytes(4)
    drive.turns.whole(0.0)  # it has told that it did not go round
    drive.turns.angle(0.0)
    (_, data), = drive.frames(Order.ENABLE, point(Mode.POSITION, pi), 0)
    # (pi + 4 pi) 65535 / 8 pi = 40959.4 = 0x9FFF; kp 60 of 500: 7864.2 = 0x1EB8
    assert struct.unpack('>HHHH', data)[0::2] == (0x9FFF, 0x1EB8)


def test_robstride_feedback_is_read_with_its_mode_and_its_faults():
    drive = made(MitMode, load_mit_table('robstride_rs02'), host=0xFD)
    # type 2, mode 2 (run) in bits 23..22, no fault, motor 1 in bits 15..8, host FD
    run = EXTENDED | 2 << 24 | 2 << 22 | 1 << 8 | 0xFD
    # 0xBFFF: 49151 * 8 pi / 65535 - 4 pi = 6.283; 0x4000: 16384 * 88 / 65535 - 44 = -22.0;
    # 0xFFFF: 17 N m; 271 tenths of a degree
    data = struct.pack('>HHHH', 0xBFFF, 0x4000, 0xFFFF, 271)
    assert drive.hear(run, data) == 0
    assert drive.state is DriveState.OPERATION_ENABLED
    assert drive.reading.motor_position == pytest.approx(10.0 * 6.283, abs=0.005)
    assert drive.reading.load_speed == pytest.approx(-22.0, abs=1e-3)
    assert drive.reading.current == pytest.approx(17.0)
    assert drive.reading.temperature == pytest.approx(27.1)
    assert drive.hear(run | 0b000101 << 16, data) == 0
    assert drive.state in MAY_PUSH  # it says that it runs
    assert drive.fault == 'under-voltage, over-temperature'
    assert drive.frames(Order.NO_TORQUE, None, 0) == drive.off()
    assert drive.hear(run ^ 2 << 22 | 0b000101 << 16, data) == 0  # mode 0, reset
    assert drive.state is DriveState.FAULT
    assert drive.frames(Order.NO_TORQUE, None, 0) == drive.query()
    assert drive.hear(run ^ 3 << 8, data) is None  # of motor 2
    assert drive.foreign(EXTENDED | 0x0300AA01, bytes(8)) == 'enable (0x300AA01)'


def test_a_position_that_begins_anew_at_its_end_is_counted_on():
    drive = made(MitMode, load_mit_table('cybergear'), host=0xFD)
    run = EXTENDED | 2 << 24 | 2 << 22 | 1 << 8 | 0xFD
    told = []
    for raw in (0xF000, 0xFFFF, 0x0FFF, 0xFF00):
        drive.hear(run, struct.pack('>HHHH', raw, 0x7FFF, 0x7FFF, 250))
        told.append(drive.reading.motor_position / 10.0)
    step = 8.0 * pi / 65535
    assert told[1] - told[0] == pytest.approx(0xFFF * step)
    assert told[2] - told[1] == pytest.approx(0xFFF * step)
    assert told[3] == pytest.approx(told[1] - 0xFF * step)


def test_cubemars_frames_are_packed_as_in_its_manual():
    drive = made(MitMode, load_mit_table('cubemars_ak80_9'), kp=100.0, kd=1.0)
    assert drive.off() == [(1, b'\xff' * 7 + b'\xfd')]
    drive._state = DriveState.SWITCH_ON_DISABLED
    assert drive.frames(Order.ENABLE, None, 0) == [(1, b'\xff' * 7 + b'\xfc')]
    drive._state = DriveState.OPERATION_ENABLED
    drive.turns.angle(0.0)  # its shaft stands within the range
    # position (6 + 12.5) 65535 / 25 = 48495.9 = 0xBD6F, speed 0: 4095 / 2 = 2047 = 0x7FF,
    # kp 100 of 500: 819 = 0x333, kd 1 of 5: 819 = 0x333, torque 0: 2047 = 0x7FF
    assert drive.frames(Order.ENABLE, point(Mode.POSITION, 6.0), 0) == [
        (1, bytes.fromhex('bd6f 7f f3 33 33 37 ff'))]
    # 9 N m: (9 + 18) 4095 / 36 = 3071.25 = 0xBFF
    (_, data), = drive.frames(Order.ENABLE, point(Mode.CURRENT, 9.0), 0)
    assert data == bytes.fromhex('7fff 7f f0 00 00 0b ff')
    # drive 1, position 0, speed 0x8F5: 2293 * 100 / 4095 - 50 = 5.99, torque 0xBFF: 9.0 N m,
    # 41 degC, no error
    assert drive.hear(0, bytes.fromhex('01 7fff 8f 5b ff 29 00')) == 0
    assert drive.state is DriveState.OPERATION_ENABLED
    assert drive.reading.load_speed == pytest.approx(5.99, abs=0.01)
    assert drive.reading.current == pytest.approx(9.0, abs=0.01)
    assert drive.reading.temperature == pytest.approx(41.0)
    drive.hear(0, bytes.fromhex('01 ffff 7f f7 ff 29 00'))
    assert isnan(drive.reading.motor_position)  # held at the end of the range: no measurement
    drive.hear(0, bytes.fromhex('01 7fff 7f f7 ff 29 06'))
    assert drive.fault == 'over-temperature of the motor'




def test_a_cubemars_has_stopped_once_the_stop_is_answered_and_no_frame_before_it():
    drive = made(MitMode, load_mit_table('cubemars_ak80_9'))
    drive._state = DriveState.OPERATION_ENABLED
    drive.ask(1, Order.ENABLE, None, 0)
    (_, stop), = drive.ask(2, Order.NO_TORQUE, None, 0)
    assert stop == b'\xff' * 7 + b'\xfd'
    for number, state in ((1, DriveState.OPERATION_ENABLED), (2, DriveState.SWITCH_ON_DISABLED)):
        assert drive.hear(0, bytes.fromhex('01 7fff 7f f7 ff 29 00')) == 0
        drive.answered(number)
        assert drive.state is state


@given(st.sampled_from(['robstride_rs02', 'cybergear', 'cubemars_ak80_9']), st.data())
def test_numbers_come_back_within_a_count_and_are_held_at_the_ends(name, data):
    table = load_mit_table(name)
    frame = table.frames['control']
    given_ = {key: data.draw(st.floats(-100.0, 1000.0)) for key in (
        'position', 'velocity', 'kp', 'kd', 'torque')}
    told = frame.unpack(*frame.pack(given_ | {'drive': 5}))
    assert told['drive'] == 5
    for field in (*frame.identifier.fields, *frame.data.fields):
        if field.range is not None:
            count = (field.range.high - field.range.low) / ((1 << field.bits) - 1)
            held = min(max(given_[field.name], field.range.low), field.range.high)
            assert -1e-6 * count <= held - told[field.name] <= count * (1 + 1e-6)
