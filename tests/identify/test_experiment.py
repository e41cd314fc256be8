"""Experiments: procedures and limits, and runs on the emulated bench: it ..."""

from contextlib import closing
from math import inf, nan, pi
from pathlib import Path
import signal
import subprocess
import sys
from threading import Thread
from time import monotonic, time_ns

from hypothesis import given, strategies
import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState

from servo_identify.cli import main
from servo_identify.experiment import setpoint_profiles
from servo_identify.experiment.live_bench import emulated_bench
from servo_identify.experiment.performer_node import Performer, Stopped
from servo_identify.experiment.procedures import Choices, PROCEDURES
from servo_identify.experiment.run_limits import Guard, LimitError, Limits, limits_of, REACTION
from servo_twin.bag import read_recording
from servo_twin.bringup.processes import Processes, wait_until
from servo_twin.description.servo_file import load
from servo_twin_msgs.msg import Command, Encoder

CONFIG = Path(__file__).resolve().parents[2] / 'config'
PERIOD = 1e-3
ATTEMPTS = ('first', 'second', 'third')  # a machine that stalls ends a run before its time


@pytest.mark.parametrize('procedure', PROCEDURES.values(), ids=list(PROCEDURES))
def test_it_begins_and_ends_every_run_at_rest_and_unloaded_within_the_limits(procedure):
    runs = procedure.runs(Choices(PERIOD))
    assert len({run.name for run in runs}) == len(runs)
    for run in runs:
        Limits().check(run, gain=0.49)
        assert len(run.reference) == len(run.external_torque)
        for wave in (run.reference, run.external_torque):
            assert abs(wave[0]) < 0.02 * (abs(wave).max() + 1e-9)
            assert abs(wave[-1]) < 0.02 * (abs(wave).max() + 1e-9)


def test_it_has_all_runs_of_table_4():
    names = {run.name for shape in ('sine', 'square')
             for run in PROCEDURES[f'open_loop_{shape}'].runs(Choices(PERIOD))}
    assert names == {f'{shape}_{u}V_{f}Hz' for shape in ('sine', 'square')
                     for u in (1.5, 1.6, 1.7, 1.8) for f in (1, 0.5)}


@given(strategies.floats(0.02, 1.0), strategies.floats(0.1, 2.0 * pi))
def test_it_holds_the_speed_over_the_whole_angle_and_comes_back(speed, angle):
    wave = setpoint_profiles.there_and_back(speed, angle, 2e-3)
    held = np.sum(np.isclose(wave, speed)) * 2e-3 * speed
    assert held == pytest.approx(angle, abs=2.1 * speed * 2e-3)
    assert abs(np.cumsum(wave)[-1] * 2e-3) < 1e-9
    assert abs(np.diff(wave)).max() <= setpoint_profiles.ACCELERATION * 2e-3 + 1e-12


@pytest.mark.parametrize(('name', 'choices', 'limits', 'said'), [
    ('friction', Choices(speeds=(3.5,)), Limits(), 'speed of 3.5 rad/s, the limit is 3 rad/s'),
    ('friction', Choices(), Limits(travel=5.0), 'travel of 6.283 rad'),
    ('position_ramp', Choices(speeds=(0.5,)), Limits(speed=0.4), 'speed of 0.5'),
    ('backlash', Choices(torques=(400.0,)), Limits(), 'torque of 400 N m'),
    ('coast_down', Choices(), Limits(current=1.0), 'current of 1.078 A'),
])
def test_it_refuses_a_plan_beyond_a_limit(name, choices, limits, said):
    with pytest.raises(LimitError, match=said):
        for run in PROCEDURES[name].runs(choices):
            limits.check(run, gain=0.49)


def test_it_refuses_choices_and_limits_that_make_no_sense():
    with pytest.raises(ValueError, match=r'speeds = -1; it must be positive'):
        PROCEDURES['friction'].runs(Choices(speeds=(-1.0,)))
    with pytest.raises(LimitError, match='limit of torque = 0'):
        Limits(torque=0.0)


def test_a_load_that_moves_straight_has_limits_in_m_and_n_and_none_is_usual():
    axis = load(CONFIG / 'servos' / 'emps.yaml')
    with pytest.raises(LimitError, match='--max-speed in m/s and --max-torque in N and --max-tr'):
        limits_of(axis, {'current': 2.0, 'speed': None})
    limits = limits_of(axis, {'speed': 0.4, 'torque': 50.0, 'travel': 0.2, 'current': None})
    assert limits.current == Limits().current
    with pytest.raises(LimitError, match='speed of 0.5 m/s, the limit is 0.4 m/s'):
        for run in PROCEDURES['position_ramp'].runs(Choices(PERIOD, speeds=(0.5,))):
            limits.check(run)
    guard = Guard(limits, 0.0, PERIOD)
    assert guard.see(torque=60.0) == 'torque: 60 N measured; the limit is 50 N'
    assert 'm measured' in guard.see(position=0.3)
    assert limits_of(load(CONFIG / 'servos' / 'rv_bench.yaml'), {'speed': 2.0}) == Limits(2.0)


