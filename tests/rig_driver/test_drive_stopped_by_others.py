"""A drive that somebody else stops, on the bus or at its panel, stays without torque."""

from time import sleep

from drive_bench import driven, each, NAMES, STOPS, turning
from driver_bench import wait_for
import numpy as np
import pytest

from servo_rig_driver.devices.moteus_registers import TIMEOUT
from servo_rig_driver.driver.setpoints import Mode


@pytest.mark.slow
def test_an_emergency_stop_keeps_the_drive_down_until_somebody_activates_it(tmp_path):
    with driven('odrive', tmp_path, fault_reset_pause=0.02) as (made, link):
        turning(link)
        made.tap.wire.send([(0x22, b'')])  # Estop, from anybody on the bus
        link.says('(emergency stop requested), not reset; deactivate and activate the driver')
        made.tap.forget()
        sleep(0.5)
        assert not made.pushes
        assert 'clear' not in made.tap.said and 'enable' not in made.tap.said
        assert link.link.stop()
        link.link.start()
        link.enabled()


@pytest.mark.slow
def test_an_emergency_stop_that_another_clears_leaves_the_drive_down(tmp_path):
    with driven('odrive', tmp_path, fault_reset_pause=0.02) as (made, link):
        made.tap.wire.send([(0x22, b'')])
        link.says('(emergency stop requested), not reset; deactivate and activate the driver')
        made.tap.wire.send([(0x38, bytes(1))])  # Clear_Errors
        link.says('another driver is on this bus')
        link.says('the drive is stopped, and stays in switch on disabled, not reset; deactivate')
        made.tap.forget()
        sleep(0.5)
        assert not made.pushes
        assert 'enable' not in made.tap.said
        link.link.start()
        link.enabled()


def stays_down(made, link, why='the drive was told to give no torque, by another than this'):
    """Check that nobody enables a drive that another than the driver has stopped, until asked."""
    link.says(why)
    wait_for(lambda: not made.pushes, 'the motor has no torque')
    made.tap.forget()
    since = link.link.now()

    def later():
        return [block for block in list(link.blocks) if block.stamp > since]
    link.play(Mode.VELOCITY, 0.5)
    wait_for(lambda: len(later()) > 200, 'samples come')
    assert all(np.isnan(block.columns['reference_velocity']).all() for block in later())
    assert not made.pushes
    assert set(made.tap.said) <= {'off'}
    assert link.link.stop()
    link.link.start()
    link.enabled()
    wait_for(lambda: not link.health.has('drive.stopped'), 'it is over')


@pytest.mark.slow
@pytest.mark.parametrize('name', each(NAMES))
def test_a_drive_that_another_master_disables_stays_down_until_somebody_starts_it(name, tmp_path):
    with driven(name, tmp_path) as (made, link):
        turning(link)
        made.tap.wire.send([STOPS[name]])
        stays_down(made, link)


@pytest.mark.slow
@pytest.mark.parametrize('told', each(['canopen', 'odrive', 'robstride']))  # those that tell of it
def test_a_drive_that_is_disabled_at_its_panel_stays_down_until_somebody_starts_it(told, tmp_path):
    with driven(told, tmp_path) as (made, link):
        turning(link)
        nodes = made.rig.nodes
        if told == 'canopen':
            nodes.drive.switch_off()
        elif told == 'odrive':
            nodes.state = 1  # idle
        else:
            nodes.running = False
        stays_down(made, link, 'at its panel or by a cable of its own, and stands'
                   if told == 'canopen' else 'or it started again without saying so, and stands')


@pytest.mark.slow
@pytest.mark.parametrize('name', each(NAMES))
def test_a_drive_that_lost_its_supply_stays_down_until_somebody_starts_it(name, tmp_path):
    with driven(name, tmp_path, enable_after_loss=False, heartbeat_timeout=1.0) as (made, link):
        turning(link)
        made.supply_off()
        link.says('is silent: no ')
        made.supply_on()
        stays_down(made, link, 'its supply, and stands in ')


UNDER_VOLTAGE = {'canopen': 0x3220, 'odrive': 0x200, 'robstride': 0b1, 'cubemars': 2, 'moteus': 40}


@pytest.mark.slow
@pytest.mark.parametrize('name', each(NAMES))
def test_a_drive_that_reports_under_voltage_stays_down_until_somebody_starts_it(name, tmp_path):
    with driven(name, tmp_path, enable_after_loss=False, fault_reset_pause=0.5) as (made, link):
        turning(link)
        made.tap.fail(UNDER_VOLTAGE[name])
        stays_down(made, link, 'under-voltage, as where its supply is cut, and stands in ')


@pytest.mark.slow
def test_a_canopen_drive_that_boots_stays_down_and_an_encoder_that_boots_stops_none(tmp_path):
    with driven('canopen', tmp_path, enable_after_loss=False) as (made, link):
        made.tap.wire.send([(0x702, b'\0')])
        wait_for(lambda: link.health.counted('nodes.load_encoder_boots'), 'the driver heard it')
        link.enabled()
        made.tap.wire.send([(0x701, b'\0')])
        stays_down(made, link, 'has started again, as after a loss of its supply, and stands in')


@pytest.mark.slow
def test_a_moteus_that_brakes_when_its_watchdog_runs_out_is_stopped_before_it_is_reset(tmp_path):
    with driven('moteus', tmp_path) as (made, link):
        nodes = made.rig.nodes
        nodes.timeout_mode = nodes.table.modes['zero_velocity']  # as delivered
        port = link.link._port
        send, port.send = port.send, lambda *_: None
        wait_for(lambda: nodes.mode == TIMEOUT, 'its watchdog ran out')
        assert made.pushes
        port.send = send
        wait_for(lambda: link.master.missed or not made.pushes, 'the driver answers')
        assert not link.master.missed
        link.enabled()


@pytest.mark.parametrize('name', each(['robstride', 'cubemars']))
def test_a_drive_whose_watchdog_ran_out_in_silence_is_led_up_again(name, tmp_path):
    with driven(name, tmp_path) as (made, link):
        port = link.link._port
        send, port.send = port.send, lambda *_: None
        wait_for(lambda: not made.pushes, 'its watchdog ran out')
        port.send = send
        wait_for(lambda: made.pushes, 'it is led up again')
        turning(link)
        assert not link.health.has('drive.stopped')
