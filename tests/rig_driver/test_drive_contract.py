"""One contract for all protocols: each drive is led, sampled, limited and stopped alike."""

import logging
from threading import Event
from time import monotonic, sleep

import drive_bench
from drive_bench import ASKED, bench, driven, each, Link, NAMES, OVER_TEMPERATURE, turning
from driver_bench import wait_for
from held_up import held_up_since
import numpy as np
import pytest

from servo_rig_driver.can_bus.bus_opening import BusSettings
from servo_rig_driver.can_bus.can_hub import CanHub
from servo_rig_driver.devices.drive_master import DriveState, Order
from servo_rig_driver.devices.on_request import OnRequest
from servo_rig_driver.driver.rig_link import ForeignDriver
from servo_rig_driver.driver.setpoints import Mode

DOWN_WITHIN = 3.0  # s: quick stop 0.5, torque away 0.8, and a busy machine
logging.getLogger('canopen').setLevel(logging.WARNING)


@pytest.fixture(params=each(NAMES))
def name(request):
    return request.param


def went_down(made, link, since):
    """Check that the drive braked, then had no torque, and nothing after that."""
    wait_for(lambda: not made.pushes, 'the motor has no torque')
    assert monotonic() - since < DOWN_WITHIN + held_up_since(since)
    wait_for(lambda: 'off' in made.tap.said, 'the last order is on the bus')
    said = [word for word in made.tap.said if word != 'drive']
    assert said[:2] == ['brake', 'off'], made.tap.said
    assert 'enable' not in said
    assert said[2:] in ([], ['off'])


@pytest.mark.slow
def test_it_follows_and_loses_no_sample_without_a_word(name, tmp_path):
    with driven(name, tmp_path) as (made, link):
        turning(link)
        before = len(link.blocks)
        wait_for(lambda: len(link.blocks) > before + 100, 'a hundred samples')
        numbers = np.array([block.sequence for block in link.blocks])
        assert (np.diff(numbers) > 0).all()
        missing = numbers[-1] - numbers[0] + 1 - len(numbers)
        counted = sum(link.health.counted(f'samples.{why}') for why in ('not_asked', 'unanswered'))
        assert missing <= counted
        assert len({block.stamp - block.sequence * round(link.of['sync_period'] * 1e9)
                    for block in link.blocks}) == 1
        for column in ('motor_position', 'current', 'voltage'):
            assert np.isfinite(link.column(column)[-100:]).all(), column
        wait_for(lambda: np.ptp(link.column('motor_position')[-60:]) < 0.01, 'the motor rests')
        seen = made.rig.bench.state['motor_angle'][0]  # no sample is older than this rest
        assert abs(link.column('motor_position')[-1] - seen) < 0.05 + 0.05 * abs(seen)


@pytest.mark.slow
def test_it_is_taken_down_by_a_quick_stop_and_then_no_torque_and_stays_down(name, tmp_path):
    with driven(name, tmp_path) as (made, link):
        turning(link)
        made.tap.forget()
        since = monotonic()
        assert link.link.stop()
        went_down(made, link, since)
        made.tap.forget()
        sleep(0.4)
        assert made.tap.said in ([], ['off'])
        assert not made.pushes
        link.link.start()
        link.enabled()


def test_a_stop_ends_at_rest_however_long_the_quick_stop_may_take(name, tmp_path):
    with driven(name, tmp_path, quick_stop_time=5.0) as (made, link):
        turning(link)
        since = monotonic()
        assert link.link.stop()
        assert monotonic() - since < DOWN_WITHIN + held_up_since(since)
        assert not made.pushes


@pytest.mark.slow
def test_a_driver_that_dies_leaves_a_drive_that_stops_by_itself(name, tmp_path):
    with driven(name, tmp_path) as (made, link):
        turning(link)
        link.link._port._wire.send = lambda *_: None
        wait_for(lambda: not made.pushes, 'the drive stops by itself')


@pytest.mark.slow
def test_no_set_point_older_than_the_timeout_reaches_the_motor(name, tmp_path):
    with driven(name, tmp_path) as (made, link):
        turning(link)
        wait_for(lambda: not link.player.playing, 'the stream has ended')
        link.says('the motor is at zero')
        made.tap.forget()
        sleep(0.1)
        zero_by_drive = name in ('canopen', 'odrive', 'moteus')  # a command of zero torque
        assert set(made.tap.counts) <= {'drive' if zero_by_drive else None}
        assert link.state is DriveState.OPERATION_ENABLED
        wait_for(lambda: abs(link.column('current')[-1]) < 0.3, 'the motor has no current')


