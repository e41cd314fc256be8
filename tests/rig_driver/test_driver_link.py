"""The link between driver and bus without ROS: python-can's virtual bus, a scripted rig."""

from contextlib import contextmanager
import errno
import itertools
import os
import threading
from time import monotonic, sleep, time_ns

import can
from driver_bench import wait_for
from held_up import held_up_since
import numpy as np
import pytest
from scripted_rig import DISABLED, ENABLED, FAULT, ScriptedRig

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire
from servo_rig_driver.devices.canopen_device import CanopenDevice
from servo_rig_driver.devices.drive_master import DriveMaster, DriveState
from servo_rig_driver.devices.pdo_table import load_frames
from servo_rig_driver.driver.paced_requests import LinkSettings
from servo_rig_driver.driver.rig_health import RigHealth
from servo_rig_driver.driver.rig_link import ForeignDriver, RigLink
from servo_rig_driver.driver.rig_watch import RigWatch
from servo_rig_driver.driver.sampler import Sampler
from servo_rig_driver.driver.setpoints import Limits, Mode, SetpointPlayer

PERIOD = 2_000_000
_channels = (f'link{number}' for number in itertools.count())


class Linked:
    """
    A link, what it is made of, and the blocks it published.

    Limits of time are wide where a test does not ask for them: a machine may stand still a while.
    """

    def __init__(self, channel: str, late_limit: float = 10.0, priority: int = 0,
                 listen_time: float = 0.1) -> None:
        self.health = RigHealth()
        table = load_frames()
        self.player = SetpointPlayer(0.1, Limits(10.0, 5.0, 2.0, -6.3, 6.3, 1000.0))
        watch = RigWatch({number: name for name, number in table.ids.items()}, self.health, 10.0)
        device = CanopenDevice(table, watch, PERIOD, 0.3, 127)
        sampler = Sampler(device, self.player, DriveMaster(pause=0.05, after_loss=True), watch,
                          self.health)
        settings = LinkSettings(PERIOD, 7, late_limit, listen_time, 0.3, priority)
        self.blocks = []
        self.link = RigLink(settings, sampler, watch, self.health,
                            lambda: Wire(open_bus(BusSettings('virtual', channel))),
                            self.blocks.append, time_ns)

    def sequence(self) -> np.ndarray:
        return np.concatenate([block.sequence + np.arange(7) for block in self.blocks])


@contextmanager
def linked(**values):
    channel = next(_channels)
    with ScriptedRig(channel, 'virtual') as rig:
        made = Linked(channel, **values)
        made.link.open()
        made.link.start()
        try:
            wait_for(lambda: rig.status == ENABLED, 'the drive is enabled')
            yield rig, made
        finally:
            made.link.close()


