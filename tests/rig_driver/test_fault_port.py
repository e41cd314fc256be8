"""Faults of a running emulated rig can be switched, where somebody asked for it."""

import json
from pathlib import Path
import socket
import subprocess
import sys
import time

import pytest

from servo_rig_driver.emulated.emulated_bench import Bench
from servo_rig_driver.emulated.fault_port import FaultPort, STRENGTHS
from servo_rig_driver.emulated.rig_file import load_rig

RIGS = Path(__file__).resolve().parents[2] / 'config' / 'rigs'


def ask(path: Path, line: bytes) -> dict:
    with socket.socket(socket.AF_UNIX) as wire:
        wire.connect(str(path))
        wire.sendall(line + b'\n')
        return json.loads(wire.makefile('rb').readline())


@pytest.fixture
def port(tmp_path):
    bench = Bench(load_rig(RIGS / 'rv_plain.yaml'))
    port = FaultPort(tmp_path / 'faults', bench, lambda do: do())
    port.bench = bench
    yield port
    port.close()
    assert not port.path.exists()


def test_it_says_which_faults_there_are_and_how_they_stand(port):
    said = ask(port.path, b'{}')
    assert said['rig'] == 'rv_plain' and 'error' not in said
    faults = {one['path']: one for one in said['faults']}
    assert set(faults) == set(STRENGTHS)
    for one in faults.values():
        assert one['value'] == 0.0 and one['low'] <= one['strength'] <= one['high']
    assert faults['withheld.gravity']['unit'] == 'N m'


def test_it_switches_a_fault_of_the_running_rig(port):
    said = ask(port.path, b'{"set": {"withheld.gravity": 4.0}}')
    assert next(f['value'] for f in said['faults'] if f['path'] == 'withheld.gravity') == 4.0
    assert port.bench.parameters['withheld_gravity'][0] == 4.0


@pytest.mark.parametrize('line, said', [
    (b'{"set": {"friction.level": 2.0}}', "no fault 'friction.level'"),
    (b'{"set": {"withheld.gravity": "much"}}', 'is no number'),
    (b'{"set": {"withheld.gravity": NaN}}', 'is no number'),
    (b'{"set": {"withheld.gravity": -1.0}}', 'outside'),
    (b'[]', 'a request is'),
    (b'nonsense', ''),
])
def test_what_it_refuses_changes_nothing(port, line, said):
    before = port.bench.rig.values
    answer = ask(port.path, line)
    assert said in answer['error']
    assert port.bench.rig.values == before


def test_only_its_user_may_open_it(port):
    assert port.path.stat().st_mode & 0o777 == 0o600


def test_a_rig_without_such_faults_has_none_to_switch(tmp_path):
    port = FaultPort(tmp_path / 'faults', Bench(load_rig(RIGS / 'feed_drive.yaml')),
                     lambda do: do())
    assert ask(port.path, b'{}') == {'rig': 'feed_drive', 'faults': []}
    port.close()


def test_a_rig_process_listens_where_it_was_told_and_says_when_its_bus_is_away(tmp_path):
    faults = tmp_path / 'faults'
    rig = subprocess.Popen([
        sys.executable, '-m', 'servo_rig_driver.emulated.rig_process', '--rig',
        str(RIGS / 'rv_plain.yaml'), '--channel', str(tmp_path / 'can'), '--faults', str(faults)],
        stderr=subprocess.DEVNULL)
    try:
        until = time.monotonic() + 60.0
        while not faults.exists() and time.monotonic() < until:
            time.sleep(0.05)
        said = ask(faults, b'{"set": {"withheld.gravity": 4.0}}')
        assert 'not on its bus' in said['error']
        assert {one['value'] for one in said['faults']} == {0.0}
    finally:
        rig.terminate()
        assert rig.wait(60.0) == 0
    assert not faults.exists()
