"""However a rig is ended, its drive is taken down in order, stays down, and nothing lives on."""

import os
import signal
import subprocess
import sys
from time import monotonic, sleep

from can_watcher import CanWatcher, DISABLED, ENABLED, FAULT
from driver_bench import alive, CONFIG, DriverProcess, Listener, wait_for
from held_up import held_up_since, watch
from lifecycle_msgs.msg import Transition
import pytest
from scripted_rig import ScriptedRig
from test_driver_lifecycle import Hands

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire
from servo_rig_driver.can_bus.can_hub import CanHub

pytestmark = pytest.mark.ros

RIG = CONFIG.parent / 'rigs' / 'rv_bench.yaml'
DOWN_WITHIN = 2.0  # s: quick stop 0.5, torque away 0.8, and a busy machine
WATCHDOG = 1.0  # s; a busy machine stands still for longer than a drive's usual 0.1 s
PYTHON = [sys.executable, '-m']
HUB = [*PYTHON, 'servo_rig_driver.can_bus.can_hub']
EMULATOR = [*PYTHON, 'servo_rig_driver.emulated.rig_process', '--rig', str(RIG), '--watchdog',
            str(WATCHDOG), '--channel']
HEARTBEAT = 3.0  # s; as above: a node that is taken for lost is disabled at once, not in order
QUICK = {'block_size': 10, 'retry_period': 0.05, 'listen_time': 0.05,
         'heartbeat_timeout': HEARTBEAT}


@pytest.fixture(scope='module')
def bench(tmp_path_factory):
    """A bus with the emulated bench on it; gives the bus's channel and one who looks at it."""
    channel = str(tmp_path_factory.mktemp('bench') / 'rig.can')
    with CanHub(channel):
        rig = subprocess.Popen([*EMULATOR, channel], stderr=subprocess.DEVNULL)
        watch(rig.pid)
        watcher = CanWatcher(channel)
        try:
            wait_for(lambda: watcher.beaten, 'the drive beats', 60.0)
            yield channel, watcher
        finally:
            watcher.close()
            rig.terminate()
            assert rig.wait(60.0) == 0


def turning(channel, watcher, namespace='rig', **values):
    """Return a driver whose drive is enabled and turns, and a node that listens to it."""
    ears = Listener(namespace)
    watcher.states.clear()
    driver = DriverProcess(namespace, bus__channel=channel, **{**QUICK, **values})
    wait_for(lambda: watcher.states[-1:] == [ENABLED] and ears.encoder, 'the drive is enabled')
    for _ in range(3):  # half a second of it
        ears.command(3, [0.5] * 600, ears.now())
    wait_for(lambda: ears.encoder[-1].motor_position[-1] - ears.encoder[-1].motor_position[0] > 0.1
             or ears.command(3, [0.5] * 600, ears.now()), 'the motor turns')
    watcher.forget()
    return driver, ears


@pytest.mark.parametrize('signals, pause', [
    ([signal.SIGINT], 0.0), ([signal.SIGINT] * 3, 0.15), ([signal.SIGTERM], 0.0),
    ([signal.SIGHUP], 0.0), ([signal.SIGHUP, signal.SIGTERM], 0.0)])
def test_a_signal_takes_the_drive_down_in_order(bench, signals, pause):
    channel, watcher = bench
    driver, ears = turning(channel, watcher)
    try:
        since = monotonic()
        for number in signals:
            driver.process.send_signal(number)
            sleep(pause)
        watcher.saw_it_go_down(since, DOWN_WITHIN)
        status, said = driver.wait()
        assert status == 0, said
        assert 'Traceback' not in said
        assert watcher.ask() == DISABLED
    finally:
        driver.close()
        ears.close()


def test_a_driver_that_is_killed_leaves_a_drive_that_fails_by_itself_and_stays_so(bench):
    channel, watcher = bench
    driver, ears = turning(channel, watcher)
    try:
        driver.process.kill()
        since = monotonic()
        wait_for(lambda: watcher.ask() == FAULT, 'the drive misses SYNC')
        assert monotonic() - since < WATCHDOG + 1.0 + held_up_since(since)
        sleep(0.3)
        assert watcher.ask() == FAULT
    finally:
        ears.close()


