"""A drive whose supply was away for a moment gives no torque until somebody activates it."""

from math import isfinite

import can
from drive_bench import ASKED, driven, NAMES, OVER_TEMPERATURE, turning
from driver_bench import wait_for
from made_device import made as made_device
import pytest
from test_drive_stopped_by_others import stays_down

from servo_rig_driver.devices.drive_master import DriveMaster, DriveState, Order
from servo_rig_driver.devices.moteus import Moteus
from servo_rig_driver.devices.moteus_registers import identifier, MoteusTable, padded
from servo_rig_driver.driver.setpoints import Mode
from servo_rig_driver.emulated.drives.mit_mode import EmulatedMit

SAFE = {'enable_after_loss': False}


@pytest.mark.parametrize(('name', 'why'), [
    ('odrive', 'was told to give no torque, by another than this driver, and stands'),
    ('robstride', 'was told to give no torque, by another than this driver, and stands'),
    ('cubemars', 'gives no torque though it is asked for some, as after a loss of its supply'),
    ('moteus', 'has started again, as after a loss of its supply, and stands')])
def test_a_drive_that_starts_again_between_two_requests_stays_down(name, why, tmp_path):
    with driven(name, tmp_path, **SAFE) as (made, link):
        turning(link)
        made.blink()
        wait_for(lambda: link.play(Mode.VELOCITY, 1.0) or link.master.held, 'it is held')
        stays_down(made, link, why)


@pytest.mark.parametrize('name', ASKED)
def test_a_drive_that_starts_again_within_the_heartbeat_timeout_stays_down(name, tmp_path):
    with driven(name, tmp_path, **SAFE) as (made, link):
        turning(link)
        made.supply_off()
        wait_for(lambda: link.device.doubted(link.link.now()), 'it has been silent for a while')
        made.supply_on()
        stays_down(made, link, 'did not answer for a while, so that it may have lost its supply')


@pytest.mark.parametrize('name', NAMES)
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


@pytest.mark.parametrize('name', ASKED)
def test_a_drive_that_starts_again_while_it_is_in_fault_stays_down(name, tmp_path):
    with driven(name, tmp_path, fault_reset_pause=5.0, **SAFE) as (made, link):
        turning(link)
        made.tap.fail(OVER_TEMPERATURE[name][0])
        wait_for(lambda: link.state is DriveState.FAULT, 'it is in fault')
        made.blink()
        stays_down(made, link, 'as where its supply was cut' if name != 'moteus'
                   else 'as after a loss of its supply')


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


@pytest.mark.parametrize('name', ['robstride', 'cubemars'])
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
