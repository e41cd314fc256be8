"""Beyond the range of an MIT drive's angle, no position makes the shaft leap: the driver ..."""

from math import floor, isnan, pi
import struct
from time import sleep

from drive_bench import bench, CONFIG, driven, each, Link
from driver_bench import DriverProcess, Listener, wait_for
from made_device import made as made_device
import pytest
from test_drive_ends import QUICK
import yaml

from servo_rig_driver.devices.device import DeviceError
from servo_rig_driver.devices.drive_master import DriveState, Order
from servo_rig_driver.devices.mit_mode import MitMode
from servo_rig_driver.devices.mit_table import load_mit_table
from servo_rig_driver.devices.tables import SHIPPED
from servo_rig_driver.driver.limits import Mode, Setpoint
from servo_rig_driver.emulated.drives.mit_mode import EmulatedMit

EXTENDED, SPAN = 1 << 31, 8.0 * pi
COUNT = SPAN / 65535
RUN = EXTENDED | 2 << 24 | 2 << 22 | 1 << 8 | 0xFD
SECOND = 10**9
FAST = {'limit.velocity': 20.0}


def shaft(made):
    return float(made.rig.bench.state['load_angle'][0])


def goes_round(monkeypatch):
    """Have the drives compare a position with the angle of its range, as firmwares may."""
    command = EmulatedMit.command

    def within(self):
        given, ends = command(self), self.table.ranges['position']
        if len(given) == 1 or not self.table.wraps:
            return given
        span = ends.high - ends.low
        return given[0], given[1] + span * floor((self.load_angle - ends.low) / span), *given[2:]
    monkeypatch.setattr(EmulatedMit, 'command', within)


def turn_to(made, link, angle):
    """Turn the shaft to about an angle, and let it stand there."""
    sign = 1.0 if angle > shaft(made) else -1.0

    def there():
        link.play(Mode.VELOCITY, 12.0 * sign)
        return (shaft(made) - angle) * sign > 0.0
    wait_for(there, f'the shaft turns to {angle:g} rad')

    def stands():
        link.play(Mode.VELOCITY, 0.0)
        return abs(made.rig.bench.state['load_speed'][0]) < 0.05
    wait_for(stands, 'the shaft stands')


def told(link):
    return link.column('motor_position')[-1] / link.of['device.ratio']


@pytest.mark.slow
@pytest.mark.parametrize(('name', 'law'), each([
    ('robstride', 'counts on'), ('robstride', 'goes round'), ('cybergear', 'counts on'),
    ('cubemars', 'counts on')]))
def test_a_driver_that_starts_beside_a_shaft_beyond_the_range_lets_no_position_turn_it(
        name, law, tmp_path, monkeypatch):
    if law == 'goes round':
        goes_round(monkeypatch)
    with driven(name, tmp_path, **FAST) as (made, first):
        turn_to(made, first, 20.0)
        first.link.close()
        link = Link(made.channel, first.of)
        try:
            link.up()
            before = shaft(made)
            if name == 'cubemars':
                assert isnan(told(link))
            else:
                wait_for(lambda: abs(told(link) - before) < 0.1, 'samples go on there')
            for reference in (before - SPAN, 12.0):
                for _ in range(20):
                    link.play(Mode.POSITION, reference)
                    sleep(0.01)
            link.says("rad cannot be held; joint 'load' stands at")
            assert shaft(made) == pytest.approx(before, abs=0.3)
            turn_to(made, link, 5.0)

            def held():
                link.play(Mode.POSITION, 4.0)
                return abs(shaft(made) - 4.0) < 0.05 and abs(told(link) - 4.0) < 0.1
            wait_for(held, 'it follows a position')
        finally:
            link.link.close()


