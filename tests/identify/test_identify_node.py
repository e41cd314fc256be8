"""The identify node, with a twin, as processes fed by a recording of the emulated rig: it ..."""

from math import isfinite

from action_msgs.msg import GoalStatus
from identify_graph import CONFIG, emulated, Graph
import pytest

from servo_identify.cli import main
from servo_twin.nodes.topic_qos import EVENTS
from servo_twin_msgs.action import Diagnose, Retrain
from servo_twin_msgs.msg import Event

pytestmark = [pytest.mark.ros, pytest.mark.timeout(900)]  # jobs give way to all else that runs
FRICTION = ['effects.coulomb.level', 'effects.viscous.slope']


@pytest.fixture
def graph():
    """Yield a function that starts a twin and an identify node; both are ended afterwards."""
    graphs = []

    def start(*settings):
        graphs.append(Graph(*settings))
        return graphs[-1]

    yield start
    for one in graphs:
        one.close()


@pytest.fixture(scope='module')
def long(tmp_path_factory):
    """Return a bag that outlasts each test at half speed, with a reversal every 2 s."""
    return emulated(tmp_path_factory.mktemp('long'), 'long', 160)


@pytest.mark.long
def test_it_retrains_cancels_and_goes_back_while_the_twin_misses_nothing(graph, long, tmp_path):
    good = emulated(tmp_path, 'good', 8, '--seed', '5')
    # so strong that its file is the worse in whichever part of the motion the trial falls
    other = emulated(tmp_path, 'other', 8, '--set', 'friction.level=8')
    rig = graph('trial:=2.0', 'buffer:=20.0', 'online.period:=0.2')
    rig.feed(long, 0.5)
    rig.wait(lambda: int(rig.fact('identify: models', 'samples kept') or 0) > 1500)
    assert not rig.call('identify/go_back').success

    handle = rig.send('retrain', Retrain.Goal(bags=[str(good)], load=True))
    assert not rig.send('retrain', Retrain.Goal(bags=[str(good)])).accepted
    rig.wait(lambda: rig.feedback)
    handle.cancel_goal_async()
    status, result = rig.result(handle)
    assert status == GoalStatus.STATUS_CANCELED
    assert not result.success and 'cancelled; the twin goes on' in result.message

    status, result = rig.result(rig.send('retrain', Retrain.Goal(learn=['luck'], load=True)))
    assert status == GoalStatus.STATUS_ABORTED and "'luck' is not to be learned" in result.message
    status, result = rig.result(rig.send('retrain', Retrain.Goal(bags=[str(good)], budget=0.2)))
    assert not result.success and 'budget of 0.2 s is used up' in result.message
    status, result = rig.result(rig.send('diagnose', Diagnose.Goal(
        bags=[str(good)], servo_file='/nowhere.yaml')))
    assert status == GoalStatus.STATUS_ABORTED and '/nowhere.yaml' in result.message
    rig.wait(lambda: rig.fact('twin: twin', 'servos loaded') == '0')

    status, result = rig.result(rig.send('retrain', Retrain.Goal(
        bags=[str(good)], learn=FRICTION, load=True)))
    assert status == GoalStatus.STATUS_SUCCEEDED, result.message
    assert result.loss_after < result.loss_before
    assert 'std:' in result.servo_file and 'bags:' in result.servo_file
    assert any(f.progress > 0.0 for f in rig.feedback)
    rig.wait(rig.says('identify: models', 'the new servo file stays'))

    status, result = rig.result(rig.send('retrain', Retrain.Goal(
        bags=[str(other)], learn=FRICTION, load=True)))
    assert status == GoalStatus.STATUS_SUCCEEDED, result.message
    rig.wait(rig.says('identify: models', 'went back to the servo file before'))
    assert rig.fact('identify: models', 'returns') == '1'
    rig.wait(lambda: rig.fact('twin: twin', 'servos loaded') == '3')
    assert rig.call('identify/go_back').success

    answered = list(rig.predictions)
    assert all(first + size == then for (first, size), (then, _) in zip(
        answered, answered[1:], strict=False))
    rig.wait(lambda: 'effects.coulomb.level' in rig.estimates[-1].name)  # tracked again since
    # a servo file that was just loaded has its first rows before it
    rig.wait(lambda: 15.0 < rig.estimates[-1].value[0] < 30.0
             and 0.0 < rig.estimates[-1].std[0] < 10.0)


