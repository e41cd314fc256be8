"""The driver's transitions and parameters, led by hand; and a drive that stays broken."""

from driver_bench import DriverProcess, Listener, wait_for
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, SetParameters
from rclpy.parameter import Parameter as RosParameter
from scripted_rig import DISABLED, ENABLED, FAULT, ScriptedRig
from way_back import knows_the_way_back
import yaml

from servo_rig_driver.can_bus.can_hub import CanHub
from servo_rig_driver.driver.driver_parameters import DECLARED

pytestmark = pytest.mark.ros

CONFIGURE, CLEANUP = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_CLEANUP
ACTIVATE, DEACTIVATE = Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_DEACTIVATE


class Hands:
    """Calls the services of one driver."""

    def __init__(self, ears: Listener) -> None:
        self.node = ears.node

    def call(self, kind: type, name: str, **request: object):
        client = self.node.create_client(kind, f'driver/{name}')
        wait_for(client.service_is_ready, f'there is a service {name}')
        knows_the_way_back(self.node, 'driver', lambda heard: wait_for(heard, 'it answers'))
        future = client.call_async(kind.Request(**request))
        wait_for(future.done, f'{name} answers')
        self.node.destroy_client(client)
        return future.result()

    def change(self, transition: int) -> bool:
        return self.call(ChangeState, 'change_state',
                         transition=Transition(id=transition)).success

    def state(self) -> str:
        return self.call(GetState, 'get_state').current_state.label

    def set(self, name: str, value: float | bool | str):
        given = RosParameter(name, value=value).to_parameter_msg().value
        return self.call(SetParameters, 'set_parameters',
                         parameters=[Parameter(name=name, value=given)]).results[0]


@pytest.fixture(scope='module')
def led(tmp_path_factory):
    """A driver that waits for a hand, on a bus with a rig that has one fault reset."""
    channel = str(tmp_path_factory.mktemp('led') / 'rig.can')
    with CanHub(channel), ScriptedRig(channel) as rig:
        ears = Listener('led')
        driver = DriverProcess('led', bus__channel=channel, autostart='false', block_size=10,
                               sync_period=0.002, fault_resets=1, fault_reset_pause=0.05,
                               diagnostics_period=0.2)
        try:
            yield rig, ears, Hands(ears)
        finally:
            driver.close()
            ears.close()


BREAKS = """
from servo_rig_driver.driver.driver_node import main
from servo_rig_driver.driver.sampler import Sampler
check, looks = Sampler.check, []
def breaks(self, now):
    looks.append(now)
    if len(looks) == 50:
        raise ValueError('an error of this program')
    check(self, now)
Sampler.check = breaks
raise SystemExit(main())
"""


def test_a_link_that_stopped_by_an_error_is_activated_after_it_is_configured_alone(tmp_path):
    channel = str(tmp_path / 'rig.can')
    with CanHub(channel), ScriptedRig(channel) as rig:
        ears = Listener('breaking')
        driver = DriverProcess('breaking', start=('-c', BREAKS), bus__channel=channel)
        try:
            hands = Hands(ears)
            ears.hears('bus', 'the link has stopped: ValueError', 2)
            wait_for(lambda: rig.status == DISABLED, 'the drive has no torque')
            assert hands.change(DEACTIVATE)
            assert not hands.change(ACTIVATE)
            assert hands.change(CLEANUP) and hands.change(CONFIGURE) and hands.change(ACTIVATE)
            wait_for(lambda: rig.status == ENABLED, 'the drive is enabled')
        finally:
            driver.close()
            ears.close()