def test_a_driver_that_was_led_down_by_hand_stays_down_though_it_started_itself(bench):
    channel, watcher = bench
    driver, ears = turning(channel, watcher)
    hands = Hands(ears)

    def stays_down(state):
        watcher.catch_up()
        managed = len(watcher.managed)
        sleep(10 * QUICK['retry_period'] + 0.3)
        assert watcher.ask() == DISABLED
        assert len(watcher.managed) == managed
        assert hands.state() == state

    try:
        ears.command(3, [0.5] * 2000, ears.now())  # for as long as it takes to be heard
        since = monotonic()
        assert hands.change(Transition.TRANSITION_DEACTIVATE)
        watcher.saw_it_go_down(since, DOWN_WITHIN)
        assert hands.change(Transition.TRANSITION_CLEANUP)
        stays_down('unconfigured')
        assert hands.change(Transition.TRANSITION_CONFIGURE)
        assert hands.change(Transition.TRANSITION_ACTIVATE)
        wait_for(lambda: watcher.states[-1] == ENABLED, 'somebody has activated it')
        watcher.forget()
        since = monotonic()
        assert hands.change(Transition.TRANSITION_ACTIVE_SHUTDOWN)
        watcher.saw_it_go_down(since, DOWN_WITHIN, turns=False)
        stays_down('finalized')
    finally:
        driver.close()
        ears.close()


def test_autostart_can_be_switched_off_at_any_time_and_is_off_in_the_shipped_file(bench):
    channel, watcher = bench
    ears = Listener('off')
    driver = DriverProcess('off', bus__channel=channel + '_not_there', **QUICK)
    hands = Hands(ears)
    try:
        assert hands.set('autostart', False).successful
        assert hands.set('bus.channel', channel).successful
        sleep(10 * QUICK['retry_period'] + 0.3)
        assert hands.state() == 'unconfigured'
        assert watcher.ask() != ENABLED
    finally:
        driver.close()
        ears.close()
    assert '\n    autostart: false' in CONFIG.read_text()


LAUNCHER = """
import subprocess, sys
started = [subprocess.Popen(words.split()) for words in sys.argv[1:]]
print(*[process.pid for process in started], flush=True)
for process in started:
    try:
        process.wait()
    except KeyboardInterrupt:
        pass
"""


@pytest.mark.long
@pytest.mark.parametrize('end', ['kill the parent', 'interrupt all of them twice'])
def test_what_one_process_started_ends_with_it_and_the_drive_in_order(tmp_path, end):
    channel = str(tmp_path / 'rig.can')
    named = '--ros-args -r __ns:=/all'
    node = f'{sys.executable} -m servo_rig_driver'
    commands = [
        ' '.join([*HUB, channel]), ' '.join([*EMULATOR, channel]),
        f'{node}.driver.driver_node {named} --params-file {CONFIG} -p bus.channel:={channel} '
        f'-p autostart:=true -p block_size:=10 -p heartbeat_timeout:={HEARTBEAT}',
        f'{node}.record.recorder_node {named} -p output:={tmp_path / "bag"}',
        f'{node}.record.player_node sine --mode velocity --duration 60 {named}',
        f'{sys.executable} -m servo_twin.nodes.twin_node {named} -p autostart:=true',
    ]
    parent = subprocess.Popen([sys.executable, '-c', LAUNCHER, *commands], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                              start_new_session=True)
    pids = [int(word) for word in parent.stdout.readline().split()]
    for pid in pids:
        watch(pid)
    watcher = CanWatcher(channel)
    ears = Listener('all', commands=False)
    try:
        wait_for(lambda: watcher.states[-1:] == [ENABLED], 'the drive is enabled', 60.0)
        wait_for(lambda: (tmp_path / 'bag').exists() and ears.encoder and abs(
            ears.encoder[-1].motor_position[-1] - ears.encoder[-1].motor_position[0]) > 0.05,
            'the motor turns', 60.0)
        watcher.forget()
        since = monotonic()
        if end == 'kill the parent':
            parent.kill()
        else:
            for _ in range(2):
                os.killpg(parent.pid, signal.SIGINT)
                sleep(0.05)
        watcher.saw_it_go_down(since, DOWN_WITHIN, turns=False)  # the player may end first
        watcher.close()
        wait_for(lambda: not any(map(alive, pids)), 'all of them have ended')
    finally:
        watcher.close()
        ears.close()
        for pid in pids:
            if alive(pid):
                os.kill(pid, signal.SIGKILL)
        parent.kill()
        parent.wait()