def still(link, seconds=0.2):
    """Check that the motor does not move, and that no sample began with a set-point."""
    begun = len(link.blocks)
    wait_for(lambda: len(link.blocks) > begun + seconds / link.of['sync_period'], 'samples come')
    assert np.ptp(link.column('motor_position')) < 0.02
    assert np.isnan(link.column('reference_velocity')).all()


def one_set_point(link):
    """Queue a set-point; a busy driver may let it pass before it asks for a sample."""
    now = link.link.now()
    link.player.add(now, Mode.VELOCITY, 0.0, [link.of['limit.velocity']], [], now)


def test_a_set_point_that_grew_old_while_the_driver_was_held_up_is_taken_out(name, tmp_path):
    with driven(name, tmp_path) as (made, link):
        ask, held_up = link.device.ask, []

        def slow(number, order, point, now):
            frames = ask(number, order, point, now)
            if point is not None:
                held_up.append(number)
                sleep(1.3 * link.player.timeout)
            return frames
        link.device.ask = slow
        wait_for(lambda: held_up or one_set_point(link), 'it is asked for')
        still(link)
        assert link.state is DriveState.OPERATION_ENABLED
        link.device.ask = ask
        turning(link)


@pytest.mark.slow
def test_a_set_point_that_grew_old_on_the_bus_is_left_out_and_said(name, tmp_path, monkeypatch):
    holding, take = Event(), CanHub._take

    def slow(self, client):
        while holding.is_set():
            sleep(0.005)
        take(self, client)
    monkeypatch.setattr(CanHub, '_take', slow)
    with driven(name, tmp_path, answer_timeout=60.0) as (made, link):  # none is given up

        def grew_old():
            holding.set()
            one_set_point(link)
            sleep(1.5 * link.player.timeout)
            holding.clear()
            return link.health.counted('command.late_on_bus')
        wait_for(grew_old, 'the bus held one up')
        link.says('the bus held a set-point up until it was older than command_timeout')
        still(link)
        assert link.health.counted('samples.unanswered') > 0
        turning(link)


@pytest.mark.parametrize('told', ['canopen', 'odrive'])
def test_what_went_with_a_set_point_that_was_left_out_is_told_again(told, tmp_path):
    link = Link(str(tmp_path / 'none.can'), drive_bench.parameters(told))
    asked = [[identifier for identifier, _ in link.device.ask(k, Order.ENABLE, None, 10 * k)]
             for k in range(2)]
    link.sampler.withdraw(1, 20)
    again = [identifier for identifier, _ in link.device.ask(2, Order.ENABLE, None, 30)]
    mode = {'canopen': 0x201, 'odrive': 0x2B}[told]  # controlword and mode; Set_Controller_Mode
    assert [mode in one for one in (*asked, again)] == [True, False, True]


def test_references_beyond_the_limits_are_held_there(name, tmp_path):
    with driven(name, tmp_path) as (made, link):
        top = link.of['limit.velocity']
        receipt = link.player.add(link.link.now(), Mode.VELOCITY, 0.01, [top * 3.0] * 50, [],
                                  link.link.now())
        assert receipt.clamped == 50

        def played():
            return np.nanmax(link.column('reference_velocity'), initial=0.0)
        wait_for(lambda: played() > 0.0, 'it plays')
        assert played() == pytest.approx(top)


@pytest.mark.parametrize('name', each(OVER_TEMPERATURE))
def test_a_fault_is_named_in_words_reset_and_left_behind(name, tmp_path):
    code, words = OVER_TEMPERATURE[name]
    with driven(name, tmp_path) as (made, link):
        turning(link)
        made.tap.fail(code)
        link.says(f'({words}), reset ')
        link.enabled()
        assert link.master.tries >= 1
        assert link.column('motor_position').size


