"""Changes of a running twin travel as events, stand in the bag, and a replay obeys them."""

from dataclasses import replace

from bench_recording import bench_recording, SERVO
from lifecycle_msgs.msg import Transition
import numpy as np
import pytest
from recorded_twin import recorder
from std_msgs.msg import String
from twin_graph import samples

from servo_twin.bag import read_changes
from servo_twin.balances.residual_filters import half_of, WINDOW
from servo_twin.cli import main
from servo_twin.description.servo_file import load
from servo_twin.lockstep.live_comparison import Differences, differences, Seen
from servo_twin.lockstep.lockstep import Settings
from servo_twin.lockstep.whole_recording import answer
from servo_twin.recording.events import BEGAN, Change, written

pytestmark = pytest.mark.ros


@pytest.mark.long
def test_a_replay_is_the_live_run_to_the_last_bit_though_a_parameter_was_set(
        graph, servo_files, tmp_path, capsys):
    bag = tmp_path / 'bag'
    with recorder(bag, f'{servo_files}/bench.yaml') as recorded:
        rig = graph('rig', 'catch:=0.1')
        first = recorded.begin(rig, samples(10, 1.0))
        before = len(rig.predictions)
        notes = rig.node.create_publisher(String, '/rig/note', 10)
        for k in range(first, first + 300, 10):
            rig.say(k, samples(10, 1.0))
        rig.wait(lambda: len(rig.predictions) == before + 30)
        assert rig.set('drive.gain', 0.2).successful
        rig.wait(lambda: recorded.has(events=3) or notes.publish(
            String(data='oil changed')))  # again and again: the recorder may not hear the first
        for k in range(first + 300, first + 600, 10):
            rig.say(k, samples(10, 1.0))
        rig.wait(lambda: len(rig.predictions) == before + 60)
        rig.goes(Transition.TRANSITION_DEACTIVATE)
        rig.wait(lambda: recorded.has(encoder=60, twin_residual=30))
    assert [(c.sequence, c.values) for c in read_changes(bag) if c.kind == 'parameters'] == [
        (first + 300, {'drive.gain': 0.2})]
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
    assert len(Seen(recording, live)) == cut + half
    assert not any(differences(live, answer(Seen(recording, live), servo)).values())
    assert len(Seen(recording, until(len(whole)))) == len(whole)


@pytest.mark.parametrize('unheard', [0, 7])
def test_balances_that_the_recorder_ended_too_early_for_are_not_compared(unheard):
    """The recorder heard answers to samples, but not all samples that the answers had seen."""
    servo = load(SERVO)
    recording = bench_recording(coulomb=30.0)
    whole = answer(recording, servo)
    first, end = recording.sequence, recording.sequence + len(recording) // 2
    live = whole.part(first, end)
    for column in live.residual.values():  # the last of them were still on their way
        column[len(live) - unheard:] = np.nan
    short = recording.part(first, end)
    seen = Seen(short, live)

    def found(live):
        compared = Differences(live, seen.balanced)
        compared.add(answer(seen, servo))
        return compared.found

    assert seen.balanced == end - half_of(WINDOW, recording.period)
    assert not any(found(live).values())
    live.residual['drive'][seen.balanced - first - 1] += 1e-9
    assert found(live)['residual drive'] == 1


def test_a_twin_that_began_again_is_compared_though_its_first_answers_were_not_heard():
    servo = load(SERVO)
    recording = bench_recording(coulomb=30.0)
    half = len(recording) // 2
    content = written({**vars(Settings()), 'servo_file': ''})
    begun = [Change(recording.sequence + at, BEGAN, content) for at in (0, half)]
    live = answer(recording, servo, changes=begun)
    unheard, left_out = (half, half + 40), (half + 900, half + 920)
    for begin, end in unheard, left_out:
        for column in live.prediction.values():
            column[begin:end] = np.nan
    seen = Seen(recording, live, begun)
    told = recording.sequence + left_out[0]
    assert np.isfinite(seen.part(seen.sequence, told)['voltage']).all()
    assert np.isnan(seen.part(told, told + 20)['voltage']).all()
    heard = live.part(live.sequence, told - half_of(WINDOW, live.period))
    assert not any(differences(heard, answer(seen, servo, changes=begun)).values())
