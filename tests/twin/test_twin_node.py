"""The twin node, as a process of its own fed over ROS 2: it ..."""

from array import array
from math import nan
import os
import subprocess
import sys
from types import SimpleNamespace

from lifecycle_msgs.msg import Transition
import numpy as np
import pytest
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
import rclpy
from twin_graph import BENCH, ends_of, PERIOD, samples

from servo_twin.description import servo_file
from servo_twin.lockstep.lockstep import Lockstep, Settings
from servo_twin.lockstep.twin import Twin
from servo_twin.nodes.live_answers import LiveAnswers
from servo_twin.nodes.message_conversion import to_time
from servo_twin.nodes.servo_loading import ServoLoading
from servo_twin.nodes.twin_health import TwinHealth
from servo_twin.recording.joined_samples import CHANNELS
from servo_twin.recording.recording import BALANCES
from servo_twin.recording.waiting_blocks import Block, WaitingBlocks
from servo_twin_msgs.msg import Current, Encoder, Torque
from servo_twin_msgs.srv import LoadServo

pytestmark = pytest.mark.ros


def test_it_answers_every_sample_bit_for_bit_as_the_twin_does_on_arrays(rig):
    for k in range(300):
        rig.say(k, samples(1))
    rig.wait(lambda: len(rig.predictions) == 300 and len(rig.residuals) == 280)
    assert [m.sequence for m in rig.predictions] == list(range(300))
    assert [m.sequence for m in rig.residuals] == list(range(280))
    assert all(m.header.stamp == to_time(10**18 + m.sequence * 1_000_000)
               for m in rig.predictions + rig.residuals)
    y = Twin(servo_file.loads(BENCH), PERIOD, catch=0.0).step(0, samples(300))
    assert [m.load_position[0] for m in rig.predictions] == y[:, 1].tolist()
    assert abs(rig.residuals[100].load[0]) > 100.0
    assert rig.residuals[0].channel_noise.tolist() == [2e-4, 1e-6, 0.1, 0.005]
    assert len(rig.residuals[0].balance_noise) == len(BALANCES)
    rig.wait(lambda: any('beyond the noise floor: drive, load' in s.message for s in rig.told))


def test_it_takes_a_value_from_the_next_sample_on_and_says_what_it_refuses(graph):
    rig = graph('rig', 'drive.gain:=0.4').ready()
    rig.say(0, samples(10))
    rig.wait(lambda: len(rig.predictions) == 1)
    assert rig.predictions[0].current[1:] == array('d', [0.4] * 9)
    assert rig.set('drive.gain', 0.25).successful
    rig.say(10, samples(10))
    rig.wait(lambda: len(rig.predictions) == 2)
    assert rig.predictions[1].current == array('d', [0.4] + [0.25] * 9)

    refused = rig.set('effects.bearing.level', -1.0)
    assert not refused.successful and 'effects.bearing.level' in refused.reason
    strange = Parameter(name='drive.gain', value=ParameterValue(type=77))  # ROS has 10 types
    refused = rig.ask(SetParameters, 'twin/set_parameters',
                      SetParameters.Request(parameters=[strange])).results[0]
    assert not refused.successful and 'cannot be undeclared' in refused.reason
    refused = rig.set('mode', 'closed_loop')
    assert not refused.successful and 'closed_loop needs a controller' in refused.reason
    refused = rig.set('servo_file', 'elsewhere.yaml')
    assert not refused.successful and 'twin/load_servo' in refused.reason
    assert rig.set('mode', 'observer').successful
    values = rig.ask(GetParameters, 'twin/get_parameters', GetParameters.Request(
        names=['drive.gain', 'effects.bearing.level', 'mode'])).values
    assert [v.double_value for v in values[:2]] == [0.25, 20.0]
    assert values[2].string_value == 'observer'
    described = rig.ask(DescribeParameters, 'twin/describe_parameters', DescribeParameters.Request(
        names=['effects.bearing.level'])).descriptors[0]
    assert 'N m' in described.description
    assert described.floating_point_range[0].from_value == 0.0


