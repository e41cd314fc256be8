"""A driver that is started again counts from 0: a replay of either life is the live run's."""

from lifecycle_msgs.msg import Transition
import pytest
from recorded_twin import recorder
from twin_graph import ends_of, OTHER, samples

from servo_twin.cli import main
from servo_twin_msgs.srv import LoadServo

LATER = 10**9 + 100  # s; when the second driver begins


@pytest.mark.ros
def test_what_changed_beside_one_driver_is_not_obeyed_at_the_numbers_of_another(
        graph, servo_files, tmp_path, capsys):
    bag = tmp_path / 'bag'
    with recorder(bag, f'{servo_files}/bench.yaml') as recorded:
        rig = graph('rig', 'catch:=0.05')
        first = recorded.begin(rig, samples(10, 1.0))

        def runs(begin, end, **when):
            for k in range(begin, end, 10):
                rig.say(k, samples(10, 1.0 + 0.001 * k), **when)
            rig.wait(lambda: ends_of(rig.predictions)[-1] == end)

        runs(first, first + 400)
        assert rig.set('drive.gain', 0.2).successful
        runs(first + 400, first + 500)
        rig.wait(lambda: recorded.has(encoder=50, events=2))
        runs(0, 100, second=LATER)
        assert rig.set('drive.gain', 0.3).successful
        runs(100, 200, second=LATER)
        assert rig.ask(LoadServo, 'twin/load_servo', LoadServo.Request(content=OTHER)).success
        runs(200, 1500, second=LATER)
        rig.goes(Transition.TRANSITION_DEACTIVATE)
        rig.wait(lambda: recorded.has(encoder=200, events=5, twin_residual=10))
    for stretch in ('0', '1'):
        status = main(['replay', str(bag), '--compare', '--stretch', stretch])
        told = capsys.readouterr()
        assert status == 0, told.err
        assert 'identical to the last bit' in told.out
