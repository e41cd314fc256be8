"""The identify node beside the emulated rig on its bus, all of them processes: it ..."""

from dataclasses import dataclass
import json
import signal
from time import monotonic

from action_msgs.msg import GoalStatus
from held_up import held_up_since
from identify_graph import Graph
import pytest

from servo_twin_msgs.action import Diagnose

pytestmark = [pytest.mark.ros, pytest.mark.timeout(900)]  # jobs give way to all else that runs
BUFFER = 16.0  # s; a period of the motion takes 4


@dataclass(frozen=True)
class Tracked:
    """One quantity of an estimate."""

    value: float
    std: float
    bounded: bool


def estimate_of(message, name):
    """Return what the online estimator published of a quantity."""
    k = list(message.name).index(name)
    return Tracked(message.value[k], message.std[k], message.bounded[k])


@pytest.mark.long
def test_it_names_diagnoses_and_closes_a_gap_that_opens_while_the_rig_runs(tmp_path):
    rig = Graph('watch.learn:=12.0', f'buffer:={BUFFER}', 'trial:=4.0',
                'online.time_constant:=10.0', servo='rv_plain')
    try:
        assert not rig.call('identify/load_augmented').success
        emulator, file = rig.bring_up(tmp_path, 'rv_plain', 'slow_reversals', '--duration', '900',
                                      '--setting', 'amplitude=0.8')
        rig.wait(rig.says('identify: changes', 'no balance changed'))

        def at_its_value():
            level = estimate_of(rig.estimates[-1], 'effects.load_coulomb.level')
            return abs(level.value - 18.0) < max(3.0 * level.std, 0.5) and not level.bounded
        rig.wait(at_its_value)

        text = file.read_text()
        file.write_text(f'{text}\nwithheld:\n  load_drag: 8.0\n')
        switched, begun = rig.at, monotonic()
        emulator.send_signal(signal.SIGUSR1)
        # that of the motor may be seen as well, and before, where the machine is busy
        rig.wait(lambda: rig.fact('identify: changes', 'load') is not None)
        seen = int(rig.fact('identify: changes', 'load').rpartition(' ')[2])
        assert 0 < seen - switched < 10_000 + 1000.0 * held_up_since(begun)

        # a buffer of the rig as it is now, which begins again where a busy machine lost samples
        rig.wait(lambda: rig.at > switched + 1000.0 * BUFFER + 1500
                 and rig.fact('identify: models', 'samples kept') == f'{1000.0 * BUFFER:.0f}')
        level = estimate_of(rig.estimates[-1], 'effects.load_coulomb.level')
        assert level.bounded and level.value == pytest.approx(19.8) and 0.0 < level.std < 10.0
        rig.set_parameter('identify', 'online.on', False)
        status, result = rig.result(rig.send('diagnose', Diagnose.Goal(
            output=str(tmp_path / 'report'))))
        told, off = len(rig.estimates), rig.at
        assert status == GoalStatus.STATUS_SUCCEEDED, result.message
        report = json.loads(result.report)
        assert report['verdict']['effects'] == ['parameter:load_coulomb.level']
        assert {one['balance'] for one in report['where'] if one['verdict'] == 'gap'} == {'load'}
        assert report['which'][0]['parameters']['level']['value'] == pytest.approx(26.0, rel=0.02)
        for name in ('report.json', 'report.html', 'augmented.yaml'):
            assert (tmp_path / 'report' / name).stat().st_size > 500
        assert any(0.0 < f.progress < 1.0 for f in rig.feedback)

        asked = rig.at
        answer = rig.call('identify/load_augmented')
        assert answer.success, answer.message
        loaded = rig.at
        rig.wait(lambda: rig.at > loaded + 6_000)
        before = rig.load_residual(asked - 4_000, asked)
        after = rig.load_residual(rig.at - 4_500, rig.at - 500)
        print(f'load balance {before:.1f} -> {after:.1f} noise floors; alarm after '
              f'{(seen - switched) * 1e-3:.2f} s')
        assert after < 0.2 * before
        assert rig.at > off + 5_000 and len(rig.estimates) == told
        rig.wait(rig.says('identify: models', 'the new servo file stays'))
        assert rig.missed() == 0
    finally:
        rig.close()
