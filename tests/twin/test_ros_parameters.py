"""What `ros2 param dump` writes of a node can be given to it at its next start."""

import pytest
import rclpy
from rclpy.parameter import Parameter
import yaml

from servo_identify.nodes import identify_parameters
from servo_rig_driver.driver.driver_node import Driver
from servo_twin.nodes.twin_node import TwinNode


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
