"""
The live chain, rig - driver - twin - recorder, as processes: loss, latency and CPU share.

    python tests/benchmarks/bench_chain.py                          1 kHz, one a message, 60 s
    python tests/benchmarks/bench_chain.py --rate 4000 --block 20
    python tests/benchmarks/bench_chain.py --driver moteus odrive   shipped drives, at their rates
    python tests/benchmarks/bench_chain.py --driver adapter         a robot's JointState instead
    python tests/benchmarks/bench_chain.py --driver all --block 5 --seconds 20
    python tests/benchmarks/bench_chain.py --busy 6                 the machine loaded on purpose

With --driver adapter an emulated ros2_control robot at 500 Hz and the adapter take the place of
bus, rig and driver. Latency then counts from the stamp that the robot gives.

With --busy so many processes take the cores for the middle half of the time. What the twin says
of itself in its diagnostics is printed below.

All figures are read off the bag: latency is from the instant of the last sample in a message to
the recorder's taking of it. A residual is late by half a filter window by design; its second
figure is what comes on top. Reference: DESIGN.md's measurement of driver, twin and sink.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
from time import monotonic

from bench_chain_driver import cpu_seconds, ROOT, start
import numpy as np
import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.task import Future
from rosbags.highlevel import AnyReader
from speed_table import row
import yaml

from servo_rig_driver.ros_start import udp_alone
from servo_twin.bag.message_definitions import own_types
from servo_twin.balances.residual_filters import WINDOW
from servo_twin_msgs.msg import Command

CONFIG = ROOT / 'config'
REFERENCE = ('DESIGN.md, 1 kHz, one a message, driver - twin - sink: 0 of 20 000 lost, 506 us '
             'median, 2051 us p99, CPU 18 / 28 / 14 %')
DRIVERS = ('canopen', 'odrive', 'robstride', 'cubemars', 'moteus', 'adapter')
MACHINES = {'canopen': 'rv_bench', 'adapter': 'ros2_control_joint'}
"""Names of rig and servo file where they are not those of the drive."""
SIZES = {'encoder': 'load_position', 'torque': 'torque', 'current': 'current',
         'twin/prediction': 'torque', 'twin/residual': 'torque'}
RIG = ('encoder', 'torque', 'current')


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--rate', type=float, help='samples a second (default: that of the drive)')
    parser.add_argument('--block', type=int, default=1, help='samples a message')
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--mode', default='measured_input')
    parser.add_argument('--busy', type=int, default=0, help='processes that only take the cores')
    parser.add_argument('--driver', nargs='+', metavar='NAME', default=['canopen'],
                        choices=[*DRIVERS, 'all'], help=f'one or some of {DRIVERS}, or all')
    parser.add_argument('--rig', help='rig file (default: that of the drive, else rv_bench)')
    asked = parser.parse_args()
    wanted = DRIVERS if 'all' in asked.driver else asked.driver
    found = {name: measured(argparse.Namespace(**{**vars(asked), 'driver': name}))
             for name in wanted}
    first = found[wanted[0]][1]
    for name, (lost, median) in found.items():
        print(f'{name}: {lost} lost, median to the prediction {median / first:.2f} times that '
              f'of {wanted[0]}')
    return int(any(lost for lost, _ in found.values()))


def measured(asked: argparse.Namespace) -> tuple[int, float]:
    """Run the chain of one drive; return lost samples and the median latency, us."""
    asked.files = drive_files(asked.driver)
    asked.machine = MACHINES.get(asked.driver, asked.driver)
    asked.rig = asked.rig or str(CONFIG / 'rigs' / f'{asked.machine}.yaml')
    asked.rate = 500.0 if asked.driver == 'adapter' else asked.rate or rate_of(asked.files[-1])
    with tempfile.TemporaryDirectory() as folder:
        shares = run(asked, Path(folder))
        return report(asked, Path(folder) / 'bag', shares)


def drive_files(name: str) -> list[Path]:
    """Return the parameter files of a driver, the later ones on top."""
    own = CONFIG / 'drivers' / f'{name}.yaml'
    return [CONFIG / 'driver.yaml', *([own] if own.exists() else [])]


def rate_of(file: Path) -> float:
    """Return the samples a second that a driver's file asks for."""
    content = yaml.safe_load(file.read_text())['/**/driver']['ros__parameters']
    return 1.0 / content.get('sync_period', 1e-3)


