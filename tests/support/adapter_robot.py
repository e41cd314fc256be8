"""A robot of messages beside an adapter that looks at them, without ROS."""

from types import SimpleNamespace

from servo_rig_driver.adapter.adapter_findings import AdapterFindings
from servo_rig_driver.adapter.adapter_node import mapping_of
from servo_rig_driver.adapter.message_field import FieldError
from servo_rig_driver.adapter.sample_stream import SampleStream, SECOND
from servo_rig_driver.driver.rig_health import RigHealth

STATES = '/joint_states'
MS = SECOND // 1000
BEGIN = 1000 * SECOND


class Robot:
    """A robot whose JointState an adapter takes, and what the adapter finds once a second."""

    def __init__(self, publishers=('/controllers',)):
        mapped = mapping_of('ros2_control_joint', 'hip')
        self.blocks, self.health = [], RigHealth()
        self.stream = SampleStream(mapped, 0, SECOND, 5 * MS, 10, self.blocks.append)
        self.findings = AdapterFindings(self.stream, self.health)
        self.publishers, self.now = publishers, BEGIN

    def says(self, seconds, step=5 * MS, stamp=lambda now: now, joints=('hip', 'knee'),
             effort=1.0, number=None):
        """Publish for so long, the adapter looking once a second."""
        watch = self.findings.watches[STATES]
        for _ in range(round(seconds * SECOND / step)):
            self.now += step
            message = SimpleNamespace(name=list(joints), position=[0.0] * len(joints),
                                      effort=[] if effort is None else [effort] * len(joints))
            try:
                watch.take(self.stream.put(STATES, message, stamp(self.now), self.now),
                           number and next(number))
            except FieldError as error:
                watch.lacks(error)
            if self.now % SECOND < step:
                self.findings.tell({STATES: self.publishers}, self.now)
        return self

    @property
    def told(self):
        """What is told now, as one text."""
        return '; '.join(trouble.text for trouble in self.health.troubles)