def test_it_runs_on_the_virtual_bus_and_leaves_the_drive_disabled():
    with linked() as (rig, made):
        wait_for(lambda: len(made.blocks) > 20, 'twenty blocks')
        assert {rig.written[node, 0x1006] for node in (1, 2, 3)} == {PERIOD // 1000}
        assert {rig.written[node, 0x1017] for node in (1, 2, 3)} == {2500}
        origin = {block.stamp - block.sequence * PERIOD for block in made.blocks}
        assert len(origin) == 1

        def played():  # a busy link may let it pass
            now = made.link.now()
            made.player.add(now, Mode.VOLTAGE, 0.02, [4.0, 0.0], [], now)
            return any(one[:2] == (-1, 4.0) for one in rig.taken)
        wait_for(played, 'the command is played')
        assert made.link.stop()
        assert rig.status != ENABLED
        assert rig.taken[-1][1] == 0.0
        numbers = made.sequence()
        assert (np.diff(numbers) > 0).all()
        missing = numbers[-1] - numbers[0] + 1 - len(numbers)  # on a busy machine, and counted
        assert missing <= sum(made.health.counted(f'samples.{why}')
                              for why in ('not_asked', 'unanswered'))
        assert missing or made.health.troubles == ()


def test_it_loses_the_samples_of_lost_answers_alone_and_keeps_blocks_whole():
    with linked() as (rig, made):
        wait_for(lambda: len(made.blocks) > 3, 'some blocks')
        rig.silent = {3}
        held = rig.count
        wait_for(lambda: rig.count > held + 3, 'some SYNCs')
        rig.silent = set()
        wait_for(lambda: (np.diff(made.sequence()) != 1).any(), 'a hole')
        before = len(made.blocks)
        wait_for(lambda: len(made.blocks) > before + 5, 'blocks again')
        gaps = np.flatnonzero(np.diff(made.sequence()) != 1)
        assert len(gaps) == 1
        assert made.health.counted('samples.unanswered') >= 4
        assert {len(block.columns['torque']) for block in made.blocks} == {7}
        for block in made.blocks:  # each sample of one instant: both read n thousandths
            np.testing.assert_allclose(block.columns['load_position'], block.columns['torque'],
                                       atol=1e-5)


def test_it_leaves_samples_out_rather_than_asking_too_late():
    with linked(late_limit=0.02) as (_, made):
        wait_for(lambda: made.blocks, 'a block')
        made.link.sampler.blocks.out = lambda block: sleep(0.1)
        wait_for(lambda: made.health.counted('samples.not_asked') > 20, 'samples are left out')
        assert any('samples were not taken' in trouble.text for trouble in made.health.troubles)


def test_a_stop_that_follows_a_start_at_once_is_confirmed_at_once():
    with linked() as (rig, made):
        assert made.link.stop()
        for _ in range(20):
            made.link.start()
            begun = monotonic()
            assert made.link.stop()
            assert monotonic() - begun < 1.0 + held_up_since(begun)
        sleep(0.2)
        assert rig.status != ENABLED


def test_a_drive_that_went_on_without_the_bus_is_told_of_a_stop_once_the_bus_is_back():
    with linked() as (rig, made):
        port, back = made.link._port, threading.Event()
        opened, sent = port._open_wire, port.send

        def later():
            if not back.is_set():
                raise can.CanOperationError('unplugged')
            port.send = sent
            return opened()

        def gone(*_):
            raise can.CanOperationError('unplugged')
        port._open_wire, port.send = later, gone
        wait_for(lambda: made.health.has('bus.gone'), 'the bus is gone')
        assert not made.link.stop()
        assert rig.status == ENABLED
        back.set()
        wait_for(lambda: rig.status != ENABLED, 'the drive is disabled')
        wait_for(lambda: made.link.state == 'idle', 'the link rests')
        assert made.link.stop()


def test_a_controller_that_is_bus_off_is_told_in_words_until_it_is_back():
    with linked() as (rig, made):
        said, port = rig.wire.bus.send, made.link._port

        def full(*_, **__):
            raise can.CanOperationError('Failed to transmit: No buffer space', errno.ENOBUFS)

        def error(kind, bits=0):
            said(can.Message(arbitration_id=kind, is_error_frame=True, is_extended_id=False,
                             data=[0, bits, 0, 0, 0, 0, 0, 0]))
        error(0x04, 0x20)
        wait_for(lambda: _says(made, 'error-passive'), 'it says so')
        opened, back = port._open_wire, threading.Event()

        def again():
            wire = opened()
            if not back.is_set():
                wire.bus.send = full
            return wire
        rig.silent = {1, 2, 3}  # nor is anything heard
        port._open_wire, port._wire.bus.send = again, full
        error(0x40)
        wait_for(lambda: _says(made, 'bus-off: it met too many errors'), 'it says so')
        wait_for(lambda: _says(made, 'No buffer space; the queue of the controller is full') or
                 _says(made, 'the queue of the controller is full'), 'it says what that means')
        changes = made.health.changes
        sleep(1.5)
        assert made.health.changes <= changes + 6  # it does not blink with each try
        back.set()
        rig.silent = set()
        error(0x100)
        wait_for(lambda: not made.health.has('bus.controller'), 'it is back')
        wait_for(lambda: rig.status == ENABLED and made.link.state == 'streaming', 'it goes on')
        wait_for(lambda: not made.health.has('bus.gone'), 'the bus is there')


def _says(made, words):
    return any(words in trouble.text for trouble in made.health.troubles)


def test_an_adapter_that_is_unplugged_and_plugged_in_again_needs_nobody():
    with linked() as (rig, made):
        port, there, up = made.link._port, threading.Event(), threading.Event()
        opened = port._open_wire

        def again():
            if not there.is_set():
                raise can.CanInitializationError('cannot open socketcan can0: [Errno 19] No such '
                                                 'device; there is no can0: plug the adapter in')
            wire = opened()
            if not up.is_set():  # an interface that nobody has set up opens, and fails then
                wire.bus.recv = gone
            return wire

        def gone(*_, **__):
            raise can.CanOperationError('Error receiving: Network is down', errno.ENETDOWN)
        port._open_wire, port._wire.bus.recv = again, gone
        wait_for(lambda: made.health.has('bus.gone'), 'the bus is gone')
        wait_for(lambda: _says(made, 'ip link set virtual up type can bitrate') or
                 _says(made, 'the interface is down: ip link set'), 'what to do')
        there.set()
        sleep(0.5)
        assert made.link._thread.is_alive() and made.health.has('bus.gone')
        up.set()
        wait_for(lambda: made.link.state == 'streaming' and rig.status == ENABLED, 'it goes on')
        wait_for(lambda: not made.health.has('bus.gone'), 'the bus is there')


def test_a_link_that_breaks_takes_the_torque_away_before_it_ends(monkeypatch):
    monkeypatch.setattr(threading, 'excepthook', lambda _: None)
    with linked() as (rig, made):
        made.player.add(made.link.now(), Mode.VOLTAGE, 0.01, [4.0] * 500, [], made.link.now())
        wait_for(lambda: any(one[1] == 4.0 for one in rig.taken), 'the command is played')
        made.link.sampler.check = None
        wait_for(lambda: made.health.has('bus.thread'), 'the link breaks')
        wait_for(lambda: rig.status != ENABLED, 'the drive is disabled')
        assert made.link.state == 'broken'


def test_it_takes_a_realtime_priority_or_says_that_it_may_not():
    with linked(priority=5) as (_, made):
        policy = os.sched_getscheduler(made.link._thread.native_id)
        assert policy == os.SCHED_FIFO or made.health.has('samples.priority')


def test_it_refuses_a_bus_on_which_a_driver_speaks():
    with linked() as (rig, _):
        second = Linked(rig.wire.bus.channel_id, listen_time=10.0)
        with pytest.raises(ForeignDriver, match='another driver is on this bus'):
            second.link.open()


def test_it_says_that_there_is_no_bus():
    made = Linked('nowhere')
    nowhere = BusSettings('unix_bus', '/tmp/no.can')
    made.link._port._open_wire = lambda: Wire(open_bus(nowhere, 0.05))
    with pytest.raises(can.CanError, match='no CAN hub answers at /tmp/no.can'):
        made.link.open()


def test_a_statusword_that_was_spoilt_once_keeps_no_drive_down():
    device = Linked('none').link.sampler.device
    table = load_frames()

    def told(word):
        for name, values in (('drive.tpdo1', [0.0, 0.0]), ('drive.tpdo2', [word, 0.0, 0, 1]),
                             ('drive.tpdo3', [0.0, 0.0])):
            device.take(table[name].cob_id, table[name].pack(values), 0)
        return device.state
    up, down = DriveState.OPERATION_ENABLED, DriveState.SWITCH_ON_DISABLED
    words = [DISABLED, ENABLED, DISABLED, ENABLED, DISABLED, DISABLED]
    assert [told(word) for word in words] == [down, up, up, up, up, down]
    assert [told(word) for word in (ENABLED, FAULT)] == [up, DriveState.FAULT]