def test_it_loads_another_servo_without_missing_a_sample(graph, servo_files):
    rig = graph('rig', 'overload:=60.0').ready()
    rig.say(0, samples(10))
    rig.wait(lambda: len(rig.predictions) == 1)
    refused = rig.ask(LoadServo, 'twin/load_servo', LoadServo.Request(content='servo: x'))
    assert not refused.success and "section 'drive' is missing" in refused.message
    refused = rig.ask(LoadServo, 'twin/load_servo', LoadServo.Request())
    assert not refused.success and 'either the path' in refused.message

    sent = [10]

    def feed() -> None:
        rig.say(sent[0], samples(10))
        sent[0] += 10

    timer = rig.node.create_timer(0.01, feed)
    loaded = rig.ask(LoadServo, 'twin/load_servo',
                     LoadServo.Request(path=f'{servo_files}/other.yaml'))
    assert loaded.success and loaded.message == (
        'other runs in place of bench; its state was kept. After a cleanup, configure reads '
        f"servo_file = '{servo_files}/bench.yaml' as before")
    assert servo_file.loads(loaded.previous).values == servo_file.loads(BENCH).values
    rig.node.destroy_timer(timer)
    assert rig.set('effects.seal.level', 5.0).successful
    rig.wait(lambda: ends_of(rig.predictions)[-1] == sent[0])
    # a twin that fell behind on a busy machine answers by larger blocks
    assert [m.sequence for m in rig.predictions] == [0, *ends_of(rig.predictions)[:-1]]
    assert rig.predictions[-1].restarts == 0
    for transition in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP,
                       Transition.TRANSITION_CONFIGURE):
        rig.goes(transition)
    assert rig.set('effects.bearing.level', 5.0).successful  # of the file of the parameter


def test_it_bridges_a_short_gap_and_begins_anew_after_a_long_one(graph):
    rig = graph('rig', 'bridge:=50').ready()
    for start in (0, 10, 40, 50):
        rig.say(start, samples(10))
    rig.say(60, samples(10), lack='torque')
    rig.say(70, samples(10))
    rig.say(500, samples(10))
    rig.wait(lambda: len(rig.predictions) == 6)
    assert [(m.sequence, m.restarts) for m in rig.predictions] == [
        (0, 0), (10, 0), (40, 0), (50, 0), (70, 0), (500, 1)]
    rig.wait(lambda: any('began again 1 times' in s.message for s in rig.told))
    facts = {v.key: v.value for v in rig.told[-1].values}
    assert (facts['bridged'], facts['restarts']) == ('30', '1')
    assert int(facts['blocks given up']) >= 1  # one, and what was said before all were linked
    assert facts['last restart'].startswith('420 samples were missing before 500')


def test_it_passes_over_a_block_whose_arrays_differ_in_length(rig):
    rig.topics['encoder'].publish(Encoder(
        sequence=1, period=PERIOD, motor_position=[0.0], load_position=[0.0]))
    rig.topics['torque'].publish(Torque(sequence=1, period=PERIOD))
    rig.topics['current'].publish(Current(sequence=1, period=PERIOD))
    rig.say(2, samples(1))
    rig.wait(lambda: len(rig.predictions) == 1)
    assert rig.predictions[0].sequence == 2
    rig.wait(lambda: any('torque.torque of sequence 1 has 0 samples' in s.message
                         for s in rig.told))


@pytest.mark.parametrize('odd', [
    {'period': nan}, {'period': 5e-324}, {'period': 1e300}, {'sequence': 2**64 - 1},
    {'second': 2**31 - 1}, {'second': -1}], ids=str)
def test_it_lives_on_after_a_block_that_no_rig_can_have_sent(rig, odd):
    rig.say(**{'sequence': 0, 'samples': samples(10), **odd})
    rig.say(0, samples(20))
    rig.wait(lambda: any(one.sequence == 0 and len(one.motor_position) == 20
                         for one in rig.predictions))


def test_a_block_that_breaks_the_step_is_left_out_and_told():
    def breaks(period):
        raise MemoryError('no room')

    answers = LiveAnswers(SimpleNamespace(get_parameter=lambda _: SimpleNamespace(value=2.0)),
                          breaks)
    answers.active = True
    answers._waiting.put(Block(0, 10**18, PERIOD, samples(1)))
    answers._step_all()
    assert (answers.health.malformed, answers.health.why) == (1, 'MemoryError: no room')


def test_it_publishes_what_it_owes_when_it_is_deactivated_and_begins_anew_afterwards(rig):
    for k in range(5):
        rig.say(k, samples(10))
    rig.wait(lambda: len(rig.predictions) == 5)
    rig.goes(Transition.TRANSITION_DEACTIVATE)
    rig.wait(lambda: len(rig.residuals) == 5)
    assert np.isnan(rig.residuals[-1].load).all()
    rig.goes(Transition.TRANSITION_ACTIVATE)
    rig.say(500, samples(10))
    rig.wait(lambda: len(rig.predictions) == 6)
    assert (rig.predictions[-1].sequence, rig.predictions[-1].restarts) == (500, 0)


def test_it_lives_on_after_a_transition_that_does_not_fit_its_state(rig):
    for wrong in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE,
                  Transition.TRANSITION_CALLBACK_SUCCESS, 255):
        assert not rig.makes(wrong)
    rig.say(2, samples(10))
    rig.wait(lambda: len(rig.predictions) == 1)