def run(asked: argparse.Namespace, folder: Path) -> dict[str, float]:
    """Run the chain and return the CPU share of each process."""
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.update(udp_alone(os.environ))
    channel = str(folder / 'rig.can')
    servo = str(CONFIG / 'servos' / f'{asked.machine}.yaml')
    spaced = ('--ros-args', '-r', '__ns:=/bench')
    rclpy.init()
    node = rclpy.create_node('operator', namespace='bench')
    executor = EventsExecutor()
    executor.add_node(node)
    command = node.create_publisher(Command, 'command', 10)

    def spin(seconds: float) -> None:
        until = monotonic() + seconds
        while monotonic() < until:
            executor.spin_until_future_complete(Future(), until - monotonic())

    def wait(count: int) -> None:
        until = monotonic() + 60.0
        while node.count_subscribers('encoder') < count and monotonic() < until:
            spin(0.1)

    def drive() -> None:
        """Send half a second of a slow sine, again and again, as an operator's program would."""
        now = node.get_clock().now().nanoseconds
        message = Command(mode=Command.VELOCITY, period=0.01, reference=[
            0.3 * np.sin(now * 1e-9 + 0.01 * k) for k in range(50)])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 10**9)
        command.publish(message)

    node.create_timer(0.25, drive)
    robot, source = (of_a_robot if asked.driver == 'adapter' else of_a_drive)(
        asked, channel, spaced)
    running = {
        **robot(),
        'recorder': start('servo_rig_driver.record.recorder_node', *spaced, '-p',
                          f'output:={folder}/bag',
                          '-p', f'servo_file:={servo}'),
        'twin': start('servo_twin.nodes.twin_node', *spaced, '-p', 'autostart:=true', '-p',
                      f'servo_file:={servo}', '-p', f'mode:={asked.mode}'),
    }
    try:
        wait(2)
        spin(1.0)
        running |= source()
        spin(5.0)
        before = {name: cpu_seconds(process.pid) for name, process in running.items()}
        begun = monotonic()
        spin(0.25 * asked.seconds)
        with taken(asked.busy):
            spin(0.5 * asked.seconds)
        spin(0.25 * asked.seconds)
        elapsed = monotonic() - begun
        return {name: (cpu_seconds(process.pid) - before[name]) / elapsed
                for name, process in running.items()}
    finally:
        for name in ('driver', 'adapter', 'twin', 'recorder', 'robot', 'rig', 'hub'):
            if name in running:
                running[name].send_signal(signal.SIGKILL if name == 'robot' else signal.SIGTERM)
                running[name].wait(20.0)
                spin(0.5)
        node.destroy_node()
        rclpy.try_shutdown()


Started = dict[str, subprocess.Popen]


def of_a_drive(asked: argparse.Namespace, channel: str, spaced: tuple[str, ...]
               ) -> tuple[Callable[[], Started], Callable[[], Started]]:
    """Return what starts bus and rig, and what starts the driver."""
    return (lambda: {
        'hub': start('servo_rig_driver.can_bus.can_hub', channel),
        'rig': start('servo_rig_driver.emulated.rig_process', '--rig', asked.rig, '--channel',
                     channel, '--driver', str(asked.files[-1]), '--period', str(1 / asked.rate)),
    }, lambda: {'driver': start(
        'servo_rig_driver.driver.driver_node', *spaced,
        *(word for file in asked.files for word in ('--params-file', str(file))),
        '-p', 'autostart:=true', '-p', 'enable_after_loss:=true', '-p', f'bus.channel:={channel}',
        '-p', f'sync_period:={1 / asked.rate}', '-p', f'block_size:={asked.block}')})


def of_a_robot(asked: argparse.Namespace, channel: str, spaced: tuple[str, ...]
               ) -> tuple[Callable[[], Started], Callable[[], Started]]:
    """Return what starts an emulated robot, and what starts the adapter beside it."""
    stack = ROOT / 'tests' / 'support' / 'ros2_control_stack.py'
    mapping = CONFIG / 'imports' / 'ros2_control_joint.yaml'
    return (lambda: {'robot': subprocess.Popen(
        [sys.executable, stack, str(asked.seconds + 120.0)])}, lambda: {'adapter': start(
            'servo_rig_driver.adapter.adapter_node', *spaced, '-p', f'mapping:={mapping}',
            '-p', 'joint:=hip', '-p', f'block_size:={asked.block}')})


