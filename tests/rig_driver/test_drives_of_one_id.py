"""Two drives of one id on a bus: they are named, and both stay without torque."""

from threading import Thread
from time import monotonic, sleep

from drive_bench import ASKED, bench, driven, each, Link, linked
from driver_bench import wait_for
from held_up import held_up_since
import pytest

from servo_rig_driver.can_bus.bus_opening import BusSettings
from servo_rig_driver.emulated.rig_process import EmulatedRig


@pytest.mark.slow
@pytest.mark.parametrize('asked', each(ASKED))
def test_two_drives_of_one_id_are_named_and_left_off(asked, tmp_path, caplog):
    with bench(asked, tmp_path) as made, bench(asked, tmp_path) as other:
        other.rig.stop()
        other._serving.join(5.0)
        second = EmulatedRig(other.rig.rig_file, other.rig.bus, driver=other.of)
        second.bus = BusSettings('unix_bus', made.channel, fd=other.rig.bus.fd)
        second.listens = 0.0
        serving = Thread(target=second.serve, daemon=True)
        serving.start()
        link = Link(made.channel, made.of)
        try:
            wait_for(lambda: second._wire is not None, 'both are on the bus')
            link.link.open()
            link.link.start()

            def refused():  # one of two that answers late on a busy machine is not there yet
                if link.link.state == 'streaming':
                    link.link.stop()
                    link.link.start()
                return link.link.state == 'refusing a bus with two nodes of one id'
            wait_for(refused, 'the driver refuses the bus')
            link.says('two nodes of one id')
            assert not made.pushes and not second.nodes.gives_torque
            wait_for(lambda: 'end it, or give one' in caplog.text, 'a rig hears the other one')
        finally:
            link.link.close()
            second.stop()
            serving.join(5.0)


@pytest.mark.parametrize('asked', each(ASKED))
def test_a_drive_that_never_falls_silent_keeps_no_driver_from_stopping(asked, tmp_path):
    with bench(asked, tmp_path) as made, linked(made) as link:
        receive = link.link._port.receive

        def hears_an_answer(timeout):
            receive(min(timeout, 0.005))
            link.device._answers += 1
        link.link._port.receive = hears_an_answer
        link.link.open()
        link.link.start()
        wait_for(lambda: link.link.state == 'waiting for the rig', 'it starts')
        sleep(0.5)
        begun = monotonic()
        assert link.link.stop()
        assert monotonic() - begun < 2.0 + held_up_since(begun)


@pytest.mark.slow
@pytest.mark.parametrize('asked', each(ASKED))
def test_a_second_drive_of_its_id_that_comes_later_is_named_and_both_are_left_off(asked, tmp_path):
    with driven(asked, tmp_path) as (made, link):
        second = EmulatedRig(made.rig.rig_file, BusSettings('unix_bus', made.channel,
                                                            fd=made.rig.bus.fd), driver=made.of)
        second.listens = 0.0  # hardware listens to nobody
        serving = Thread(target=second.serve, daemon=True)
        serving.start()
        try:
            link.says('drive (node 1) has restarted' if asked == 'moteus'  # two counters of time
                      else 'requests are answered twice')
            wait_for(lambda: link.link.state == 'refusing a bus with two nodes of one id',
                     'the driver refuses the bus', 120.0)
            wait_for(lambda: not made.pushes and not second.nodes.gives_torque, 'both are off')
        finally:
            link.link.close()
            second.stop()
            serving.join(5.0)


@pytest.mark.parametrize('asked', each(ASKED))
def test_a_rig_that_comes_to_a_bus_with_another_of_its_id_leaves_and_says_why(asked, tmp_path,
                                                                             caplog):
    with driven(asked, tmp_path) as (made, link):
        second = EmulatedRig(made.rig.rig_file, BusSettings('unix_bus', made.channel),
                             driver=made.of)
        second.listens = 10.0  # until the first answer on a busy machine
        assert second.serve() is False
        assert 'end the other rig, or give one of the two another --channel or id' in caplog.text
        said = len(link.blocks)
        wait_for(lambda: len(link.blocks) > said + 20, 'the first rig goes on')
        assert made.rig.nodes.gives_torque
