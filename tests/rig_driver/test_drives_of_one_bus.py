"""Two drives of different ids on one bus, each with a driver of its own: a driver ..."""

from contextlib import contextmanager

from drive_bench import ASKED, Bench, CONFIG
from driver_bench import DriverProcess, Listener, wait_for
from lifecycle_msgs.msg import Transition
import pytest
from test_drive_ends import QUICK
from test_driver_lifecycle import Hands

from servo_rig_driver.can_bus.can_hub import CanHub

IDS = {'left': 1, 'right': 2}
PERIOD, WATCHDOG = 0.01, 3.0  # s; two drives and two drivers are much for a busy machine
pytestmark = [pytest.mark.long, pytest.mark.ros]


class Axis:
    """An emulated drive of an id, its driver in a namespace, and who hears it."""

    def __init__(self, name, namespace, channel):
        self.bench = Bench(name, channel, **{
            'device.id': IDS[namespace], 'device.watchdog': WATCHDOG, 'sync_period': PERIOD})
        self.ears = Listener(namespace)
        self.driver = DriverProcess(
            namespace, CONFIG / 'drivers' / f'{name}.yaml', bus__channel=channel,
            device__id=IDS[namespace], **QUICK | {
                'device__watchdog': WATCHDOG, 'sync_period': PERIOD, 'block_size': 1})
        self.hands = Hands(self.ears)

    def turns(self, speed):
        """Command a speed until the samples of this axis show it."""
        def moves():
            self.ears.command(3, [speed] * 50, self.ears.now(), 0.01)
            angle = [one.motor_position[0] for one in self.ears.encoder[-30:]]
            return self.bench.pushes and (angle[-1] - angle[0]) * speed > 0.02
        wait_for(moves, 'it turns as it was told')

    def close(self):
        said = self.driver.close()
        self.bench.close()
        self.ears.close()
        return said


@contextmanager
def axes(name, folder):
    """Give two axes on one bus."""
    channel, made = str(folder / 'bus.can'), []
    with CanHub(channel):
        try:
            for namespace in IDS:
                made.append(Axis(name, namespace, channel))
            yield made
        finally:
            for one in made:
                one.close()


@pytest.mark.parametrize('name', ASKED)
def test_moves_its_own_drive_and_lets_the_other_one_be(name, tmp_path):
    with axes(name, tmp_path) as (left, right):
        for one in (left, right):
            one.ears.all_well()
        left.turns(0.3)
        right.turns(-0.3)
        assert left.hands.change(Transition.TRANSITION_DEACTIVATE)
        wait_for(lambda: not left.bench.pushes, 'the left drive has no torque')
        right.turns(0.3)
        assert left.hands.change(Transition.TRANSITION_ACTIVATE)
        wait_for(lambda: left.bench.pushes, 'the left drive follows again')
        with right.ears.every_sample():
            left.driver.process.kill()
            wait_for(lambda: not left.bench.pushes, 'the watchdog of the left drive has ended')
            right.ears.more_samples(20)
        right.turns(-0.3)
