"""A drive that was left with torque, by a driver that was killed, is found and has none then."""

from contextlib import contextmanager

from drive_bench import ASKED, bench, driven, each, Link, linked, NAMES, turning
from driver_bench import wait_for
import pytest

LISTENS = 0.3  # s
SAID = 'the drive had torque though no driver leads it'


@contextmanager
def left_on(name, folder, watchdog=0.1):
    """Give a drive without a watchdog that turns after its driver has died, and a second link."""
    with bench(name, folder) as made:
        made.rig.nodes._watchdog, made.rig.nodes.starved = 1e9, lambda: None
        dead = Link(made.channel, made.of)
        dead.up()
        turning(dead)
        dead.link._port._wire.send = lambda *_: None
        dead.link.close()
        assert made.pushes
        made.tap.forget()
        with linked(made, **{'listen_time': LISTENS, 'device.watchdog': watchdog}) as second:
            yield made, second


@pytest.mark.slow
@pytest.mark.parametrize('name', each(NAMES))
def test_a_driver_that_is_configured_takes_the_torque_of_a_killed_one_away(name, tmp_path):
    with left_on(name, tmp_path) as (made, second):
        second.link.open()
        wait_for(lambda: not made.pushes, 'the motor has no torque')
        made.tap.catch_up()
        assert made.tap.said == ['off']
        if name not in ('canopen', 'cubemars'):  # these tell no state before they are started
            assert any(SAID in one.text and 'its own watchdog is not set' in one.text
                       for one in second.health.troubles)
        second.link.start()
        second.enabled()
        turning(second)


def test_a_watchdog_that_is_longer_than_the_silence_is_not_called_missing(tmp_path):
    with left_on('robstride', tmp_path, watchdog=1.0) as (made, second):
        second.link.open()
        wait_for(lambda: not made.pushes, 'the motor has no torque')
        second.says(SAID)
        assert not second.health.has('drive.watchdog')


@pytest.mark.parametrize('name', each(ASKED))
def test_a_drive_without_torque_is_found_without_a_word_and_keeps_its_fault(name, tmp_path):
    with bench(name, tmp_path) as made:
        with linked(made) as link:
            link.link.open()
            assert not link.health.troubles
        made.tap.fail({'odrive': 0x2000, 'robstride': 4, 'cubemars': 6, 'moteus': 38}[name])
        made.tap.forget()
        with linked(made, listen_time=LISTENS) as link:
            link.link.open()
            assert made.tap.said == []  # a stop frame might clear it


@pytest.mark.slow
@pytest.mark.parametrize('name', each(NAMES))
def test_a_driver_that_rests_takes_the_torque_away_as_it_leaves(name, tmp_path):
    with driven(name, tmp_path) as (made, link):
        assert link.link.stop()
        made.tap.forget()
        link.link.close()
        made.tap.catch_up()
        assert made.tap.said == ['off']


@pytest.mark.slow
def test_a_driver_that_leaves_while_another_one_leads_says_nothing(tmp_path):
    with driven('robstride', tmp_path) as (made, leads):
        idle = Link(made.channel, made.of)
        idle.link._states.listen = lambda: None
        idle.link._left_on.begin = lambda listened: None
        idle.link.open()
        wait_for(lambda: idle.health.counted('bus.foreign_frames') > 10, 'it hears the other one')
        made.tap.forget()
        assert idle.link.close()
        turning(leads)
        assert 'off' not in made.tap.said


@pytest.mark.slow
def test_an_axis_that_enables_itself_beside_a_driver_that_rests_is_told(tmp_path):
    with driven('odrive', tmp_path) as (made, link):
        assert link.link.stop()
        link.link.look()
        assert not link.health.troubles
        made.rig.nodes.starved = lambda: None  # it stays enabled, as one without a watchdog

        def told():  # the last frame of the driver may have come after the axis enabled itself
            made.rig.between_frames(lambda: setattr(made.rig.nodes, 'state', 8))
            link.link.look()
            return link.health.has('drive.left_on')
        wait_for(told, 'it is told')
        link.link.start()
        link.enabled()
        link.link.look()
        assert not link.health.has('drive.left_on')
        assert link.link.stop()
        assert not made.pushes