@pytest.mark.long
def test_a_second_rig_on_the_bus_does_not_speak_and_says_why(tmp_path):
    channel = str(tmp_path / 'rig.can')
    with CanHub(channel):
        wire = Wire(open_bus(BusSettings('unix_bus', channel), 20.0))
        first = subprocess.Popen([*EMULATOR, channel], stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: any(identifier == 0x701 for identifier, _ in wire.recv(0.05)),
                     'the first rig is heard')
            second = subprocess.run([*EMULATOR, channel], capture_output=True, text=True,
                                    timeout=60)
            assert second.returncode == 1
            assert 'another drive speaks under 0x701' in second.stderr
        finally:
            wire.bus.shutdown()
            first.terminate()
            assert first.wait(60.0) == 0


@pytest.mark.long
def test_a_second_rig_leaves_when_it_hears_a_first_one_that_beats_slowly(tmp_path):
    channel = str(tmp_path / 'rig.can')
    with CanHub(channel):
        wire = Wire(open_bus(BusSettings('unix_bus', channel), 20.0))
        first, heard = subprocess.Popen([*EMULATOR, channel], stderr=subprocess.DEVNULL), []

        def hears(*wanted):
            heard.extend(wire.recv(0.05))
            return set(wanted) <= {identifier for identifier, _ in heard}
        try:
            wait_for(lambda: hears(0x701), 'the first rig is heard')
            every = (1000).to_bytes(2, 'little')  # ms, object 1017h
            wire.send([(0x600 + node, b'\x2b\x17\x10\x00' + every + bytes(2))
                       for node in (1, 2, 3)])
            wait_for(lambda: hears(0x581, 0x582, 0x583), 'it beats once a second')
            heard.clear()
            wait_for(lambda: hears(0x701), 'it has just beaten')
            second = subprocess.run([*EMULATOR, channel], capture_output=True, text=True,
                                    timeout=60)
            assert second.returncode == 1
            assert 'another drive speaks under 0x701' in second.stderr
            assert 'end the other rig' in second.stderr
        finally:
            wire.bus.shutdown()
            first.terminate()
            assert first.wait(60.0) == 0


def test_two_nodes_of_one_id_are_named_and_nothing_is_switched_on_or_tried_again(tmp_path):
    channel = str(tmp_path / 'rig.can')
    with CanHub(channel), ScriptedRig(channel) as first, ScriptedRig(channel) as second:
        watcher, ears = CanWatcher(channel), Listener('two')
        driver = DriverProcess('two', bus__channel=channel, diagnostics_period=0.2, **QUICK)
        try:
            said = ears.hears('nodes', 'two nodes of one id, or two rigs', 2)
            assert 'drive (node 1)' in said.message
            managed = len(watcher.managed)
            sleep(0.5)
            assert len(watcher.managed) == managed
            assert first.count == second.count == 0
            assert ENABLED not in watcher.states
            second.close()
            hands = Hands(ears)
            assert hands.change(Transition.TRANSITION_DEACTIVATE)
            assert hands.change(Transition.TRANSITION_ACTIVATE)
            wait_for(lambda: watcher.states[-1:] == [ENABLED], 'the drive is enabled')
        finally:
            driver.close()
            ears.close()
            watcher.close()