@contextmanager
def taken(count: int) -> Iterator[None]:
    """Have so many processes compute and do nothing else."""
    busy = [subprocess.Popen([sys.executable, '-c', 'while True: pass']) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def said(bag: Path) -> str:
    """Return the most that the twin was behind, and what it did about it, by its diagnostics."""
    behind, facts, words = 0.0, {}, set()
    with AnyReader([bag], default_typestore=own_types()) as reader:
        for connection, _, data in reader.messages(
                [c for c in reader.connections if c.topic == '/diagnostics']):
            for status in reader.deserialize(data, connection.msgtype).status:
                if status.name == '/bench/twin: twin':
                    facts = {value.key: value.value for value in status.values}
                    behind = max(behind, float(facts.get('seconds behind, at worst', 0.0)))
                    words |= {word for word in ('catching up by larger blocks', 'began again at '
                                                'the newest sample') if word in status.message}
    counts = ', '.join(f'{key} {facts.get(key)}' for key in (
        'blocks joined to catch up', 'left out, overload', 'restarts'))
    return f'the twin says: {behind:.2f} s behind at worst; {counts}; {"; ".join(sorted(words))}'


def report(asked: argparse.Namespace, bag: Path, shares: dict[str, float]) -> tuple[int, float]:
    """Print what the bag says; return predictions that are missing and their latency, us."""
    spans = {topic: [] for topic in SIZES}
    late = {topic: [] for topic in SIZES}
    with AnyReader([bag], default_typestore=own_types()) as reader:
        for connection, taken, data in reader.messages():
            topic = connection.topic.removeprefix('/bench/')
            if topic not in SIZES:
                continue
            message = reader.deserialize(data, connection.msgtype)
            size = len(getattr(message, SIZES[topic]))
            stamp = message.header.stamp
            last = stamp.sec * 10**9 + stamp.nanosec + round((size - 1) * 1e9 / asked.rate)
            spans[topic].append((message.sequence, size))
            late[topic].append((taken - last) * 1e-3)
    print(f'{asked.driver}, {asked.rate:g} Hz, {asked.block} a message, '
          f'{asked.seconds:g} s, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}')
    lost, numbers, medians = {}, {}, {}
    for topic, found in spans.items():
        numbers[topic] = np.concatenate([np.arange(s, s + n) for s, n in found])
        lost[topic] = int(np.ptp(numbers[topic])) + 1 - len(numbers[topic])
        taken_late = np.array(late[topic][len(late[topic]) // 20:])
        by_design = WINDOW / 2 * 1e6 if topic == 'twin/residual' else 0.0
        middle, p99, p999, worst = np.percentile(taken_late, [50, 99, 99.9, 100]) - by_design
        medians[topic] = middle
        also = f', beside {by_design:.0f} by design' if by_design else ''
        print(f'{topic:<16} {len(numbers[topic])} samples, lost {lost[topic]}; latency, us: '
              f'median {middle:.0f}, p99 {p99:.0f}, p99.9 {p999:.0f}, max {worst:.0f}{also}')
        if topic == 'twin/prediction':
            row(f'live chain, {asked.driver}, {asked.rate:g} Hz, {asked.block} a message, '
                f'{asked.seconds:g} s: sample to prediction in the bag',
                f'{lost[topic]} of {len(numbers[topic])} lost; median {middle:.0f} us, 99 % '
                f'{p99:.0f} us', REFERENCE)
    heard = set(numbers['encoder']) & set(numbers['torque']) & set(numbers['current'])
    for topic in ('twin/prediction', 'twin/residual'):
        unanswered = len(heard - set(numbers[topic]))
        print(f'{topic}: {unanswered} of {len(heard)} recorded samples have no answer')
    print(said(bag))
    print('CPU, % of a core: ' + ', '.join(f'{name} {100 * share:.0f}'
                                           for name, share in shares.items()))
    print(f'reference: {REFERENCE}')
    return max(lost.values()), medians['twin/prediction']


if __name__ == '__main__':
    raise SystemExit(main())