def test_a_shaft_that_leaves_the_range_while_a_position_is_held_is_let_go(tmp_path):
    with driven('robstride', tmp_path, **FAST) as (made, link):
        turn_to(made, link, 11.0)
        wait_for(lambda: link.play(Mode.POSITION, 12.0) or shaft(made) > 11.9, 'it is held')

        def push():
            made.rig.bench.state['load_speed'][0] = 60.0
            made.rig.bench.state['motor_speed'][0] = 60.0 * link.of['device.ratio']

        def leaves():
            link.play(Mode.POSITION, 12.0)
            made.rig.between_frames(push)
            return any("12 rad cannot be held; joint 'load' stands at" in one.text
                       for one in link.health.troubles)
        wait_for(leaves, 'it is let go')
        wait_for(lambda: made.rig.nodes._five['kp'] == 0.0, 'it has no gain')


@pytest.mark.long
@pytest.mark.ros
def test_a_driver_that_is_started_again_refuses_a_position_in_a_sentence(tmp_path):
    file = CONFIG / 'drivers' / 'robstride.yaml'
    with bench('robstride', tmp_path) as made:
        for run in range(2):
            ears = Listener('robstride')
            driver = DriverProcess('robstride', file, bus__channel=made.channel, **QUICK)

            def turns(speed, ears=ears):
                ears.command(3, [speed] * 20, ears.now(), 0.01)
            try:
                ears.all_well()
                wait_for(lambda ears=ears: ears.encoder, 'samples are heard')
                if not run:
                    wait_for(lambda: turns(12.0) or shaft(made) > 18.0, 'it turns beyond')
                    wait_for(lambda: turns(0.0) or abs(
                        made.rig.bench.state['load_speed'][0]) < 0.05, 'it stands')
                    continue
                before = shaft(made)
                wait_for(lambda ears=ears, at=before: abs(
                    ears.encoder[-1].motor_position[-1] / 7.75 - at) < 0.1, 'samples go on there')
                for _ in range(20):
                    ears.command(4, [before - SPAN] * 20, ears.now(), 0.01)
                    sleep(0.02)
                ears.has_heard(f'command refused: position {before - SPAN:.4g} rad; joint')
                ears.has_heard('Turn it back into the range by a velocity or a current')
                assert shaft(made) == pytest.approx(before, abs=0.3)
                wait_for(lambda: turns(-12.0) or shaft(made) < 5.0, 'a velocity is taken')
                wait_for(lambda ears=ears: ears.command(4, [3.0] * 20, ears.now(), 0.01)
                         or abs(shaft(made) - 3.0) < 0.05, 'so is a position')
            finally:
                driver.close()
                ears.close()


def counting(table='robstride_rs02'):
    """Return a drive that follows, and what it is told of an angle at an instant."""
    drive = made_device(MitMode, load_mit_table(table), host=0xFD)
    drive.turns.begin(True)
    answers = f'1100{1:02x}fd'

    def at(now, angle, counted=None):
        drive.obeyed('watchdog')
        sent = drive.ask(now, Order.ENABLE, Setpoint(now, Mode.POSITION, 1.0, None), now)
        if counted is not None:
            drive.take(EXTENDED | int(answers, 16),
                       bytes.fromhex('1970 0000') + struct.pack('<f', counted), now)
        raw = round(((angle + SPAN / 2) % SPAN) / COUNT)
        drive.take(RUN, struct.pack('>HHHH', raw, 0x7FFF, 0x7FFF, 250), now)
        return sent
    return drive, at


def pushes(sent):
    """Whether the frames hold a position with a gain."""
    return any(name >> 24 & 0x1F == 1 and struct.unpack('>HHHH', data)[2] for name, data in sent)


def test_the_question_for_its_turns_is_that_of_the_manual():
    drive = made_device(MitMode, load_mit_table('robstride_rs02'), host=0xFD)
    drive.turns.begin(True)
    # type 17, host FD, motor 1; index 0x7019, mechPos, low byte first
    assert drive.query()[0] == (EXTENDED | 0x1100FD01, bytes.fromhex('1970 0000 00000000'))
    assert drive.foreign(EXTENDED | 0x1100AA01, bytes(8)) == ''
    # status 0, motor 1, host FD; a status above 0 answers for no parameter
    for status, known in ((1, False), (0, True)):
        drive.take(EXTENDED | 0x110001FD | status << 16,
                   bytes.fromhex('1970 0000') + struct.pack('<f', 20.0), 1)
        raw = round((20.0 - SPAN / 2) / COUNT)
        drive.hear(RUN, struct.pack('>HHHH', raw, 0x7FFF, 0x7FFF, 250))
        assert drive.turns.known is known
    assert drive.reading.motor_position == pytest.approx(200.0, abs=0.01)


