"""The player of excitations: what it refuses, and how it begins and ends."""

import os
import signal
import subprocess
import sys
from time import sleep, time

from driver_bench import Listener, wait_for
import numpy as np
import pytest
from stepped_clock import SteppedClock

from servo_rig_driver.driver.setpoints import Mode
from servo_rig_driver.record.player_node import eased, main, spoken, STOOD_STILL
from servo_twin_msgs.msg import Command, Encoder


def test_a_reference_begins_and_ends_at_rest():
    wave = eased(np.ones(4000), 1e-3)
    assert wave[0] == wave[-1] == 0.0
    assert (wave[600:-600] == 1.0).all()
    assert (np.diff(wave[:500]) > 0.0).all()


def test_it_says_quantity_size_and_unit_of_what_it_plays():
    wave, none = np.array([0.0, -1.5, 1.0]), np.zeros(3)
    assert spoken('sine', Mode.VOLTAGE, wave, none) == 'playing sine: voltage of up to 1.5 V'
    assert spoken('hold', Mode.POSITION, none, 4.0 * wave) == (
        'playing hold: position of up to 0 rad, external torque of up to 6 N m')


@pytest.mark.parametrize('words, said', [
    (['sine', '--setting', 'loudness=3'], "has no setting 'loudness'; it has"),
    (['sine', '--duration', '0.0005'], 'are 0.5 of them; there are 2 to'),
    (['sine', '--period', '1e-9'], 'of them; there are 2 to 20000000'),
])
def test_it_refuses_what_cannot_be_played(capsys, words, said):
    assert main(words) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize('words, said', [
    (['--setting', 'amplitude=high'], "'amplitude=high' must read NAME=NUMBER"),
    (['--setting', 'amplitude'], "'amplitude' must read NAME=NUMBER"),
    (['--period', '0'], "'0' s is no time above 0"), (['--wait', 'nan'], "'nan' s is no time"),
    (['--duration', '-3'], "'-3' s is no time above 0")])
def test_it_says_what_an_argument_must_be(capsys, words, said):
    with pytest.raises(SystemExit) as ended:
        main(['sine', *words])
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


@pytest.mark.ros
def test_it_says_that_no_rig_was_there(capsys):
    assert main(['sine', '--wait', '0.2']) == 1
    assert 'no rig took a set-point within 0.2 s: no samples came' in capsys.readouterr().err


@pytest.mark.ros
@pytest.mark.parametrize('step', [-3600.0, -0.5, 0.5, 3600.0])
def test_it_ends_with_the_motor_off_where_the_wall_clock_is_set(step, tmp_path):
    clock = SteppedClock(tmp_path)
    if not clock.works:
        pytest.skip('no C compiler: the clock of a process cannot be set')
    ears, heard = Listener('clocked'), []
    samples = ears.node.create_publisher(Encoder, 'encoder', 10)
    ears.node.create_subscription(Command, 'command', heard.append, 10)
    player = subprocess.Popen(
        [sys.executable, '-m', 'servo_rig_driver.record.player_node', 'sine', '--duration', '30',
         '--ros-args', '-r', '__ns:=/clocked'], stderr=subprocess.PIPE, text=True,
        env=os.environ | clock.environment)
    try:
        wait_for(lambda: heard or samples.publish(Encoder()), 'it plays')
        clock.set(step)
        _, said = player.communicate(timeout=60.0)
        assert player.returncode == 1
        assert f'the clock was set by {step:+.1f} s; the rest is not played' in said
        wait_for(lambda: heard[-1].mode == Command.OFF, 'the motor is off')
        assert abs(heard[-1].header.stamp.sec - time()) < 10.0  # as the driver's clock goes on
    finally:
        player.kill()
        ears.close()


@pytest.mark.ros
def test_it_does_not_go_on_in_the_middle_of_a_motion_after_it_stood_still():
    ears, heard = Listener('played'), []
    samples = ears.node.create_publisher(Encoder, 'encoder', 10)
    ears.node.create_subscription(Command, 'command', heard.append, 10)
    player = subprocess.Popen(
        [sys.executable, '-m', 'servo_rig_driver.record.player_node', 'sine', '--ros-args', '-r',
         '__ns:=/played'], stderr=subprocess.PIPE, text=True)
    try:
        wait_for(lambda: heard or samples.publish(Encoder()), 'it plays')
        player.send_signal(signal.SIGSTOP)
        sleep(STOOD_STILL + 0.5)  # longer than a set-point lasts
        count = len(heard)
        player.send_signal(signal.SIGCONT)
        _, said = player.communicate(timeout=60.0)
        assert player.returncode == 1
        assert 'the rest is not played' in said
        assert len(heard) == count
    finally:
        player.kill()
        ears.close()