@given(strategies.floats(0.5, 8.0))
def test_it_speaks_before_the_speed_is_exceeded(acceleration):
    guard = Guard(Limits(speed=1.0, travel=100.0), 0.0, PERIOD)
    time = np.arange(0.0, 2.5, PERIOD)
    for t in time:
        if guard.see(position=0.5 * acceleration * t * t):
            break
    assert acceleration * (t + 0.95 * REACTION) < 1.01
    assert acceleration * (t + 1.5 * REACTION) > 0.99


def test_it_speaks_while_the_load_can_still_be_stopped():
    guard = Guard(Limits(travel=1.0), 2.0, PERIOD)
    said = [guard.see(position=2.0 - 0.8 * t) for t in np.arange(0.0, 1.2, PERIOD)]
    at = 0.8 * PERIOD * next(k for k, text in enumerate(said) if text)
    assert 1.0 - 0.8 * REACTION - 0.8 ** 2 / 4.0 == pytest.approx(at, abs=0.01)
    guard.forget()
    assert 'travel' in guard.see(position=0.9)


def test_it_judges_torque_and_current_and_lets_pass_what_is_not_measured():
    guard = Guard(Limits(torque=50.0, current=2.0), 0.0, PERIOD)
    assert guard.see(torque=nan, current=nan) == guard.see(torque=inf) == ''
    assert guard.see(torque=-51.0) == 'torque: 51 N m measured; the limit is 50 N m'
    assert guard.see(current=2.5).startswith('current: 2.5 A')
    assert not guard.at_rest()
    for _ in range(100):
        guard.see(position=0.3)
    assert guard.at_rest() and guard.speed == 0.0


@pytest.mark.slow
def test_it_makes_the_same_recordings_without_a_bus(tmp_path, capsys):
    words = ['experiment', 'load_steps', '--headless', '-o', str(tmp_path), '--duration', '2',
             '--replicates', '2', '--torques', '40', '--set', 'friction.level=1.2']
    assert main(words) == 0
    recording = read_recording(tmp_path / 'load_steps_2')
    assert (recording.family, recording.replicate, recording.servo) == ('load_steps', 2,
                                                                         'rv_bench')
    assert recording['external_torque'].max() == pytest.approx(40.0, rel=0.05)
    assert abs(recording['load_position']).max() > 0.05
    assert main(words) == 2
    assert 'exists already' in capsys.readouterr().err
    assert main(['experiment', 'dance', '-o', str(tmp_path)]) == 2
    assert "no procedure 'dance'" in capsys.readouterr().err


