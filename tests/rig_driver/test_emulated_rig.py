"""The emulated rig as a process: on a bus with canopen, at a kilohertz, and when the bus stops."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import canopen
import numpy as np
import pytest

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire
from servo_rig_driver.can_bus.can_hub import CanHub
from servo_rig_driver.devices import pdo_table as wire_frames
from servo_rig_driver.devices.object_dictionary import load_dictionaries
from servo_rig_driver.devices.pdo_table import load_frames, sync_counter, sync_frame
from servo_rig_driver.emulated.rig_process import EmulatedRig, main

RIG = Path(__file__).parents[2] / 'config' / 'rigs' / 'rv_bench.yaml'
PACKAGE = Path(wire_frames.__file__).parents[1]
TABLE = load_frames()
START = (0x000, bytes([1, 0]))


@pytest.mark.long
@pytest.mark.slow
def test_canopen_reads_and_writes_objects_of_the_nodes_over_a_bus(tmp_path):
    path = str(tmp_path / 'can')
    with CanHub(path):
        rig = subprocess.Popen([sys.executable, '-m', 'servo_rig_driver.emulated.rig_process',
                                '--rig',
                                str(RIG), '--channel', path], env=environment())
        network = canopen.Network(open_bus(BusSettings('unix_bus', path)))
        network.connect()
        try:
            node = network.add_node(canopen.RemoteNode(1, load_dictionaries().nodes['drive']))
            node.sdo.RESPONSE_TIMEOUT = 1.0
            node.nmt.wait_for_heartbeat(60.0)
            assert node.sdo['Device type'].raw == 0x00020192
            assert node.sdo[0x6041].raw & 0x6F == 0x40
            node.sdo[0x1006].phys = 0.00025
            assert node.sdo[0x1006].raw == 250
            with pytest.raises(canopen.SdoAbortedError):
                node.sdo[0x1A00][1].raw = 0
        finally:
            network.disconnect()
            rig.terminate()
            assert rig.wait(60.0) == 0


def environment():
    return {**os.environ,
            'PYTHONPATH': f'{PACKAGE}{os.pathsep}{os.environ.get("PYTHONPATH", "")}'}


def until(wire, wanted, seconds=60.0):
    """Return the data of the first frame with this identifier."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        for identifier, data in wire.recv(0.1):
            if identifier == wanted:
                return data
    raise AssertionError(f'no frame 0x{wanted:X} within {seconds} s')


@pytest.mark.long
@pytest.mark.slow
def test_real_processes_answer_every_sync_at_a_kilohertz_and_come_back_after_a_stopped_bus(
        tmp_path):
    path, rig_file = str(tmp_path / 'can'), tmp_path / 'rig.yaml'
    rig_file.write_text(RIG.read_text())
    start = [sys.executable, '-m', 'servo_rig_driver.can_bus.can_hub', path]
    hub = subprocess.Popen(start, env=environment())
    rig = subprocess.Popen([sys.executable, '-m', 'servo_rig_driver.emulated.rig_process', '--rig',
                            str(rig_file), '--channel', path], env=environment(), text=True,
                           stderr=subprocess.PIPE)
    try:
        wire = Wire(open_bus(BusSettings('unix_bus', path), 10.0))
        assert until(wire, 0x701) == b'\0'
        wire.send([START])
        begin = time.monotonic()
        for k in range(1000):
            time.sleep(max(0.0, begin + k * 1e-3 - time.monotonic()))
            wire.send([sync_frame(k)])
            data = until(wire, 0x182)
            assert TABLE['load_encoder.tpdo1'].decode(data)['sample_counter'] == sync_counter(k)
        rig_file.write_text(rig_file.read_text().replace('torque: 1.0 ', 'torque: 0.0 '))
        rig.send_signal(signal.SIGUSR1)
        torque = 0.0
        while not np.isnan(torque):
            k += 1
            wire.send([sync_frame(k)])
            torque = TABLE['torque_sensor.tpdo1'].unpack(until(wire, 0x183))[0]
        hub.kill()
        hub.wait()
        wire.bus.shutdown()
        hub = subprocess.Popen(start, env=environment())
        wire = Wire(open_bus(BusSettings('unix_bus', path), 10.0))
        assert until(wire, 0x701) in (b'\0', b'\x05')
        wire.bus.shutdown()
    finally:
        rig.terminate()
        told = rig.communicate(timeout=60.0)[1]
        hub.terminate()
        hub.wait(60.0)
    assert rig.returncode == 0
    assert 'read again' in told and 'opening the bus again' in told


def test_a_rig_that_cannot_be_read_is_one_clear_line(tmp_path, capsys, caplog):
    path = tmp_path / 'rig.yaml'
    path.write_text('friction: {levle: 1}')
    assert main(['--rig', str(path)]) == 1
    assert "has no property 'friction.levle'" in caplog.text


def test_a_broken_rig_file_leaves_the_running_rig_as_it_is(tmp_path, caplog):
    path = tmp_path / 'rig.yaml'
    path.write_text('friction: {level: 2}')
    rig = EmulatedRig(path, BusSettings('virtual', 'broken'))
    path.write_text('friction: {level: -2}')
    rig.reread()
    rig._turn()
    assert rig.bench.rig.values['friction.level'] == 2.0
    assert 'the rig stays as it is' in caplog.text


@pytest.mark.slow
def test_a_request_that_cannot_be_taken_apart_is_told_in_a_sentence(tmp_path):
    path = str(tmp_path / 'can')
    with CanHub(path):
        rig = subprocess.Popen([sys.executable, '-m', 'servo_rig_driver.emulated.rig_process',
                                '--rig', str(RIG), '--channel', path], env=environment(),
                               stderr=subprocess.PIPE, text=True)
        wire = Wire(open_bus(BusSettings('unix_bus', path)))
        try:
            until = time.monotonic() + 60.0
            while not wire.recv(0.5):
                assert time.monotonic() < until
            wire.send([(0x601, b'\x40'), (0x601, b'\x00' * 8), (0x601, b''),
                       (0x601, b'\x40\x00\x10\x00' + bytes(4))])
            while not any(identifier == 0x581 and data[:4] == b'\x43\x00\x10\x00'
                          for identifier, data in wire.recv(0.5)):
                assert time.monotonic() < until
        finally:
            wire.bus.shutdown()
            rig.terminate()
            said = rig.communicate(timeout=60.0)[1]
    assert rig.returncode == 0
    assert 'Traceback' not in said
