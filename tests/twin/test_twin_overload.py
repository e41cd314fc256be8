"""A twin that cannot keep up says so, catches up by larger blocks, and in the end begins again."""

from pathlib import Path

import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from twin_graph import PERIOD, Rig, samples
import yaml

from servo_twin.nodes.twin_node import SUCCESS, TwinNode
from servo_twin.recording.joined_samples import CHANNELS
from servo_twin.recording.waiting_blocks import Block, WaitingBlocks

pytestmark = pytest.mark.ros
ROOT = Path(__file__).resolve().parents[2]


def block(sequence, size=10, value=0.0):
    return Block(sequence, sequence * 10**6, 1e-3, np.full((size, 3), value))


def test_blocks_in_time_pass_as_they_came_and_late_ones_are_joined_where_they_continue():
    waiting = WaitingBlocks()
    waiting.put(block(0))
    waiting.put(block(10))
    assert [b.sequence for b in waiting.take(2.0)] == [0, 10]
    for k in (*range(0, 2000, 10), *range(2500, 2520, 10)):
        waiting.put(block(k, value=k))
    joined = waiting.take(5.0)
    assert [(b.sequence, len(b.samples)) for b in joined] == [(0, 1000), (1000, 1000), (2500, 20)]
    assert joined[1].stamp == 1000 * 10**6
    assert joined[1].samples[15, 0] == 1010.0
    assert (waiting.joined, waiting.left_out) == (199, 0)


def test_a_block_that_no_driver_sends_is_answered_in_parts_between_which_a_signal_is_heard():
    waiting = WaitingBlocks()
    waiting.put(block(70, size=10_000, value=np.arange(10_000.0)[:, None]))
    parts = waiting.take(60.0)
    assert [(one.sequence, len(one.samples)) for one in parts] == [
        (70, 4096), (4166, 4096), (8262, 1808)]
    assert [one.stamp // 10**6 for one in parts] == [70, 4166, 8262]
    assert [one.samples[0, 0] for one in parts] == [0.0, 4096.0, 8192.0]


def test_past_the_limit_only_the_newest_is_kept_and_the_rest_counted():
    waiting = WaitingBlocks()
    for k in range(0, 3000, 10):
        waiting.put(block(k))
    assert [b.sequence for b in waiting.take(2.0)] == [2990]
    assert waiting.left_out == 2990
    assert waiting.worst == pytest.approx(3.0)


class HeldRig(Rig):
    """A rig whose twin is a node of this process, which works only while a test waits."""

    def begin(self, file, *_):
        self.twin = TwinNode(context=self.node.context, namespace=self.name, parameter_overrides=[
            Parameter('servo_file', value=file), Parameter('catch', value=0.0)])
        assert self.twin.trigger_configure() == self.twin.trigger_activate() == SUCCESS
        self.executor.add_node(self.twin)


@pytest.fixture
def held_rig(servo_files):
    context = Context()
    rclpy.init(context=context)
    node, executor = rclpy.create_node('feeder', context=context), EventsExecutor(context=context)
    executor.add_node(node)
    rig = HeldRig(node, executor, 'held', f'{servo_files}/bench.yaml')
    yield rig
    for one in (rig.twin, node):
        executor.remove_node(one)
        one.destroy_node()
    rclpy.try_shutdown(context=context)


@pytest.mark.parametrize('held', [1.5, 4.0])
def test_a_twin_that_was_held_up_says_how_far_it_is_behind(held_rig, held):
    rig = held_rig.ready()
    for k in range(0, round(held / PERIOD), 10):
        rig.say(k, samples(10))
    for topic in rig.topics.values():  # all of it waits, however busy the machine is
        assert topic.wait_for_all_acked(Duration(seconds=60.0))
    last = round(held / PERIOD) - 1
    rig.wait(lambda: rig.predictions and rig.predictions[-1].sequence + len(
        rig.predictions[-1].current) - 1 == last)
    if held < 2.0:
        rig.wait(lambda: any('catching up by larger blocks' in s.message for s in rig.told))
        assert sum(len(m.current) for m in rig.predictions) == last + 1
        assert len(rig.predictions) < last / 10
    else:
        rig.wait(lambda: any('began again at the newest sample' in s.message for s in rig.told))
        facts = {v.key: v.value for v in rig.told[-1].values}
        answered = sum(len(m.current) for m in rig.predictions)
        assert int(facts['left out, overload']) + answered == last + 1
        assert int(facts['left out, overload']) > 1000


def test_launch_sends_as_many_samples_a_message_as_the_command_does():
    import argparse

    from servo_twin.commands import run
    parser = argparse.ArgumentParser()
    run.add_arguments(parser)
    launch = yaml.safe_load((ROOT / 'src/servo_rig_driver/launch/rig.launch.yaml').read_text())
    given = {e['arg']['name']: e['arg'].get('default') for e in launch['launch'] if 'arg' in e}
    assert int(given['block_size']) == parser.get_default('block')


def test_what_waited_on_its_way_to_the_twin_counts_though_few_samples_did():
    from servo_twin.nodes.twin_health import TwinHealth, WARN
    for first, told in ((0.002, True), (1e9, False)):  # stamps of our own clock, and of another
        health, waiting = TwinHealth(), WaitingBlocks()
        sample = np.zeros((1, len(CHANNELS)))
        health.predicted(sample, first)
        health.report(None, 0, (), waiting)
        health.predicted(sample, first + 15.0)
        level, said, facts = health.report(None, 0, (), waiting)
        assert ('behind the rig by 15.0' in said) is told
        assert (level == WARN) is told
        assert (float(facts['seconds behind, at worst']) > 1.0) is told