def test_it_runs_beside_another_rig_in_another_namespace(graph):
    left, right = graph('left'), graph('right', 'drive.gain:=0.1')
    left.ready()
    right.ready()
    for k in range(0, 100, 10):
        left.say(k, samples(10, 1.0))
        right.say(k, samples(10, 2.0))
    left.wait(lambda: len(left.predictions) == len(right.predictions) == 10)
    assert left.predictions[-1].current[0] == pytest.approx(0.49)
    assert right.predictions[-1].current[0] == pytest.approx(0.2)


def test_it_says_what_is_wrong_with_a_servo_file_and_waits_to_be_configured(servo_files):
    (servo_files / 'bad.yaml').write_text(BENCH.replace('gain', 'gian'))
    process = subprocess.Popen(
        [sys.executable, '-m', 'servo_twin.nodes.twin_node', '--ros-args', '-p', 'autostart:=true',
         '-p', f'servo_file:={servo_files}/bad.yaml'],
        stderr=subprocess.PIPE, text=True, env=os.environ | {'RCUTILS_COLORIZED_OUTPUT': '0'})
    said = process.stderr.readline()
    process.terminate()
    rest = process.communicate(timeout=60.0)[1]
    assert process.returncode == 0, rest
    assert "bad.yaml: drive has no parameter 'gian'; did you mean 'gain'?" in said


def test_it_says_on_diagnostics_that_it_cannot_be_configured(graph):
    rig = graph('rig', 'servo_file:=no_such_servo')
    rig.wait(lambda: rig.told)
    assert rig.told[-1].level == b'\x02'
    assert "cannot be configured: 'no_such_servo' is neither a file nor shipped" in (
        rig.told[-1].message)


def test_a_level_rises_at_once_and_falls_when_it_stayed_better_for_a_while():
    health = TwinHealth()
    well, lost = (0, 'well'), (1, 'lost')
    told = [health._steady(*each)[0] for each in (well, lost, well, lost, well, well, well)]
    assert told == [0, 1, 1, 1, 1, 1, 0]


@pytest.mark.parametrize(('lost', 'level', 'said'), [
    ((), 0, 'the rig does what the twin says'),
    (('voltage',), 1, 'no command is known (voltage): the twin runs on the last one, or on none'),
    (('voltage', 'motor_position', 'load_position'), 1, 'nothing can be compared'),
    (('torque',), 1, 'not known: torque')])
def test_it_does_not_call_well_what_nobody_measured(lost, level, said):
    health = TwinHealth()
    line = Lockstep(servo_file.loads(BENCH), PERIOD, Settings(catch=0.0))
    quiet = np.zeros((200, len(CHANNELS)))
    for name in lost:
        quiet[:, CHANNELS.index(name)] = np.nan
    for begin in (0, 200):
        _, due = line.step(begin, 0, quiet)
        health.predicted(quiet, 0.0)
    for residual in due:
        health.compared(residual.values, 0.0)
    found = health.report(line, 0, (), WaitingBlocks())
    assert found[0] == level and said in found[1]
    assert found[2].get('not known', '').split(', ')[-1] in ('', *lost)


def test_its_service_follows_the_remaps_of_the_process_under_a_name_of_its_own():
    rclpy.init(args=['--ros-args', '-r', 'twin/load_servo:=exchange', '-r', '__node:=mine'])
    node = rclpy.create_node('twin', namespace='/rig')
    loading = ServoLoading(node)
    try:
        assert node.get_name() == 'mine'
        names = dict(loading._node.get_service_names_and_types_by_node('mine_loader', '/rig'))
        assert '/rig/exchange' in names
    finally:
        loading.close()
        node.destroy_node()
        rclpy.try_shutdown()


def test_it_answers_in_the_frame_of_the_samples(rig):
    for k in range(0, 100, 10):
        rig.say(k, samples(10), frame='rig/base_link')
    rig.wait(lambda: rig.predictions and rig.residuals)
    assert rig.predictions[-1].header.frame_id == rig.residuals[-1].header.frame_id == (
        'rig/base_link')


def test_the_qos_of_its_topics_can_be_overridden(graph):
    override = 'qos_overrides./rig/twin/prediction.publisher.reliability:=best_effort'
    rig = graph('rig', override)
    rig.wait(lambda: rig.told and rig.node.get_publishers_info_by_topic('/rig/twin/prediction'))
    infos = [rig.node.get_publishers_info_by_topic(f'/rig/twin/{topic}')[0].qos_profile
             for topic in ('prediction', 'residual')]
    assert [info.reliability.name for info in infos] == ['BEST_EFFORT', 'RELIABLE']


def test_a_value_that_it_has_can_be_set_though_it_is_read_on_configure(rig, servo_files):
    assert rig.set('balance_window', 0.04).successful
    assert rig.set('servo_file', f'{servo_files}/bench.yaml').successful
    assert not rig.set('balance_window', 0.05).successful