def test_it_follows_its_lifecycle_and_leaves_the_drive_disabled(led):
    rig, ears, hands = led
    assert hands.state() == 'unconfigured'
    ears.hears('bus', 'the bus is not open: the driver is not configured', 2)
    assert hands.change(CONFIGURE)
    ears.hears('bus', 'ok', 0)
    assert rig.count == 0
    assert hands.change(ACTIVATE)
    wait_for(lambda: rig.status == ENABLED, 'the drive is enabled')
    wait_for(lambda: ears.current, 'samples come')
    wait_for(lambda: any(one[1] == 3.0 for one in rig.taken)
             or ears.command(1, [3.0], ears.now()), 'a command is heard in time and played')
    assert hands.change(DEACTIVATE)
    assert rig.status == DISABLED
    assert rig.taken[-1][1] == 0.0
    asked, last = rig.count, ears.current[-1].sequence
    assert hands.change(ACTIVATE)
    wait_for(lambda: rig.count > asked, 'SYNC runs again')
    wait_for(lambda: ears.current[-1].sequence > last + 10, 'the sequence runs on')
    assert hands.change(DEACTIVATE)
    assert hands.change(CLEANUP)
    assert hands.state() == 'unconfigured'
    ears.hears('bus', 'the bus is not open', 2)


def test_it_lives_on_after_a_transition_that_does_not_fit_its_state(led):
    rig, ears, hands = led
    assert not hands.change(ACTIVATE)
    assert hands.state() == 'unconfigured'
    assert hands.change(CONFIGURE)
    assert hands.change(ACTIVATE)
    wait_for(lambda: rig.status == ENABLED, 'the drive is enabled')
    for wrong in (CONFIGURE, ACTIVATE, Transition.TRANSITION_CALLBACK_SUCCESS, 255):
        assert not hands.change(wrong)
    assert hands.state() == 'active'
    ears.more_samples(10)
    assert rig.status == ENABLED
    assert hands.change(DEACTIVATE)
    assert hands.change(CLEANUP)


def test_it_is_not_activated_while_two_publish_commands(led):
    rig, ears, hands = led
    assert hands.change(CONFIGURE)
    other = Listener('led')
    try:
        ears.hears('command', "2 publishers on command, of ['/led/listener', '/led/listener']", 2)
        assert not hands.change(ACTIVATE)
        assert hands.state() == 'inactive'
        assert rig.count == 0 or rig.status == DISABLED
    finally:
        other.close()
    ears.hears('command', 'ok', 0)
    assert hands.change(ACTIVATE)
    wait_for(lambda: rig.status == ENABLED, 'the drive is enabled')
    assert hands.change(DEACTIVATE)
    assert hands.change(CLEANUP)


def test_it_gives_a_broken_drive_up_until_it_is_activated_again(led):
    rig, ears, hands = led
    assert hands.change(CONFIGURE)
    assert hands.change(ACTIVATE)
    wait_for(lambda: rig.status == ENABLED, 'the drive is enabled')
    rig.stubborn = True
    rig.fail(0x3210)
    ears.hears('drive', 'reset 1 of 1 times, given up', 2)
    assert rig.status == FAULT
    rig.stubborn = False
    assert hands.change(DEACTIVATE)
    assert hands.change(ACTIVATE)
    wait_for(lambda: rig.status == ENABLED, 'the drive is enabled again')
    assert hands.change(DEACTIVATE)
    assert hands.change(CLEANUP)


def test_it_says_why_it_cannot_be_configured(led):
    _, ears, hands = led
    refused = hands.set('limit.position_lower', 100.0)
    assert 'is above limit.position_upper' in refused.reason
    parameters = [Parameter(name='dictionaries', value=ParameterValue(
        type=ParameterType.PARAMETER_STRING, string_value='nowhere'))]
    hands.call(SetParameters, 'set_parameters', parameters=parameters)
    assert not hands.change(CONFIGURE)
    ears.hears('bus', "'nowhere' is neither a folder nor one of the shipped sets", 2)
    parameters[0].value.string_value = 'rv_bench'
    hands.call(SetParameters, 'set_parameters', parameters=parameters)
    assert hands.change(CONFIGURE)
    ears.hears('bus', 'ok', 0)


