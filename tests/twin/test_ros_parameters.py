"""What a node is given at its start: what `ros2 param dump` wrote, and no name that it lacks."""

import pytest
import rclpy
from rclpy.parameter import Parameter
import yaml

from servo_identify.nodes import identify_parameters
from servo_identify.nodes.identify_node import IdentifyNode
from servo_rig_driver.adapter.adapter_node import Adapter
from servo_rig_driver.driver.driver_node import Driver
from servo_rig_driver.record.recorder_node import Recorder
from servo_twin.nodes.twin_node import SUCCESS, TwinNode


def dumped(node):
    """Return the parameters of a node as ros2param writes them: nested by the dots of names."""
    nested = {}
    for name in sorted(node._parameters):
        value, place = node._parameters[name].value, nested
        *above, last = name.split('.')
        for key in above:
            place = place.setdefault(key, {})
        place[last] = list(value) if isinstance(value, (tuple,)) or hasattr(
            value, 'typecode') else value
    return yaml.dump({node.get_fully_qualified_name(): {'ros__parameters': nested}},
                     default_flow_style=False)


def driver():
    return Driver()


def twin():
    node = TwinNode()
    node.trigger_configure()
    return node


def identify():
    node = rclpy.create_node('identify')
    identify_parameters.declare(node)
    return node


def values(node):
    return {name: list(p.value) if hasattr(p.value, '__len__') and not isinstance(p.value, str)
            else p.value for name, p in node._parameters.items()}


@pytest.mark.parametrize('make', [driver, twin, identify])
def test_a_dump_of_its_parameters_can_be_loaded(make, tmp_path):
    file = tmp_path / 'dump.yaml'
    kept = []
    for arguments in ([], ['--params-file', str(file)]):
        rclpy.init(args=['--ros-args', '-r', '__ns:=/rig', *arguments])
        node = make()
        kept.append(values(node))
        file.write_text(dumped(node))
        node.destroy_node()
        rclpy.try_shutdown()
    assert kept[0] == kept[1]
    assert len(kept[0]) > 8


@pytest.fixture
def started():
    """Give a function that starts ROS with arguments, and end it afterwards."""
    yield lambda *words: rclpy.init(args=['--ros-args', *words])
    rclpy.try_shutdown()


@pytest.mark.parametrize('make, wrong, right', [
    (Driver, 'limmit.voltage', 'limit.voltage'), (Adapter, 'jiont', 'joint'),
    (Recorder, 'outputt', 'output'), (lambda: IdentifyNode(None, None), 'watch.onn', 'watch.on')])
def test_a_name_that_no_parameter_has_is_refused_at_the_start(started, make, wrong, right):
    started('-p', 'use_sim_time:=false', '-p', f'{wrong}:=1.0')
    with pytest.raises(ValueError, match=f"has no parameter '{wrong}'.* did you mean '{right}'"):
        make()


def test_a_recorder_refuses_what_it_reads_at_the_start_only(started, tmp_path):
    started('-p', f'output:={tmp_path / "bag"}')
    node = Recorder()
    try:
        result = node.set_parameters([Parameter('output', value=str(tmp_path / 'other'))])[0]
        assert not result.successful
        assert 'read-only' in result.reason
    finally:
        node.close()
        node.destroy_node()


@pytest.mark.parametrize('wrong, right', [
    ('mdoe', 'mode'), ('effects.coulomb.levle', 'effects.coulomb.level')])
def test_a_twin_is_not_configured_with_a_name_that_its_servo_does_not_have(
        started, wrong, right, capfd):
    started('-p', f'{wrong}:=1.0')
    node = TwinNode()
    try:
        assert node.trigger_configure() != SUCCESS
        assert f"has no parameter '{wrong}'" in (said := capfd.readouterr().err)
        assert f"did you mean '{right}'" in said
    finally:
        node.destroy_node()


def test_what_ros_itself_gives_a_node_is_taken(started, tmp_path):
    file = tmp_path / 'all.yaml'
    file.write_text('/**: {ros__parameters: {start_type_description_service: false, '
                    'qos_overrides: {/rig/encoder: {publisher: {depth: 2000}}}, '
                    'command_timeout: 0.2}}')
    started('--params-file', str(file))
    node = Driver()
    try:
        assert node.get_parameter('command_timeout').value == 0.2
    finally:
        node.destroy_node()


def test_the_identify_node_refuses_what_it_reads_at_the_start_only():
    rclpy.init()
    node = identify()
    try:
        for name, value, taken in (('buffer', 10.0, False), ('watch.learn', 5.0, False),
                                   ('watch.block', 0.1, False), ('online.period', 2.0, False),
                                   ('watch.false_alarms', 0.2, False), ('margin', 0.1, True),
                                   ('trial', 5.0, True), ('online.time_constant', 9.0, True)):
            result = node.set_parameters([Parameter(name, value=value)])[0]
            assert result.successful is taken, name
            assert taken or 'read-only' in result.reason
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
