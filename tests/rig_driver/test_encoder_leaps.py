"""An encoder that is reset, loses turns or slips is told, and no speed is made of it: it ..."""

from array import array
from math import isnan, nan, tau
import subprocess
import sys
from time import sleep, time_ns

from diagnostic_msgs.msg import DiagnosticArray
from driver_bench import Listener, wait_for
import numpy as np
import pytest
from sensor_msgs.msg import JointState

from servo_rig_driver.driver.encoder_leaps import EncoderLeaps
from servo_rig_driver.driver.message_conversion import JointStates
from servo_rig_driver.driver.rig_health import RigHealth
from servo_rig_driver.driver.sample_blocks import COLUMNS, SampleBlock


def block(sequence, motor, period=1e-3):
    columns = {name: array('d', [nan] * len(motor)) for name in COLUMNS}
    columns['motor_position'] = array('d', motor)
    return SampleBlock(sequence, round(sequence * period * 1e9), period, columns)


def told(health):
    return [trouble.text for trouble in health.troubles]


@pytest.mark.parametrize('size', [1, 3, 200])
def test_it_tells_a_leap_by_turns_once_and_goes_on(size):
    angle = 200.0 * 1e-3 * np.arange(200)
    angle[120:] -= 3.0 * tau
    health = RigHealth()
    leaps = EncoderLeaps(health)
    found = [first for first in range(0, 200, size)
             if leaps.take(block(first, angle[first:first + size]))]
    assert found == [120 // size * size]
    assert 'the motor encoder leapt by -18.85 rad (-3 turns) within 1 ms' in told(health)[0]
    assert 'reference the axis' in told(health)[0]


@pytest.mark.parametrize('speed', [0.0, 30.0, 2000.0])
def test_it_takes_hard_stops_reversals_and_lost_samples_for_motion(speed):
    t = np.arange(400) * 1e-3
    angle = np.where(t < 0.2, speed * t, speed * (0.4 - t))
    health = RigHealth()
    leaps = EncoderLeaps(health)
    for first in (0, 10, 20, 60, 100, 195, 205, 220, 390):
        leaps.take(block(first, angle[first:first + 10]))
    assert told(health) == []


def test_after_a_break_it_tells_turns_that_are_lost_and_none_of_a_shaft_that_coasted():
    health = RigHealth()
    leaps = EncoderLeaps(health)
    leaps.take(block(0, [50.0, 50.1, 50.2]))
    leaps.take(block(1002, [90.0, 90.0]))  # 100 rad/s would have led to 150 rad
    assert told(health) == []
    assert leaps.take(block(3004, [0.5, 0.5])) == {'motor_position'}
    assert 'after a break of 2 s, and told 90 rad before it' in told(health)[0]
    assert 'If the shaft was not turned meanwhile' in told(health)[0]


def test_samples_that_begin_again_are_no_leap():
    health = RigHealth()
    leaps = EncoderLeaps(health)
    leaps.take(block(500, [50.0, 50.1, 50.2]))
    assert not leaps.take(block(0, [90.0, 90.0, 90.0]))
    assert told(health) == []


def test_no_speed_is_made_of_a_leap():
    states, leaps = JointStates(['motor', 'load'], 100.0, 'rig'), EncoderLeaps(RigHealth())
    speeds = []
    for k in range(60):
        angle = 1e-3 * np.arange(10 * k, 10 * k + 10) - (5.0 * tau if k >= 30 else 0.0)
        one = block(10 * k, angle)
        state = states.from_block(one, leaps.take(one))
        if state is not None:
            speeds.append(state.velocity[0])
    assert sum(isnan(speed) for speed in speeds[1:]) == 1
    assert np.nanmax(np.abs(speeds)) == pytest.approx(1.0)


def test_below_100_hz_it_tells_a_turn_where_the_rig_says_what_its_shaft_can_do():
    period, t = 0.02, 0.02 * np.arange(400)
    moves = np.where(t < 4.0, 0.3 * np.sin(8.0 * t), 0.5)  # rad; 19 rad/s2, and a hard stop
    lost = moves + np.where(t > 6.0, tau, 0.0)
    for angle, fastest, leaps in ((moves, 2e3, 0), (lost, 2e3, 1), (lost, 2e5, 0)):
        health = RigHealth()
        EncoderLeaps(health, fastest).take(block(0, angle, period))
        assert len(told(health)) == leaps
    assert told(health) == []


@pytest.mark.ros
def test_an_adapter_beside_a_robot_of_50_hz_tells_that_its_encoder_lost_a_turn(tmp_path):
    (tmp_path / 'robot.yaml').write_text("""
time: {source: /joint_states.stamp}
columns: {load_position: {source: '/joint_states.position[hip]'}}
""")
    ears, said = Listener('leaps', commands=False), []
    robot = ears.node.create_publisher(JointState, '/joint_states', 100)
    ears.node.create_subscription(DiagnosticArray, '/diagnostics', lambda told: said.extend(
        status.message for status in told.status), 100)
    adapter = subprocess.Popen(
        [sys.executable, '-m', 'servo_rig_driver.adapter.adapter_node', '--ros-args', '-r',
         '__ns:=/leaps', '-p', 'mapping:=robot.yaml', '-p', 'rate:=50.0', '-p', 'block_size:=1',
         '-p', 'largest_acceleration:=2000.0'], cwd=tmp_path)
    begun, sent = time_ns(), [0]

    def until(words, angle):
        sent[0] += 1
        stamp = begun + sent[0] * 20_000_000
        message = JointState(name=['hip'], position=[angle])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        robot.publish(message)
        sleep(max(0.0, (stamp - time_ns()) * 1e-9))
        return any(words in one for one in said)
    try:
        wait_for(lambda: until('adapting', 0.5), 'it adapts')
        samples = sent[0] + 20
        wait_for(lambda: until('', 0.5) and sent[0] > samples, 'the shaft stands')
        assert not any('leapt' in one for one in said)
        wait_for(lambda: until('the load encoder leapt by -6.283 rad', 0.5 - tau), 'it is told')
    finally:
        adapter.terminate()
        adapter.wait(60.0)
        ears.close()