def test_it_judges_parameters_while_it_is_configured(led):
    _, _, hands = led
    if hands.state() == 'unconfigured':  # where no test before has configured it
        assert hands.change(CONFIGURE)
    assert 'command_timeout' in hands.set('command_timeout', -1.0).reason
    assert hands.set('command_timeout', 0.2).successful
    assert 'in real time' in hands.set('use_sim_time', True).reason
    assert 'clean the node up first' in hands.set('sync_period', 0.005).reason


def test_it_refuses_a_value_of_a_type_that_ros_does_not_have(led):
    _, _, hands = led
    told = hands.call(SetParameters, 'set_parameters', parameters=[
        Parameter(name='limit.current', value=ParameterValue(type=77))]).results[0]
    assert not told.successful and 'cannot be undeclared' in told.reason
    assert hands.set('limit.current', 4.0).successful


def test_it_describes_every_parameter_with_unit_and_range(led):
    _, _, hands = led
    names = [declared.name for declared in DECLARED]
    told = hands.call(DescribeParameters, 'describe_parameters', names=names).descriptors
    for declared, descriptor in zip(DECLARED, told, strict=True):
        assert descriptor.description
        assert f'[{declared.unit}]' in descriptor.description or not declared.unit
        numeric = isinstance(declared.default, (int, float)) and not isinstance(
            declared.default, bool)
        assert bool(descriptor.floating_point_range or descriptor.integer_range) == numeric


def test_it_ships_a_file_with_all_its_parameters():
    from driver_bench import CONFIG
    shipped = yaml.safe_load(CONFIG.read_text())['/**/driver']['ros__parameters']
    flat = {}
    for key, entry in shipped.items():
        flat.update({f'{key}.{name}': value for name, value in entry.items()}
                    if isinstance(entry, dict) else {key: entry})
    expected = {declared.name: declared.default for declared in DECLARED}
    # a value of the bench, which another drive must not get by default
    assert flat == expected | {'motor_torque_constant': 0.4878}
    assert expected['motor_torque_constant'] == 0.0


def test_it_settles_which_of_two_drivers_stays_when_both_start_at_once(tmp_path):
    channel = str(tmp_path / 'rig.can')
    with CanHub(channel), ScriptedRig(channel) as rig:
        names = ('left', 'right')
        ears = [Listener(name) for name in names]
        drivers = [DriverProcess(name, bus__channel=channel, block_size=10,
                                 diagnostics_period=0.2) for name in names]

        def streaming() -> list[bool]:
            counts = [len(each.encoder) for each in ears]
            wait_for(lambda: any(len(each.encoder) > count + 30
                                 for each, count in zip(ears, counts, strict=True)), 'samples')
            return [len(each.encoder) > count for each, count in zip(ears, counts, strict=True)]

        try:
            wait_for(lambda: rig.status == ENABLED and sum(streaming()) == 1,
                     'one of them runs the rig')
            other = streaming().index(False)
            wait_for(lambda: drivers[other].process.poll() == 1 or any(
                'another driver is on this bus' in status.message
                for diagnosis in ears[other].diagnoses for status in diagnosis.status),
                'the other one says why it stays away')
        finally:
            for thing in (*drivers, *ears):
                thing.close()


@pytest.mark.parametrize('values,words', [
    ({'sync_period': 0.5}, 'sync_period'), ({'block_size': 0}, 'block_size'),
    ({'sync_period': "'fast'"}, 'sync_period'),
    ({'diagnostics_period': 5.0}, 'diagnostics_period'),  # another of its name listens for 3 s
    ({'use_sim_time': 'true'}, 'a driver samples a rig in real time')])
def test_it_names_a_parameter_that_it_cannot_start_with(values, words):
    status, said = DriverProcess('wrong', **values).wait()
    assert status == 2
    assert words in said.splitlines()[-1]
    assert 'Traceback' not in said


def test_it_says_that_the_nodes_cannot_count_a_period():
    ears = Listener('odd')
    driver = DriverProcess('odd', sync_period=0.001 / 3)
    try:
        ears.hears('bus', 'give a multiple of 1e-06 s', 2)
    finally:
        driver.close()
        ears.close()