def test_turns_that_may_have_passed_unseen_are_asked_for_before_a_position_goes_out():
    drive, at = counting()
    at(SECOND, 3.0, 3.0)
    at(SECOND + 1, 3.0, 3.0)
    assert drive.state is DriveState.OPERATION_ENABLED and pushes(at(SECOND + 2, 3.0))
    at(SECOND + 10**8, 3.5)  # within 0.29 s no shaft turns by half the range
    assert pushes(at(SECOND + 10**8 + 1, 3.5))
    at(2 * SECOND, 4.0 + SPAN)
    sent = at(2 * SECOND + 1, 4.0 + SPAN, 4.0 + SPAN)
    assert sent[0][0] == EXTENDED | 0x1100FD01 and not pushes(sent)
    assert drive.reading.motor_position == pytest.approx(10.0 * (4.0 + SPAN), abs=0.01)
    assert not pushes(at(2 * SECOND + 2, 4.0 + SPAN)) and '29.13 rad, beyond' in drive.no_position


def test_a_drive_that_was_enabled_again_is_asked_for_its_turns():
    drive, at = counting()
    at(SECOND, 4.0 + SPAN, 4.0 + SPAN)
    at(SECOND + 1, 4.0 + SPAN, 4.0 + SPAN)
    assert drive.no_position
    drive.take(RUN ^ 2 << 22, struct.pack('>HHHH', 0x9000, 0x7FFF, 0x7FFF, 250), SECOND + 2)
    at(SECOND + 3, 4.0)  # it started again within a turn, as drives do
    at(SECOND + 4, 4.0, 4.0)
    assert not drive.no_position and pushes(at(SECOND + 5, 4.0))


def without_turns(tmp_path):
    """Return the path of a table as there were before drives were asked for their turns."""
    content = yaml.safe_load((SHIPPED / 'robstride_rs02.yaml').read_text())
    del content['frames']['turns'], content['frames']['turns_told']
    path = tmp_path / 'own.yaml'
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.mark.parametrize('asks', [False, True])
def test_a_drive_that_does_not_tell_its_turns_is_given_no_position(asks, tmp_path, monkeypatch):
    table = 'robstride_rs02' if asks else str(without_turns(tmp_path))
    if asks:
        hear = EmulatedMit.hear
        monkeypatch.setattr(EmulatedMit, 'hear', lambda self, name, data, now: (
            name >> 24 & 0x1F != 17 and hear(self, name, data, now)))
    with driven('robstride', tmp_path, **{'device.table': table}) as (made, link):
        for _ in range(20):
            link.play(Mode.POSITION, 3.0)
            sleep(0.01)
        link.says('the drive has not told how often it went round')
        assert shaft(made) == pytest.approx(0.0, abs=0.1)
        turn_to(made, link, 3.0)


@pytest.mark.parametrize(('change', 'words'), [
    (lambda frames: frames.pop('turns'), "frame 'turns_told' stands alone"),
    (lambda frames: frames['turns_told'].update(data=['angle 16']), 'is a float of 32 bits'),
    (lambda frames: frames['turns_told'].update(data=['angle 32 = 1']), 'is a float of 32 bits'),
    (lambda frames: frames['turns_told'].update(data=['all 32']), "lacks .'angle'.")])
def test_a_table_whose_turns_cannot_be_read_is_named(change, words, tmp_path):
    content = yaml.safe_load((SHIPPED / 'robstride_rs02.yaml').read_text())
    change(content['frames'])
    path = tmp_path / 'own.yaml'
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(DeviceError, match=words):
        load_mit_table(str(path))
