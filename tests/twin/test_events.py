"""Changes of a running twin travel as events, stand in the bag, and a replay obeys them."""

from dataclasses import replace
import signal
import subprocess
import sys

from bench_recording import bench_recording, SERVO
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import pytest
from std_msgs.msg import String
from test_twin_node import graph, samples, servo_files  # noqa: F401  (fixtures)

from servo_twin.bag import read_changes
from servo_twin.balances.residual_filters import half_of, WINDOW
from servo_twin.cli import main
from servo_twin.description.servo_file import load
from servo_twin.lockstep.whole_recording import answer, differences, seen_by
from servo_twin.nodes.message_conversion import TOPICS
from servo_twin.nodes.topic_qos import EVENTS
from servo_twin_msgs.msg import Event

pytestmark = pytest.mark.ros


def test_a_replay_is_the_live_run_to_the_last_bit_though_a_parameter_was_set(
        graph, servo_files, tmp_path, capsys):  # noqa: F811
    bag, heard = tmp_path / 'bag', []
    recorder = subprocess.Popen(
        [sys.executable, '-m', 'servo_rig_driver.record.recorder_node', '--ros-args', '-r',
         '__ns:=/rig', '-p', f'output:={bag}', '-p', f'servo_file:={servo_files}/bench.yaml'],
        stdout=subprocess.DEVNULL)
    try:
        rig = graph('rig', 'catch:=0.1')
        counted = {}
        rig.node.create_subscription(
            DiagnosticArray, '/diagnostics', lambda message: counted.update(
                (pair.key, int(pair.value)) for status in message.status for pair in status.values
                if pair.key.startswith('messages ')), 10)
        every = [f'messages /rig/{topic}' for topic in (*TOPICS, 'twin/prediction',
                                                         'twin/residual')]
        rig.wait(lambda: rig.told and all(counted.get(topic) for topic in every)
                 or rig.say(0, samples(0)))  # empty blocks, until the recorder has them all
        rig.ready()
        for k in range(0, 300, 10):
            rig.say(k, samples(10, 1.0))
        rig.wait(lambda: len(rig.predictions) == 30)
        assert rig.set('drive.gain', 0.2).successful
        notes = rig.node.create_publisher(String, '/rig/note', 10)
        rig.node.create_subscription(Event, '/rig/events', heard.append, EVENTS)
        rig.wait(lambda: {'note', 'parameters'} <= {e.kind for e in heard} or notes.publish(
            String(data='oil changed')))  # again and again: the recorder may not hear the first
        for k in range(300, 600, 10):
            rig.say(k, samples(10, 1.0))
        rig.wait(lambda: len(rig.predictions) == 60)
        down = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_DEACTIVATE))
        assert rig.ask(ChangeState, 'twin/change_state', down).success
        rig.wait(lambda: len(rig.residuals) == 60)
    finally:
        recorder.send_signal(signal.SIGINT)
        recorder.wait(20.0)
    assert [(c.sequence, c.values) for c in read_changes(bag)] == [(300, {'drive.gain': 0.2})]
    main(['replay', str(bag), '--compare', '--page', str(tmp_path / 'page.html')])
    told = capsys.readouterr().out
    assert 'identical to the last bit' in told
    assert 'drive.gain = 0.2' in told and 'oil changed' in told
    page = (tmp_path / 'page.html').read_text()
    assert '<td>/rig/twin</td><td>parameter</td><td>drive.gain = 0.2</td>' in page
    assert '<td>/rig/recorder</td><td>note</td><td>oil changed</td>' in page


def test_a_bag_that_ends_before_the_twin_is_compared_as_far_as_the_twin_had_seen():
    servo = load(SERVO)
    recording = bench_recording(coulomb=30.0)
    whole = answer(recording, servo)
    half = half_of(WINDOW, recording.period)
    cut = len(whole) - 3 * half

    def until(end):
        return replace(whole, **{part: {name: column[:end] for name, column in getattr(
            whole, part).items()} for part in ('prediction', 'residual')})

    live = until(cut)  # its last residuals are there: the twin had seen half a window more
    assert len(seen_by(recording, live)) == cut + half
    assert not any(differences(live, answer(seen_by(recording, live), servo)).values())
    assert len(seen_by(recording, until(len(whole)))) == len(whole)
