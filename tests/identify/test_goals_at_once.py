"""Goals and services of the identify node that come at once, beside a twin that is slow: it ..."""

from pathlib import Path
from threading import Event, Thread
from time import monotonic, sleep

from action_msgs.msg import GoalStatus
from bench_recording import bench_recording
from identify_graph import CONFIG
import pytest
import rclpy
from rclpy.action import ActionClient, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from std_srvs.srv import Trigger
from way_back import knows_the_way_back

from servo_identify.jobs.live.sample_ring import Ring
from servo_identify.jobs.live.servo_versions import Models
from servo_identify.nodes.jobs_node import Jobs
from servo_identify.nodes.short_memory import Shortage
from servo_twin.bag import write_recording
from servo_twin_msgs.action import Diagnose, Retrain
from servo_twin_msgs.srv import LoadServo

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]
SERVO = (CONFIG / 'servos' / 'rv_bench.yaml').read_text()


def wait(condition):
    until = monotonic() + 60.0
    while not condition():
        assert monotonic() < until, 'not within 60 s'
        sleep(0.01)


class Twin:
    """The jobs of an identify node, beside a twin that takes a servo file when it is ``let``."""

    def __init__(self, folder, *words):
        rclpy.init(args=list(words))
        self.asked, self.let = [], Event()
        self.node = rclpy.create_node('identify', namespace='rig')
        group = ReentrantCallbackGroup()
        self.node.create_service(LoadServo, 'twin/load_servo', self._load, callback_group=group)
        self.executor = MultiThreadedExecutor(2)
        self.executor.add_node(self.node)
        self.thread = Thread(target=self.executor.spin, daemon=True)
        self.thread.start()
        self.jobs = Jobs(self.node, Ring(10.0), Models(SERVO, 0.02), folder, Shortage())
        wait(lambda: self.jobs.twin._client.service_is_ready())
        knows_the_way_back(self.jobs, 'identify', wait)

    def _load(self, request, response):
        self.asked.append(request.content)
        self.let.wait()
        response.success, response.previous = True, SERVO
        return response

    def close(self):
        self.jobs.close()
        self.let.set()
        self.executor.shutdown()
        self.thread.join(5.0)
        self.node.destroy_node()
        rclpy.try_shutdown()


@pytest.fixture
def twin(tmp_path):
    one = Twin(tmp_path)
    yield one
    one.close()


def sent(twin, *goals, action=Retrain):
    """Send goals to an action at once; return what will be the results of those accepted."""
    client = ActionClient(twin.node, action, action.__name__.lower())
    assert client.wait_for_server(60.0)
    knows_the_way_back(twin.node, 'identify_jobs', wait)
    handles = [client.send_goal_async(goal) for goal in goals]
    wait(lambda: all(one.done() for one in handles))
    return client, [one.result().get_result_async() for one in handles if one.result().accepted]


def test_it_does_one_of_several_goals_that_come_at_once_and_refuses_the_others(twin):
    twin.jobs._actions[0].register_goal_callback(lambda _: GoalResponse.ACCEPT)  # of one moment
    with twin.jobs._busy:  # a trial is judged, so the first goal waits
        _client, asked = sent(twin, *[Retrain.Goal(bags=['/nowhere'])] * 6)
        wait(lambda: sum(one.done() for one in asked) == 5)
    wait(lambda: all(one.done() for one in asked))
    said = sorted(one.result().result.message for one in asked)
    assert said[0].startswith('/nowhere does not exist; give a bag')
    assert said[1:] == ['refused: a job is running; cancel it or wait'] * 5


def test_it_offers_an_action_under_the_name_that_a_remap_gives_it(tmp_path):
    one = Twin(tmp_path, '--ros-args', '-r', 'retrain:=learn')
    try:
        client = ActionClient(one.node, Retrain, '/rig/learn')
        assert client.wait_for_server(60.0)
    finally:
        one.close()


@pytest.mark.parametrize('budget', [float('nan'), -1.0])
def test_it_refuses_a_budget_that_is_none(twin, budget):
    _client, (asked,) = sent(twin, Retrain.Goal(bags=['/nowhere'], budget=budget))
    wait(asked.done)
    assert asked.result().status == GoalStatus.STATUS_ABORTED
    assert asked.result().result.message == (
        f'budget = {budget:g} s; it must be 0, for no limit, or more')


@pytest.mark.parametrize(('bag', 'said'), [
    ('~/nothing_here', f'{Path.home()}/nothing_here does not exist'),
    ('~nobody_at_all/bag', '~nobody_at_all/bag: there is no such user; give the whole path'),
    ('', "'' is no path: one of the bags is empty")])
def test_it_takes_the_path_of_a_goal_as_a_shell_does(twin, bag, said):
    _client, (asked,) = sent(twin, Retrain.Goal(bags=[bag]))
    wait(asked.done)
    assert asked.result().result.message.startswith(said)


@pytest.mark.parametrize('action', [Diagnose, Retrain])
@pytest.mark.parametrize(('given', 'said'), [
    ({'begin': -1.0}, 'begin: -1 is no instant of a recording: give 0 s or more'),
    ({'end': float('inf')}, 'end: inf is no instant of a recording: give 0 s or more')])
def test_it_refuses_what_is_no_instant(twin, action, given, said):
    _client, (asked,) = sent(twin, action.Goal(bags=['/nowhere'], **given), action=action)
    wait(asked.done)
    assert asked.result().result.message == said


@pytest.mark.slow
@pytest.mark.parametrize('action', [Diagnose, Retrain])
def test_it_refuses_an_empty_stretch_as_the_commands_do(twin, action, tmp_path):
    bag = write_recording(tmp_path / 'run', bench_recording(4.0))
    _client, (asked,) = sent(twin, action.Goal(bags=[str(bag)], begin=600.0, end=660.0),
                             action=action)
    wait(asked.done)
    assert asked.result().result.message == (
        'run: from 600 s to 660 s there is nothing; it goes from 0 to 4 s')


def calls(twin, service, times):
    """Call a service several times at once; return the answers to come."""
    twin.jobs.models.loaded(SERVO, SERVO.replace('rv_bench', 'before'), 0)
    client = twin.node.create_client(Trigger, service)
    wait(client.service_is_ready)
    knows_the_way_back(twin.node, 'identify_jobs', wait)
    return [client.call_async(Trigger.Request()) for _ in range(times)]


def test_it_hears_the_twin_though_it_is_asked_for_more_files_than_it_has_threads(twin):
    asked = calls(twin, 'identify/go_back', 6)
    wait(lambda: sum(one.done() for one in asked) == 5)
    assert len(twin.asked) == 1
    assert {one.result().message for one in asked if one.done()} == {
        'refused: the twin is just being given a servo file; wait for that'}
    twin.let.set()
    wait(lambda: all(one.done() for one in asked))
    assert sum(one.result().success for one in asked) == 1


def test_it_ends_while_a_twin_that_hangs_owes_an_answer(twin):
    def retrained():
        with twin.jobs._busy, pytest.raises(ValueError, match='this node ends, and the twin has'):
            twin.jobs.twin.load(SERVO)

    threads = [Thread(target=retrained, daemon=True)]
    threads[0].start()
    wait(lambda: twin.asked)
    threads.append(Thread(target=twin.jobs.close, daemon=True))
    threads[1].start()
    for thread in threads:
        thread.join(30.0)
    assert not any(thread.is_alive() for thread in threads)
