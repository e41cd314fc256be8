"""A recorder beside the twin of a test: it ends when it has counted what the test waits for."""

from contextlib import contextmanager
import signal
import subprocess
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition


class Recorder:
    """A recorder of the namespace /rig, and how many messages it says it has."""

    def __init__(self, bag, servo) -> None:
        self.counts: dict[str, int] = {}
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'servo_rig_driver.record.recorder_node', '--ros-args', '-r',
             '__ns:=/rig', '-p', f'output:={bag}', '-p', f'servo_file:={servo}'],
            stdout=subprocess.DEVNULL)

    def listen(self, node) -> None:
        """Hear its counts on /diagnostics."""
        node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 10)

    def _hear(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == '/rig/recorder: recording':
                self.counts |= {pair.key.removeprefix('messages /rig/'): int(pair.value)
                                for pair in status.values if pair.key.startswith('messages /rig')}

    def begin(self, rig, samples) -> int:
        """
        Have the recorder hear the rig before the twin answers it, and then the twin.

        ``samples`` is one block. Returns the running number that comes next.
        """
        self.listen(rig.node)
        rig.wait(lambda: all(t.get_subscription_count() == 2 for t in rig.topics.values())
                 and rig.told)
        rig.goes(Transition.TRANSITION_DEACTIVATE)
        following = self._until(rig, samples, 0, 'encoder')
        rig.goes(Transition.TRANSITION_ACTIVATE)
        following = self._until(rig, samples, following, 'twin_prediction', 'twin_residual',
                                'events')
        rig.wait(lambda: rig.predictions
                 and rig.predictions[-1].sequence == following - len(samples))
        return following

    def _until(self, rig, samples, following: int, *topics: str) -> int:
        while not self.has(**dict.fromkeys(topics, 1)):
            rig.say(following, samples)
            following += len(samples)
            end = time.monotonic() + 0.2
            rig.wait(lambda: time.monotonic() > end)  # noqa: B023  (waited for here)
        return following

    def has(self, **least: int) -> bool:
        """Whether so many messages of each topic are recorded; _ stands for /."""
        return all(self.counts.get(topic.replace('_', '/'), 0) >= count
                   for topic, count in least.items())


@contextmanager
def recorder(bag, servo):
    """Run a recorder; it closes its bag at the end."""
    found = Recorder(bag, servo)
    try:
        yield found
    finally:
        found.process.send_signal(signal.SIGINT)
        found.process.wait(60.0)
