"""A drive whose supply was away for a moment gives no torque until somebody activates it."""

from math import isfinite

import can
from drive_bench import ASKED, bench, driven, each, linked, NAMES, OVER_TEMPERATURE, turning
from driver_bench import wait_for
from made_device import made as made_device
import pytest
from test_drive_stopped_by_others import stays_down

from servo_rig_driver.devices.drive_master import DriveMaster, DriveState, Order
from servo_rig_driver.devices.mit_mode import MitMode
from servo_rig_driver.devices.mit_table import load_mit_table
from servo_rig_driver.devices.moteus import Moteus
from servo_rig_driver.devices.moteus_registers import identifier, MoteusTable, padded
from servo_rig_driver.driver.limits import Mode, Setpoint
from servo_rig_driver.emulated.drives.mit_mode import EmulatedMit

SECOND = 10**9
SAFE = {'enable_after_loss': False}


@pytest.mark.parametrize(('name', 'why'), each([
    ('odrive', 'own, or it started again without saying so, and stands'),
    ('robstride', 'own, or it started again without saying so, and stands'),
    ('cubemars', 'gives no torque though it is asked for some, as after a loss of its supply'),
    ('moteus', 'has started again, as after a loss of its supply, and stands')]))
def test_a_drive_that_starts_again_between_two_requests_stays_down(name, why, tmp_path):
    with driven(name, tmp_path, **SAFE) as (made, link):
        turning(link)
        made.blink()
        wait_for(lambda: link.play(Mode.VELOCITY, 1.0) or link.master.held, 'it is held')
        stays_down(made, link, why)


@pytest.mark.slow
@pytest.mark.parametrize('name', each(ASKED))
def test_a_drive_that_starts_again_within_the_heartbeat_timeout_stays_down(name, tmp_path):
    with driven(name, tmp_path, **SAFE) as (made, link):
        turning(link)
        made.supply_off()
        wait_for(lambda: link.device.doubted(link.link.now()), 'it has been silent for a while')
        made.supply_on()
        stays_down(made, link, 'did not answer for a while, so that it may have lost its supply')


@pytest.mark.slow
@pytest.mark.parametrize('name', each(NAMES))
def test_a_drive_stays_down_after_its_bus_was_gone_however_short_that_was(name, tmp_path):
    with driven(name, tmp_path, **SAFE) as (made, link):
        turning(link)
        port, fails = link.link._port, []

        def fail(*_):
            fails.append(1)
            port.send = send
            raise can.CanError('unplugged')
        send, port.send = port.send, fail
        wait_for(lambda: fails, 'it is unplugged')
        stays_down(made, link, 'out of reach while the bus was gone, so that it may have lost')


@pytest.mark.parametrize('name', each(ASKED))
def test_a_drive_that_starts_again_while_it_is_in_fault_stays_down(name, tmp_path):
    with driven(name, tmp_path, fault_reset_pause=5.0, **SAFE) as (made, link):
        turning(link)
        made.tap.fail(OVER_TEMPERATURE[name][0])
        wait_for(lambda: link.state is DriveState.FAULT, 'it is in fault')
        made.blink()
        stays_down(made, link, 'as where its supply was cut' if name != 'moteus'
                   else 'as after a loss of its supply')


@pytest.mark.slow
def test_a_drive_that_starts_again_is_told_its_watchdog_before_it_moves(tmp_path, monkeypatch):
    unwatched, command = [], EmulatedMit.command

    def noted(self):
        given = command(self)
        if not isfinite(self.watchdog) and any(given[1:]):
            unwatched.append(given)
        return given
    monkeypatch.setattr(EmulatedMit, 'command', noted)
    with driven('robstride', tmp_path) as (made, link):
        turning(link)
        made.supply_off()
        wait_for(lambda: link.device.doubted(link.link.now()), 'it has been silent for a while')
        made.supply_on()
        link.enabled()
        turning(link)
        assert made.rig.nodes.watchdog == made.of['device.watchdog'] and not unwatched


@pytest.mark.parametrize('name', each(['robstride', 'cubemars']))
def test_a_drive_is_led_up_again_where_the_driver_itself_was_held_up(name, tmp_path):
    with driven(name, tmp_path, **SAFE) as (made, link):
        turning(link)
        ask = link.device.ask

        def held_up(*told):
            link.device.ask = ask
            wait_for(lambda: not made.pushes, 'its watchdog ran out')
            return ask(*told)
        link.device.ask = held_up
        wait_for(lambda: link.device.ask == ask, 'the driver was held up')
        turning(link)
        assert made.pushes and not link.master.held


