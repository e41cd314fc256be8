"""A drive that was told to give no torque is taken to have none once it has said so."""

from drive_bench import driven, each, meaning, NAMES, turning
from driver_bench import wait_for
import pytest

from servo_rig_driver.devices.drive_master import Order

SAFE = {'enable_after_loss': False}
SAID = 'has not said since that it gives none'


def deaf(made):
    """Have the emulated drive hear nothing more, with what torque it has, and return a cure."""
    nodes = made.rig.nodes
    take, tick, nodes.take, nodes.tick = (
        nodes.take, nodes.tick, lambda *_: None, lambda *_: None)

    def cure():
        nodes.take, nodes.tick = take, tick
    return cure


@pytest.mark.slow
@pytest.mark.parametrize('name', each(NAMES))
def test_a_drive_that_hears_nothing_is_told_of_a_stop_until_it_says_that_it_is_down(
        name, tmp_path):
    with driven(name, tmp_path, **SAFE) as (made, link):
        turning(link)
        cure = deaf(made)
        assert not link.link.stop()
        assert made.pushes
        link.says(SAID)
        cure()
        wait_for(lambda: not made.pushes, 'it has no torque')
        wait_for(lambda: link.link.state == 'idle', 'the link rests')
        assert link.link.stop()
        assert not any(SAID in trouble.text for trouble in link.health.troubles)


@pytest.mark.slow
@pytest.mark.parametrize('name', each(['odrive', 'moteus', 'canopen']))
def test_a_drive_that_is_lost_while_it_follows_is_told_of_a_stop_when_it_answers_again(
        name, tmp_path):
    with driven(name, tmp_path, heartbeat_timeout=0.3, **SAFE) as (made, link):
        turning(link)
        cure = deaf(made)
        wait_for(lambda: link.link.state == 'waiting for the rig', 'it is lost')
        assert not link.link.stop()
        assert made.pushes
        cure()
        wait_for(lambda: not made.pushes, 'it has no torque')
        wait_for(lambda: link.link.state == 'idle', 'the link rests')


@pytest.mark.slow
def test_a_link_that_ends_before_the_drive_said_that_it_is_down_says_so(tmp_path):
    with driven('moteus', tmp_path, **SAFE) as (made, link):
        turning(link)
        deaf(made)
        assert not link.link.close()
    with driven('moteus', tmp_path, **SAFE) as (made, link):
        assert link.link.close()


@pytest.mark.slow
def test_an_axis_whose_heartbeat_does_not_know_of_its_torque_yet_is_not_taken_to_have_none(
        tmp_path):
    with driven('odrive', tmp_path, **SAFE) as (made, link):
        pushed, ask = [], link.device.ask

        def noted(number, order, point, now):
            if order is Order.ENABLE and made.pushes:
                pushed.append(number)
            return ask(number, order, point, now)
        link.device.ask = noted
        for _ in range(5):
            assert link.link.stop()
            assert not made.pushes
            pushed.clear()
            link.link.start()
            wait_for(lambda: pushed, 'it has torque')


def swallowing(made, count):
    """Have the drive not hear so many stop frames; the first is answered by an old answer."""
    nodes = made.rig.nodes
    take, send = nodes.take, nodes.send
    kept, heard = [], []

    def sent(frames):
        kept[:] = [frames]
        send(frames)

    def taken(identifier, data, now):
        if meaning(made.name, identifier, data) != 'off' or len(heard) >= count:
            take(identifier, data, now)
            return
        heard.append(now)
        if len(heard) == 1:
            send(kept[0])
    nodes.send, nodes.take = sent, taken


@pytest.mark.slow
@pytest.mark.parametrize('name', each(['robstride', 'cubemars', 'moteus']))
def test_an_answer_that_comes_twice_is_not_taken_for_that_to_a_stop_that_was_lost(name, tmp_path):
    with driven(name, tmp_path, **SAFE) as (made, link):
        turning(link)
        swallowing(made, 3)
        assert link.link.stop()
        assert not made.pushes