def started(folder, *words):
    return subprocess.Popen(
        [sys.executable, '-m', 'servo_identify.cli', 'experiment', *words, '-o', str(folder)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


class LoadAngle:
    """Hears the angle of the load, at the low rate of joint_states."""

    def __init__(self, namespace):
        self.context, self.heard = Context(), []
        rclpy.init(context=self.context)
        self.node = Node('load_angle', namespace=namespace, context=self.context)
        self.node.create_subscription(JointState, 'joint_states', self.heard.append, 10)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def moved(self):
        """Listen for a moment; return how far the load is from where it was at first, rad."""
        self.executor.spin_once(0.1)
        first, last = (message.position[message.name.index('load')]
                       for message in (self.heard[0], self.heard[-1])) if self.heard else (0, 0)
        return abs(last - first)

    def rests(self):
        """Listen for half a second, past what had waited; return whether the load stands still."""
        for messages in (15, 25):
            del self.heard[:]
            wait_until(lambda many=messages: self.moved() < 0.0 or len(self.heard) > many,
                       'it is heard', 60.0)
        return self.moved() < 1e-4

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def spoke_at(guard, position):
    """Return at which sample a guard speaks; NaN is a lost one."""
    for k, angle in enumerate(position):
        if np.isnan(angle):
            guard.forget()
        elif guard.see(position=angle):
            return k
    raise AssertionError('the guard never speaks')


class BlindRig:
    """A rig whose load encoder tells nothing any more once it was told to move."""

    def __init__(self, namespace):
        self.context, self.heard = Context(), []
        rclpy.init(context=self.context)
        self.node = Node('blind', namespace=namespace, context=self.context)
        self.node.create_subscription(Command, 'command', self.heard.append, 10)
        self._topic = self.node.create_publisher(Encoder, 'encoder', 10)
        self.node.create_timer(0.01, self._say)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._thread = Thread(target=self.executor.spin, daemon=True)
        self._thread.start()

    def _say(self):
        angle = nan if self.heard else 0.0
        self._topic.publish(Encoder(period=PERIOD, load_position=[angle] * 10))

    def close(self):
        self.executor.shutdown()
        self._thread.join(5.0)
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.mark.ros
def test_it_stops_when_the_load_is_seen_no_more():
    run = PROCEDURES['friction'].runs(Choices(PERIOD))[0]
    with closing(BlindRig('blind')) as rig, Performer('blind', Limits()) as performer:
        performer.begin(30.0)
        with pytest.raises(Stopped, match='no samples with a load angle for 0.3 s'):
            performer.perform(run, lambda share: None)
        assert performer.stands == 'the motor is off; the load was not seen at rest'
        wait_until(lambda: rig.heard and rig.heard[-1].mode == Command.OFF, 'it is off', 60.0)


class SeeingRig(BlindRig):
    """A rig whose load stands still, and is seen."""

    def _say(self):
        self._topic.publish(Encoder(period=PERIOD, load_position=[0.0] * 10))


@pytest.mark.ros
@pytest.mark.parametrize('step', [-3600.0, -0.5, 0.5, 3600.0])
def test_it_stops_where_the_wall_clock_is_set(step, monkeypatch):
    run = PROCEDURES['friction'].runs(Choices(PERIOD))[0]
    with closing(SeeingRig('clocked')) as rig, Performer('clocked', Limits()) as performer:
        performer.begin(30.0)
        monkeypatch.setattr(performer, '_now', lambda: time_ns() + (
            round(step * 1e9) if len(rig.heard) > 2 else 0))
        begun = monotonic()
        with pytest.raises(Stopped, match=rf'the clock was set by \{step:+.1f} s'):
            performer.perform(run, lambda share: None)
        assert monotonic() - begun < 15.0
        wait_until(lambda: rig.heard[-1].mode == Command.OFF, 'it is off', 60.0)


@pytest.mark.long
@pytest.mark.ros
def test_it_leaves_a_usable_bag_and_a_motor_at_rest_when_it_ends_early(tmp_path):
    patient = tmp_path / 'driver.yaml'  # a busy machine stands still for longer than a drive waits
    patient.write_text((CONFIG / 'driver.yaml').read_text().replace(
        'command_timeout: 0.1 ', 'command_timeout: 1.0 ').replace(
        'heartbeat_timeout: 0.5 ', 'heartbeat_timeout: 3.0 '))
    with closing(LoadAngle('rig')) as load, Processes(tmp_path / 'logs') as processes, \
            emulated_bench(processes, 'rig', CONFIG / 'rigs' / 'rv_bench.yaml', patient,
                           watchdog=2.0):
        for attempt in ATTEMPTS:
            asked = started(tmp_path / attempt, 'friction', '--speeds', '0.5')
            bag = tmp_path / attempt / 'friction_0.5'
            assert asked.stdout.readline() == 'playing friction_0.5\n'
            load.heard.clear()
            wait_until(lambda asked=asked: load.moved() > 0.15 or asked.poll() is not None,
                       'the load turns', 60.0, processes)
            asked.send_signal(signal.SIGINT)
            _, said = asked.communicate(timeout=60.0)
            assert asked.returncode == 1
            if 'ended early: interrupted' in said:
                break
        assert 'ended early: interrupted; the motor is at rest' in said
        recording = read_recording(bag)
        position = recording['load_position']
        assert recording.family == 'friction'
        # a driver on a busy machine leaves samples out and says so; all others are there
        lost = [said for said in recording.warnings if 'samples lost in' in said]
        assert np.isfinite(position).all() == (not lost)
        assert 0.1 < np.nanmax(position) - np.nanmin(position) < 3.0
        assert load.rests()  # the bag of a busy recorder may end sooner

        for attempt in ATTEMPTS:
            bag = tmp_path / f'fast_{attempt}' / 'coast_down'
            asked = started(bag.parent, 'coast_down', '--amplitudes', '3.5', '--max-speed', '1.5')
            _, said = asked.communicate(timeout=60)
            assert asked.returncode == 1, said
            if 'ended early: speed: ' in said:
                break
        assert 'ended early: speed: ' in said and 'the limit is 1.5 rad/s' in said
        # what the guard promises hangs on no machine: a reaction after it speaks all is well yet
        position = read_recording(bag)['load_position']
        guard = Guard(Limits(speed=1.5), position[0], 1e-3)
        spoke = spoke_at(guard, position)
        speed = abs(position[20:] - position[:-20]) / 0.02
        assert 0.75 < np.nanmax(speed[:spoke + round(REACTION / 1e-3) - 20 + 1]) < 1.5
        assert load.rests()  # the bag of a busy recorder may end sooner