def mute_heartbeats(nodes):
    """Have an axis answer all requests, and beat no more."""
    nodes.beat = lambda now: None


@pytest.mark.slow
def test_an_axis_that_answers_without_a_heartbeat_is_held_since_its_state_is_not_known(tmp_path):
    with driven('odrive', tmp_path, **SAFE) as (made, link):
        turning(link)
        made.rig.between_frames(lambda: mute_heartbeats(made.rig.nodes))
        link.says('answers, but tells its state no more: no heartbeat')
        wait_for(lambda: not made.pushes, 'the motor has no torque')
        assert link.state is DriveState.UNKNOWN
        del made.rig.nodes.beat
        stays_down(made, link, 'tells its state no more')


@pytest.mark.slow
def test_an_axis_that_never_beats_is_left_off_and_told(tmp_path):
    with bench('odrive', tmp_path) as made:
        mute_heartbeats(made.rig.nodes)
        with linked(made) as link:
            link.link.open()
            link.link.start()
            link.says('the drive stays in unknown (tells its state no more: no heartbeat')
            assert not made.pushes and 'enable' not in made.tap.said


@pytest.mark.slow
def test_a_canopen_drive_that_waits_to_be_started_stays_down_though_nobody_heard_it_boot(tmp_path):
    with driven('canopen', tmp_path, **SAFE) as (made, link):
        made.rig.between_frames(lambda: made.rig._send([(0x701, b'\x7f')]))
        stays_down(made, link, 'has started again, as after a loss of its supply, and stands in')


@pytest.mark.parametrize('failing', [DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE])
def test_a_fault_that_goes_before_it_was_reset_keeps_the_drive_down(failing):
    master = DriveMaster(pause=1.0)
    master.begin()
    master.enable = True
    assert master.step(DriveState.OPERATION_ENABLED, 0.0) is Order.ENABLE
    assert master.step(failing, 0.1) is Order.NO_TORQUE
    assert master.step(DriveState.SWITCH_ON_DISABLED, 0.2) is Order.NO_TORQUE
    assert master.held and 'left its fault without a reset' in master.why_held


@pytest.mark.parametrize(('speed', 'torque', 'state'), [
    (0.0, 0.0, DriveState.UNKNOWN), (20.0, 0.0, DriveState.OPERATION_ENABLED),
    (0.0, 1.0, DriveState.OPERATION_ENABLED)])
def test_a_cubemars_is_limp_where_it_stands_without_the_torque_it_is_asked_for(speed, torque,
                                                                               state):
    drive = made_device(MitMode, load_mit_table('cubemars_ak80_9'))
    told = {'drive': 1, 'host': 0, 'position': 0.0, 'velocity': speed, 'torque': torque,
            'temperature': 30.0, 'fault': 0}
    drive._state = DriveState.OPERATION_ENABLED
    for now in range(SECOND, 2 * SECOND, SECOND // 200):
        drive.ask(now, Order.ENABLE, Setpoint(now, Mode.VELOCITY, 30.0, None), now)
        drive.take(*drive.table.frames['feedback'].pack(told), now + 1)
        if drive.state is not DriveState.OPERATION_ENABLED:
            break
    assert drive.state is state
    assert bool(drive.loss(now)) == (state is DriveState.UNKNOWN)


def moteus_after(uptimes):
    """Return a moteus that told these seconds since its start, one after the other."""
    drive = made_device(Moteus, MoteusTable('moteus'))
    for uptime in uptimes:
        told = dict.fromkeys((one.name for one in drive.table.reads), 0.0)
        drive.hear(identifier(1, 0), padded(drive.table.reply(told | {'uptime': uptime})))
    return drive


@pytest.mark.parametrize(('uptimes', 'boots'), [
    ((5.0, 5.001, 5.001, 35.0), 0), ((5.0, 4.999), 1), ((2_000_000.0, 0.5), 1),
    ((1_500_000.0, 0.5), 1), ((2_147_483.646, -2_147_483.647), 0), ((2_147_483.646, 0.002), 0)])
def test_a_moteus_whose_counter_goes_back_has_started_again(uptimes, boots):
    watch = moteus_after(uptimes).watch
    assert watch.health.counted('nodes.drive_boots') == boots
    assert bool(watch.lost) == bool(boots)