def experiment(folder, name, *choices):
    """Return the bags of an experiment on the emulated rig, made without its bus."""
    words = ['experiment', name, '--headless', '-o', str(folder / name), *map(str, choices)]
    assert main(words) == 0
    return sorted(map(str, (folder / name).iterdir()))


@pytest.mark.long
def test_it_learns_friction_backlash_and_transmission_error_while_the_twin_runs(graph, long,
                                                                                tmp_path):
    bags = {'friction': experiment(tmp_path, 'friction', '--speeds', 0.6, 1.5),
            'backlash': experiment(tmp_path, 'backlash', '--speeds', 1.5, '--torques', -40, 0, 40),
            'transmission_error': experiment(tmp_path, 'transmission_error', '--speeds', 0.8, 1.2,
                                             '--angle', 7.0, '--max-travel', 9.0)}
    rig = graph('trial:=2.0', 'buffer:=20.0', 'watch.on:=false')
    rig.feed(long, 0.5)
    rig.wait(lambda: int(rig.fact('identify: models', 'samples kept') or 0) > 1500)
    status, result = rig.result(rig.send('retrain', Retrain.Goal(
        bags=bags['transmission_error'][:1], learn=['backlash'], load=True)))
    assert status == GoalStatus.STATUS_ABORTED and 'backlash over load needs' in result.message
    assert rig.fact('twin: twin', 'servos loaded') == '0'

    for kind in bags:
        rig.feedback.clear()
        status, result = rig.result(rig.send('retrain', Retrain.Goal(
            bags=bags[kind], learn=[kind], budget=200.0, load=True)))
        assert status == GoalStatus.STATUS_SUCCEEDED, result.message
        told = [f for f in rig.feedback if f.stage in (f'learning {kind}', 'judging')]
        assert told and isfinite(told[-1].loss), rig.feedback
        assert all(0.0 <= f.time_left <= 200.0 for f in told)
        assert result.loss_after < result.loss_before
        assert kind in result.servo_file
        rig.wait(rig.says('identify: models', 'the new servo file stays: residuals'))
        rig.history.clear()
        rig.said.pop('identify: models')
    rig.wait(lambda: rig.fact('twin: twin', 'servos loaded') == '3')
    assert rig.missed() == 0


@pytest.mark.long
def test_it_names_the_balance_within_seconds_of_an_effect_being_switched_on(graph, tmp_path):
    file = tmp_path / 'rig.yaml'
    file.write_text((CONFIG / 'rigs' / 'rv_bench.yaml').read_text().replace(
        'switches: []', 'switches:\n  - {at: 30.0, set: {friction.load_level: 1.6}}'))
    bag = emulated(tmp_path, 'bag', 52, '--rig', str(file))
    rig = graph('watch.learn:=20.0')
    rig.feed(bag, 2.0)
    events = []
    rig.node.create_subscription(Event, 'events', events.append, EVENTS)
    rig.wait(lambda: any((e.kind, e.content) == ('change', 'load') for e in events))
    rig.wait(lambda: rig.fact('identify: changes', 'load'))
    seen = int(rig.fact('identify: changes', 'load').rpartition(' ')[2])
    assert 30_000 < seen <= 36_000
    rig.wait(lambda: rig.fact('identify: changes', 'place'))
    assert rig.fact('identify: changes', 'place').startswith('load')
    assert rig.said['identify: changes'][0].endswith('; in: load')
    rig.wait(lambda: any((e.kind, e.content) == ('place', 'load') for e in events))
    assert ('identify: changes', 'no balance changed') in rig.history
    rig.wait(lambda: rig.call('identify/relearn').success)
    rig.wait(rig.says('identify: changes', 'learning what is usual'))