@pytest.mark.slow
def test_a_drive_that_fails_again_and_again_is_given_up_and_stays_down(name, tmp_path):
    code, _ = OVER_TEMPERATURE[name]  # an ODrive tells of a reset 0.1 s later
    with driven(name, tmp_path, fault_resets=1, fault_reset_pause=0.5) as (made, link):
        def gives_up():
            if link.state is not DriveState.FAULT:
                made.tap.fail(code)
                sleep(0.1)
            return link.master.given_up
        wait_for(gives_up, 'it is given up')
        link.says('given up; deactivate and activate the driver to try again')
        made.tap.forget()
        sleep(0.3)
        assert not made.pushes
        assert 'clear' not in made.tap.said and 'enable' not in made.tap.said
        link.link.stop()
        link.link.start()
        link.enabled()


@pytest.mark.slow
@pytest.mark.parametrize('told', each(['canopen', 'odrive', 'moteus']))  # they tell of it
def test_a_drive_that_missed_frames_more_often_than_it_may_fail_comes_back(told, tmp_path):
    with driven(told, tmp_path, fault_resets=1, fault_reset_pause=0.05) as (made, link):
        port = link.link._port
        send = port.send

        def misses(times):
            port.send = lambda *_: None
            wait_for(lambda: not made.pushes, 'its watchdog ran out')
            port.send = send
            link.says('frames of the driver came too late or not at all')
            link.enabled()
            return link.master.missed >= times
        wait_for(lambda: misses(3), 'three times')
        assert not link.master.given_up


@pytest.mark.slow
def test_a_bus_that_goes_away_is_told_and_opened_again(name, tmp_path):
    with bench(name, tmp_path) as made:
        made.supply_off()
        channel = str(tmp_path / 'lost.can')
        hub = CanHub(channel)
        hub.__enter__()
        made.rig.bus = BusSettings('unix_bus', channel, fd=made.rig.bus.fd)
        made.rig._stopped = False
        made._serving = type(made._serving)(target=made.rig.serve, daemon=True)
        made._serving.start()
        link = Link(channel, made.of)
        try:
            link.up()
            hub.__exit__()
            link.says('the bus is gone')
            wait_for(lambda: not made.pushes, 'the drive stops without its bus')
            hub = CanHub(channel)
            hub.__enter__()
            link.enabled()
        finally:
            link.link.close()
            hub.__exit__()


@pytest.mark.slow
def test_a_drive_that_falls_silent_is_named_and_led_up_again_when_it_is_back(name, tmp_path):
    with driven(name, tmp_path, heartbeat_timeout=0.3) as (made, link):
        nodes = made.rig.nodes
        said, nodes_send = [], made.rig._send
        mute = lambda frames: said.append(frames)  # noqa: E731
        made.rig._send = nodes.send = nodes._send = mute
        if name == 'canopen':
            nodes._objects._network.bus._send = mute
        link.says('is silent: no ')
        made.rig._send = nodes.send = nodes._send = nodes_send
        if name == 'canopen':
            nodes._objects._network.bus._send = nodes_send
        link.enabled()


def test_another_driver_is_left_alone(name, tmp_path):
    with driven(name, tmp_path) as (made, _):
        second = Link(made.channel, made.of | {'listen_time': 10.0})
        with pytest.raises(ForeignDriver, match='another driver is on this bus, it sends'):
            second.link.open()


@pytest.mark.parametrize('asked', each(ASKED))
def test_each_mode_moves_the_motor_its_way(asked, tmp_path):
    with driven(asked, tmp_path) as (_, link):
        assert isinstance(link.device, OnRequest)
        ratio = link.of['device.ratio']

        def at(mode, reference):
            link.play(mode, reference)
            return link.column('motor_position')[-1] / ratio
        wait_for(lambda: abs(at(Mode.POSITION, 0.4) - 0.4) < 0.05, 'it is at 0.4 rad')
        wait_for(lambda: at(Mode.VELOCITY, -1.0) < 0.2, 'it turns back')
        wait_for(lambda: abs(at(Mode.POSITION, 0.0)) < 0.05, 'it is at 0')
        begun = len(link.blocks)  # it may pass between two looks, and leave what its angle tells

        def passed():
            link.play(Mode.CURRENT, 2.0)
            return any(block.columns['motor_position'][-1] / ratio > 0.3
                       for block in list(link.blocks[begun:]))
        wait_for(passed, 'two amperes push it on')
        link.play(Mode.OFF, 0.0)
