"""The driver beside the emulated rig, each a process of its own, as on a machine."""

import math
from pathlib import Path
import signal
import subprocess
import sys
from time import time_ns

from driver_bench import DriverProcess, instant, later, Listener, wait_for
import numpy as np
import pytest

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire

pytestmark = pytest.mark.ros

RIG = Path(__file__).resolve().parents[2] / 'config' / 'rigs' / 'rv_bench.yaml'
VOLTAGE, VELOCITY = 1, 3
PERIOD = 2e-3


class Machine:
    """Hub, rig and driver as processes at 500 Hz, five samples a message."""

    def __init__(self, channel: str) -> None:
        self.channel = channel
        self.hub = self.start_hub()
        self.rig = self.start_rig()
        self.ears = Listener('machine')
        self.driver = DriverProcess('machine', bus__channel=channel, sync_period=PERIOD,
                                    block_size=5, retry_period=0.3, diagnostics_period=0.2,
                                    fault_reset_pause=0.1)

    def start_hub(self) -> subprocess.Popen:
        return subprocess.Popen([sys.executable, '-m', 'servo_rig_driver.can_bus.can_hub',
                                 self.channel],
                                stderr=subprocess.DEVNULL)

    def start_rig(self) -> subprocess.Popen:
        return subprocess.Popen([sys.executable, '-m', 'servo_rig_driver.emulated.rig_process',
                                 '--rig',
                                 str(RIG), '--channel', self.channel], stderr=subprocess.DEVNULL)

    def close(self) -> None:
        self.driver.close()
        for process in (self.rig, self.hub):
            process.terminate()
            process.wait(60.0)
        self.ears.close()


@pytest.fixture(scope='module')
def running(tmp_path_factory):
    machine = Machine(str(tmp_path_factory.mktemp('machine') / 'rig.can'))
    try:
        yield machine
    finally:
        machine.close()


@pytest.fixture
def machine(running):
    wait_for(lambda: running.ears.current, 'the first sample', 60.0)
    running.ears.all_well()
    return running


def driven(ears: Listener) -> None:
    """Command five seconds of 1 V, again and again until they are played."""
    wait_for(lambda: 1.0 in ears.current[-1].voltage
             or ears.command(VOLTAGE, [1.0] * 100, ears.now(), 0.05), 'the command is played')


def voltages(machine: Machine, since: int) -> np.ndarray:
    return machine.ears.column(machine.ears.current, 'voltage', since)[1]


def test_it_moves_the_load_at_the_commanded_speed_without_losing_a_sample(machine):
    ears = machine.ears

    def speed():
        start = ears.now() + 20_000_000
        for part in range(4):
            ears.command(VELOCITY, [0.2] * 150, start + part * 300_000_000, PERIOD)
        over = start + 1_200_000_000
        wait_for(lambda: later(ears.encoder, over) and later(ears.current, over), 'it is over')
        settled = start + 600_000_000
        numbers, angles = (of[:250] for of in ears.column(
            ears.encoder, 'load_position', settled))
        same, speeds = (of[:250] for of in ears.column(
            ears.current, 'reference_velocity', settled))
        np.testing.assert_array_equal(numbers, same)
        held = (speeds == 0.2).all()  # a busy machine hears it late, or lets a set-point grow old
        return held and (angles[-1] - angles[0]) / ((numbers[-1] - numbers[0]) * PERIOD)
    with ears.every_sample():
        assert wait_for(speed, 'the speed is held') == pytest.approx(0.2, rel=0.05)


def test_it_measures_all_that_the_bench_has(machine):
    machine.ears.more_samples(5)
    for kept, names in ((machine.ears.encoder, ('motor_position', 'load_position')),
                        (machine.ears.torque, ('torque', 'external_torque')),
                        (machine.ears.current, ('current', 'voltage', 'temperature'))):
        for name in names:
            assert all(map(math.isfinite, getattr(kept[-1], name))), name


def test_it_recovers_from_a_fault_that_the_drive_tells(machine):
    wire = Wire(open_bus(BusSettings('unix_bus', machine.channel)))
    try:
        wire.send([(0x601, b'\x2b\x11\x20\x00\x10\x23\x00\x00')])  # 2011h = 2310h, over-current
        machine.ears.has_heard('drive (node 1) reports emergency 0x2310')  # gone within 0.1 s
    finally:
        wire.bus.shutdown()
    machine.ears.hears('drive', 'ok', 0)


def test_it_recovers_when_the_rig_was_killed_and_started_again(machine):
    ears = machine.ears
    driven(ears)
    last = ears.current[-1]
    machine.rig.send_signal(signal.SIGKILL)
    machine.rig.wait()
    status = ears.hears('nodes', 'drive (node 1) is silent: no heartbeat within 0.5 s', 2)
    assert 'since 20' in status.message
    since = time_ns()
    machine.rig = machine.start_rig()
    ears.hears('nodes', 'ok', 0)
    wait_for(lambda: len(later(ears.current, since)) > 30, 'samples come again')
    ears.all_well()
    assert not voltages(machine, since).any(), 'nothing of the old command'
    again = ears.current[-1]
    assert again.sequence > last.sequence + 250
    assert instant(again) - instant(last) == (again.sequence - last.sequence) * 2_000_000


def test_it_recovers_when_the_hub_was_killed_and_started_again(machine):
    ears = machine.ears
    machine.hub.send_signal(signal.SIGKILL)
    machine.hub.wait()
    ears.hears('bus', 'the bus is gone', 2)
    since = time_ns()
    machine.hub = machine.start_hub()
    ears.hears('bus', 'ok', 0)
    wait_for(lambda: len(later(ears.current, since)) > 30, 'samples come again')
    ears.all_well()


def test_it_leaves_a_still_drive_when_it_is_stopped(machine):
    said = machine.driver.close()
    assert machine.driver.process.returncode == 0, said
    since = time_ns()
    machine.driver = DriverProcess('machine', bus__channel=machine.channel,
                                   sync_period=PERIOD, block_size=5)
    wait_for(lambda: len(later(machine.ears.current, since)) > 10, 'a new driver takes over')
    assert machine.ears.current[-1].sequence < 1_000_000
    machine.ears.all_well()


def test_it_takes_over_a_rig_whose_driver_was_killed_while_it_drove(machine):
    driven(machine.ears)
    machine.driver.process.send_signal(signal.SIGKILL)
    machine.driver.process.communicate()
    since, told = time_ns(), len(machine.ears.diagnoses)
    machine.driver = DriverProcess('machine', bus__channel=machine.channel,
                                   sync_period=PERIOD, block_size=5)

    def said(words):  # now, or as what has passed: the fault may be over before the first samples
        return any(words in text for diagnosis in machine.ears.diagnoses[told:]
                   for status in diagnosis.status
                   for text in (status.message, *(pair.value for pair in status.values)))

    # without SYNC the drive has gone to fault with 8140h by itself
    wait_for(lambda: len(later(machine.ears.current, since)) > 10, 'a new driver takes over')
    wait_for(lambda: said('the drive is in fault'), 'the fault is told')
    machine.ears.all_well()
    machine.ears.hears('drive', 'ok', 0)
    assert not voltages(machine, since).any()
