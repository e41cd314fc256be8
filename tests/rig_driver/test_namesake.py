"""Two launches in one namespace: of two nodes of one name the later one ends."""

from datetime import datetime, timedelta, UTC
import signal
from socket import gethostname
import subprocess
import sys

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from driver_bench import DriverProcess, Listener, wait_for
import pytest
from scripted_rig import ENABLED, ScriptedRig

from servo_rig_driver.can_bus.can_hub import CanHub

pytestmark = pytest.mark.ros
ADAPTER = ['servo_rig_driver.adapter.adapter_node', '-p', 'mapping:=ros2_control_joint',
           '-p', 'joint:=hip']
TWIN = ['servo_twin.nodes.twin_node', '-p', 'servo_file:=rv_bench']
IDENTIFY = ['servo_identify.nodes.identify_node']
RECORDER = ['servo_rig_driver.record.recorder_node']


def test_a_second_driver_of_a_namespace_leaves_its_motor_alone(tmp_path):
    channels = [str(tmp_path / f'{name}.can') for name in ('first', 'second')]
    ears = Listener('shared')
    with CanHub(channels[0]), CanHub(channels[1]), ScriptedRig(channels[0]) as rig, \
            ScriptedRig(channels[1]) as other:
        first = DriverProcess('shared', bus__channel=channels[0])
        try:
            wait_for(lambda: rig.status == ENABLED, 'the first drive is enabled')
            second = DriverProcess('shared', bus__channel=channels[1], graph_listen_time=3.3)
            status, said = second.wait()
            assert status == 1
            assert 'another /shared/driver runs (begun ' in said
            assert 'this one gives way; choose another namespace' in said
            assert not any(control & 0xF == 0xF for _, _, control in other.taken)  # never enabled
            ears.more_samples(20)
            ears.all_well()
            wait_for(lambda: rig.status == ENABLED, 'the first one goes on')
            first.process.kill()  # who was killed says nothing: the next one need not wait
            first.wait()
            first = DriverProcess('shared', bus__channel=channels[1])
            wait_for(lambda: other.status == ENABLED, 'the next one runs its drive')
        finally:
            first.close()
            ears.close()


@pytest.mark.parametrize('words', [ADAPTER, TWIN, RECORDER, IDENTIFY],
                         ids=['adapter', 'twin', 'recorder', 'identify'])
def test_a_second_one_of_a_namespace_ends_and_says_why(words, tmp_path):
    name = f'twice_{words[0].rpartition(".")[2]}'

    def command(*more):
        bag = ['-p', f'output:={tmp_path}/{len(more)}'] if words is RECORDER else []
        return [sys.executable, '-m', words[0], '--ros-args', '-r', f'__ns:=/{name}', *words[1:],
                *bag, *more]

    first, told = subprocess.Popen(command(), stderr=subprocess.DEVNULL), []
    ears = Listener(name)
    ears.node.create_subscription(DiagnosticArray, '/diagnostics', told.append, 100)
    try:
        wait_for(lambda: told, 'the first one runs')
        simulated = command('-p', 'use_sim_time:=true')  # another time than that of the first one
        second = subprocess.run(simulated, capture_output=True, text=True, timeout=60.0)
        assert second.returncode == 1
        assert 'this one gives way' in second.stderr and 'Traceback' not in second.stderr
        assert first.poll() is None
    finally:
        first.send_signal(signal.SIGINT)
        assert first.wait(60.0) == 0
        ears.close()


@pytest.mark.long
@pytest.mark.parametrize(('age', 'begun', 'host', 'ends'), [
    (3600, '2000', 'host', False), (0, '9999', 'host', False), (0, '2000', 'host', True),
    (30, '2000', 'host', True), (30, '2000', gethostname(), False)])
def test_it_gives_way_to_what_runs_now_and_began_before_it(tmp_path, age, begun, host, ends):
    ears = Listener('told')
    topic = ears.node.create_publisher(DiagnosticArray, '/diagnostics', 10)
    then = (datetime.now(UTC) - timedelta(seconds=age)).isoformat()
    report = DiagnosticArray(status=[DiagnosticStatus(name='/told/driver: rig', values=[
        KeyValue(key='process', value=f'{begun} {host} 1 {then}')])])
    driver = DriverProcess('told', bus__channel=str(tmp_path / 'none.can'),
                           diagnostics_period=0.1)
    try:
        wait_for(lambda: ears.diagnoses and topic.get_subscription_count(), 'it listens')
        for _ in range(20):
            topic.publish(report)
        count = len(ears.diagnoses)
        wait_for(lambda: driver.process.poll() is not None or len(ears.diagnoses) > count + 40,
                 'it has heard')
        assert (driver.process.poll() == 1) is ends
    finally:
        driver.close()
        ears.close()
