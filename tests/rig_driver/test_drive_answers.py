"""Samples keep their stamps where a drive that is asked loses, delays or doubles an answer."""

from time import sleep

from drive_bench import ASKED, bench, each, Link
from driver_bench import wait_for
import numpy as np
import pytest

from servo_rig_driver.driver.setpoints import Mode
from servo_rig_driver.emulated import rig_sampling

PERIOD = 0.02  # s; a busy machine answers late by some ms
ESTIMATES, CURRENT = 0x29, 0x34  # of ODrive's axis 1; other drives answer by one frame


class Witness:
    """Knows of each request which angle the drive measured for it; spoils answers."""

    def __init__(self, made, link):
        self.made, self.link = made, link
        self.numbers, self.angles = [], []  # of the requests, in order; at the motor, rad
        self.spoil = lambda send, frames: send(frames)
        self._spy_on_requests()
        self._spy_on_answers()

    def _spy_on_requests(self):
        ask = self.link.device.ask

        def asked(number, order, point, now):
            if not self.numbers:
                self.angles.clear()  # of what was asked before the first sample
            if self.numbers[-1:] != [number]:
                self.numbers.append(number)
            return ask(number, order, point, now)
        self.link.device.ask = asked

    def _spy_on_answers(self):
        nodes = self.made.rig.nodes
        step, send = nodes.step, nodes.send

        def stepped():
            out = step()
            self.angles.append(out[rig_sampling.MOTOR])
            return out

        def sent(frames):
            if self.made.name == 'odrive' and frames[0][0] not in (ESTIMATES, CURRENT):
                send(frames)
            else:
                self.spoil(send, frames)
        nodes.step, nodes.send = stepped, sent

    def once(self, spoil):
        """Let one answer be spoiled, and wait until it is."""
        done = []

        def first(send, frames):
            if not done:
                done.append(True)
                spoil(send, frames)
            else:
                send(frames)
        self.spoil = first
        wait_for(lambda: done, 'an answer is spoiled')

    def check(self, since, what):
        """Check that all samples from a number on carry the angle of their own request."""
        begun = len(self.link.blocks)

        def goes_on():
            self.link.play(Mode.VELOCITY, min(1.0, self.link.of['limit.velocity']))
            return len(self.link.blocks) > begun + 25
        wait_for(goes_on, 'samples come')
        blocks = [block for block in list(self.link.blocks) if block.sequence >= since]
        place = {number: k for k, number in enumerate(self.numbers)}
        told = np.array([block.columns['motor_position'][0] for block in blocks])
        at = np.array([place[block.sequence] for block in blocks])
        angles = np.array(self.angles)
        inside = at + 1 < len(angles)
        told, at = told[inside], at[inside]
        assert len(at) > 20
        moved = np.median(np.abs(np.diff(angles[at[0]:at[-1]])))
        wrong = at[np.abs(told - angles[at]) > 0.7 * moved]
        assert not len(wrong), (what, wrong, moved)


def lost(send, frames):
    """Answer nothing."""


def late(send, frames):
    """Answer as a busy machine does."""
    sleep(3.5 * PERIOD)
    send(frames)


def twice(send, frames):
    """Answer twice, as a receiver that misses the last bit of a frame makes CAN do."""
    send(frames * 2)


@pytest.mark.slow
@pytest.mark.parametrize('name', each(ASKED))
def test_a_spoiled_answer_shifts_no_other(name, tmp_path):
    with bench(name, tmp_path, sync_period=PERIOD) as made:
        link = Link(made.channel, made.of | {'command_timeout': 5.0, 'answer_timeout': 0.1})
        witness = Witness(made, link)
        speed = min(1.0, link.of['limit.velocity'])

        def turns():
            link.play(Mode.VELOCITY, speed)
            return abs(made.rig.bench.state['load_speed'][0]) > 0.3 * speed
        try:
            link.up()
            wait_for(turns, 'the motor turns')
            for spoil in (lost, late, twice, lost, lost):
                since = link.blocks[-1].sequence + 1
                witness.once(spoil)
                witness.check(since, spoil.__name__)
            link.says('were asked for and never came')
            link.says('were not asked for: the drive was behind')
            link.says('answers came that nobody had asked for')
        finally:
            link.link.close()
