"""A twin that is restarted, or runs another way, while it is recorded: a replay does the same."""

from lifecycle_msgs.msg import Transition
import numpy as np
import pytest
from recorded_twin import recorder
from twin_graph import samples

from servo_twin.bag import read_changes
from servo_twin.cli import main
from servo_twin.recording.events import as_for_another, BEGAN, Change, obeyed

DEACTIVATE, ACTIVATE = Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVATE


@pytest.mark.ros
def test_a_replay_begins_where_the_twin_began_again(graph, servo_files, tmp_path, capsys):
    bag = tmp_path / 'bag'
    with recorder(bag, f'{servo_files}/bench.yaml') as recorded:
        rig = graph('rig', 'catch:=0.05')
        first = recorded.begin(rig, samples(10, 1.0))

        def runs(begin, end):
            before = len(rig.predictions)
            for k in range(first + begin, first + end, 10):
                rig.say(k, samples(10, 1.0 + 0.001 * k))
            rig.wait(lambda: len(rig.predictions) == before + (end - begin) // 10)

        runs(0, 300)
        assert rig.set('mode', 'observer').successful
        runs(300, 600)
        rig.goes(DEACTIVATE)
        assert rig.set('drive.gain', 0.2).successful  # between two runs
        rig.goes(ACTIVATE)
        runs(600, 900)
        rig.goes(DEACTIVATE)
        rig.wait(lambda: recorded.has(encoder=90, events=4, twin_residual=60))
    changes = [(c.sequence - first, c.kind) for c in read_changes(bag)]
    assert changes[0][1] == 'began'
    assert changes[1:] == [(300, 'settings'), (600, 'parameters'), (600, 'began')]
    assert main(['replay', str(bag), '--compare']) == 0
    told = capsys.readouterr().out
    assert 'identical to the last bit' in told and 'twin began' in told
    assert main(['replay', str(bag), '--compare', '--mode', 'measured_input']) == 1
    # its own servo file lacks the gain that was set: of the second run the replay differs
    assert main(['replay', str(bag), '--compare', '--servo', f'{servo_files}/bench.yaml']) == 1


def test_what_was_set_before_a_beginning_stands_in_it():
    began = '{"mode": "observer", "servo_file": "servo: a"}'
    changes = [Change(0, 'parameters', '{"a": 1.0}'), Change(0, BEGAN, began),
               Change(300, 'parameters', '{"a": 2.0}'), Change(0, 'parameters', '{"a": 3.0}'),
               Change(900, BEGAN, began), Change(0, 'parameters', '{"a": 4.0}')]
    assert [one.content for one in obeyed(changes)] == [
        began, '{"a": 2.0}', began, '{"a": 4.0}']
    other = as_for_another(changes)
    assert [one.kind for one in other] == [BEGAN, BEGAN]
    assert other[0].values == {'mode': 'observer', 'servo_file': ''}
    assert np.all([one.sequence for one in other] == [0, 900])
