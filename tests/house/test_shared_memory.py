"""No node makes shared memory of Fast DDS, or waits for what a killed process left of it."""

import os
from pathlib import Path
import subprocess
import sys

from diagnostic_msgs.msg import DiagnosticArray
from driver_bench import Listener, wait_for
import pytest

from servo_rig_driver import ros_start as of_the_rig
from servo_twin.nodes import ros_start as of_the_twin

SERVO = Path(__file__).resolve().parents[2] / 'config' / 'servos' / 'rv_bench.yaml'
SHARED = Path('/dev/shm')
PORT = 52400  # bytes of the segment of a port
NODES = {
    'driver': ('servo_rig_driver.driver.driver_node', 'autostart:=false'),
    'recorder': ('servo_rig_driver.record.recorder_node', 'output:=bag'),
    'twin': ('servo_twin.nodes.twin_node', f'servo_file:={SERVO}'),
    'identify': ('servo_identify.nodes.identify_node', f'servo_file:={SERVO}'),
}
LOCALHOST = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
STARTS = pytest.mark.parametrize('start', [of_the_rig, of_the_twin], ids=['rig', 'twin'])


def plain():
    """Return the environment without what says how Fast DDS is to go."""
    return {name: value for name, value in os.environ.items() if name not in (
        of_the_rig.TRANSPORTS, of_the_rig.RANGE, *of_the_rig.PROFILES)}


@pytest.fixture
def half_made():
    """Leave ports of this domain as a process does that is killed while it makes one."""
    base = 7400 + 250 * int(os.environ['ROS_DOMAIN_ID'])
    made = [SHARED / f'fastrtps_port{base + 11 + 2 * k}' for k in range(20)]
    for file in made:
        with file.open('wb') as content:
            content.truncate(PORT)
    yield
    for file in made:
        file.unlink(missing_ok=True)


@pytest.fixture
def ears():
    listener = Listener('shared')
    yield listener
    listener.close()


def multicast_port(pid):
    """Whether a process listens where nodes of other machines would be heard."""
    base = 7400 + 250 * int(os.environ['ROS_DOMAIN_ID'])
    rows = [line.split() for line in Path('/proc/net/udp').read_text().splitlines()[1:]]
    sockets = {f'socket:[{row[9]}]' for row in rows if int(row[1].split(':')[1], 16) == base}
    return bool(sockets & {os.readlink(one) for one in Path(f'/proc/{pid}/fd').iterdir()})


@pytest.mark.long
@pytest.mark.ros
@pytest.mark.parametrize(('name', 'range_of'), [
    *((name, LOCALHOST) for name in NODES), ('driver', {}), ('twin', {}),
    ('driver', {'ROS_LOCALHOST_ONLY': '1'})])
def test_a_node_is_heard_beside_half_made_memory_and_makes_none(
        name, range_of, ears, half_made, tmp_path):
    module, value = NODES[name]
    said = []
    ears.node.create_subscription(DiagnosticArray, '/diagnostics', said.append, 10)
    node = subprocess.Popen(
        [sys.executable, '-m', module, '--ros-args', '-r', '__ns:=/shared', '-p', value],
        cwd=tmp_path, env=plain() | range_of, stdout=subprocess.DEVNULL)
    try:
        wait_for(lambda: said, f'the {name} says how it does')
        assert f'{SHARED}/fastrtps' not in Path(f'/proc/{node.pid}/maps').read_text()
        assert multicast_port(node.pid) is not bool(range_of)
    finally:
        node.kill()
        node.wait()


@STARTS
def test_nodes_of_this_machine_alone_are_told_the_profile_that_is_installed(start):
    told = start.udp_alone(LOCALHOST)
    assert told['FASTDDS_BUILTIN_TRANSPORTS'] == 'UDPv4'
    assert told['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'SYSTEM_DEFAULT'
    assert 'UDPv4' in Path(told['FASTRTPS_DEFAULT_PROFILES_FILE']).read_text()
    assert start.udp_alone(LOCALHOST | told) == {'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}


@STARTS
@pytest.mark.parametrize('given', [
    {}, {'FASTDDS_BUILTIN_TRANSPORTS': 'SHM'}, {'FASTRTPS_DEFAULT_PROFILES_FILE': 'mine.xml'},
    {'ROS_STATIC_PEERS': '10.0.0.2'}, {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'},
    {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'OFF'}], ids=str)
def test_what_was_asked_for_rules(start, given):
    before = (LOCALHOST if given else {}) | given
    assert start.udp_alone(before) == {
        'FASTDDS_BUILTIN_TRANSPORTS': given.get('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')}


@STARTS
def test_another_middleware_finds_its_nodes_as_before(start, monkeypatch):
    monkeypatch.setattr(start.rclpy, 'get_rmw_implementation_identifier',
                        lambda: 'rmw_cyclonedds_cpp')
    assert 'ROS_AUTOMATIC_DISCOVERY_RANGE' not in start.udp_alone(LOCALHOST)
