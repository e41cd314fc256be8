"""
Rig, hub, driver and a reader as four processes: loss, latency and CPU share at a sampling rate.

    python tests/benchmarks/bench_chain_driver.py                      1 kHz, one a message, 60 s
    python tests/benchmarks/bench_chain_driver.py --rate 4000 --block 20

Latency is counted from the instant of the last sample in a message to the reader's callback, over
two hops of the bus and one of ROS. Reference: DESIGN.md's measurement of driver, twin and sink.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
from time import monotonic, time_ns

import numpy as np
import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.qos import QoSProfile
from rclpy.task import Future

from servo_rig_driver.ros_start import udp_alone
from servo_twin_msgs.msg import Command, Current, Encoder, Torque

ROOT = Path(__file__).resolve().parents[2]
TICK = os.sysconf('SC_CLK_TCK')
REFERENCE = ('DESIGN.md, 1 kHz, one a message: 0 of 20 000 lost, 506 us median, 2051 us p99, '
             'driver 18 %')


class Reader:
    """Counts what comes on the three topics of the samples; latencies in us of `current`."""

    def __init__(self, node: rclpy.node.Node, rate: float, block: int) -> None:
        self.back = round((block - 1) * 1e9 / rate)
        self.next: dict[str, int] = {}
        self.samples = dict.fromkeys(('encoder', 'torque', 'current'), 0)
        self.lost = dict.fromkeys(self.samples, 0)
        self.latencies: list[float] = []
        self.sizes: dict[str, str] = {'encoder': 'load_position', 'torque': 'torque',
                                      'current': 'current'}
        qos = QoSProfile(depth=max(1000, round(2 * rate / block)))
        for kind, name in ((Encoder, 'encoder'), (Torque, 'torque'), (Current, 'current')):
            node.create_subscription(kind, name, lambda m, n=name: self.take(n, m), qos)

    def take(self, name: str, message: Encoder | Torque | Current) -> None:
        now = time_ns()
        size = len(getattr(message, self.sizes[name]))
        self.lost[name] += message.sequence - self.next.get(name, message.sequence)
        self.next[name] = message.sequence + size
        self.samples[name] += size
        if name == 'current':
            stamp = message.header.stamp
            taken = stamp.sec * 10**9 + stamp.nanosec + self.back
            self.latencies.append((now - taken) * 1e-3)

    def restart(self) -> None:
        self.next.clear()
        self.latencies.clear()
        for counts in (self.samples, self.lost):
            counts.update(dict.fromkeys(counts, 0))


def cpu_seconds(process: int) -> float:
    """Return the CPU time that a process has used, s."""
    fields = Path(f'/proc/{process}/stat').read_text().rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def start(module: str, *words: str) -> subprocess.Popen:
    return subprocess.Popen([sys.executable, '-m', module, *words], stdout=subprocess.DEVNULL)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--rate', type=float, default=1000.0, help='samples a second')
    parser.add_argument('--block', type=int, default=1, help='samples a message')
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--priority', type=int, default=0, help="driver's realtime_priority")
    parser.add_argument('--rig', default=str(ROOT / 'config' / 'rigs' / 'rv_bench.yaml'))
    asked = parser.parse_args()
    channel = str(Path(tempfile.mkdtemp()) / 'rig.can')
    namespace = f'bench_{os.getpid()}'
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.update(udp_alone(os.environ))
    running = {
        'hub': start('servo_rig_driver.can_bus.can_hub', channel),
        'rig': start('servo_rig_driver.emulated.rig_process', '--rig', asked.rig, '--channel',
                     channel),
        'driver': start('servo_rig_driver.driver.driver_node', '--ros-args', '--params-file',
                        str(ROOT / 'config' / 'driver.yaml'), '-p', f'bus.channel:={channel}',
                        '-p', f'sync_period:={1 / asked.rate}', '-p',
                        f'block_size:={asked.block}', '-p',
                        f'realtime_priority:={asked.priority}', '-p',
                        'enable_after_loss:=true', '-r', f'__ns:=/{namespace}'),
    }
    rclpy.init()
    node = rclpy.create_node('reader', namespace=namespace)
    executor = EventsExecutor()
    executor.add_node(node)
    reader = Reader(node, asked.rate, asked.block)
    command = node.create_publisher(Command, 'command', 10)

    def spin(seconds: float) -> None:
        until = monotonic() + seconds
        while monotonic() < until:
            executor.spin_until_future_complete(Future(), until - monotonic())

    def drive() -> None:
        """Send half a second of a slow sine, again and again, as an operator's program would."""
        start_at = node.get_clock().now().nanoseconds
        message = Command(mode=Command.VELOCITY, period=0.01, reference=[
            0.3 * np.sin(start_at * 1e-9 + 0.01 * k) for k in range(50)])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(start_at, 10**9)
        command.publish(message)

    node.create_timer(0.25, drive)
    try:
        until = monotonic() + 60.0
        while not reader.samples['current'] and monotonic() < until:
            spin(0.2)
        if not reader.samples['current']:
            print('no sample came within 60 s')
            return 1
        spin(2.0)
        reader.restart()
        processes = {name: process.pid for name, process in running.items()} | {
            'reader': os.getpid()}
        before = {name: cpu_seconds(number) for name, number in processes.items()}
        begun = monotonic()
        spin(asked.seconds)
        elapsed = monotonic() - begun
        share = {name: (cpu_seconds(number) - before[name]) / elapsed
                 for name, number in processes.items()}
        report(asked, reader, share, elapsed)
    finally:
        for process in running.values():
            process.send_signal(signal.SIGTERM)
        for process in running.values():
            process.wait(20.0)
        node.destroy_node()
        rclpy.try_shutdown()
    return 0 if not sum(reader.lost.values()) else 1


def report(asked: argparse.Namespace, reader: Reader, share: dict[str, float], elapsed: float
           ) -> None:
    median, p99, p999, worst = np.percentile(reader.latencies, [50, 99, 99.9, 100])
    print(f'{asked.rate:g} Hz, {asked.block} a message, {elapsed:.1f} s, '
          f'priority {asked.priority}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}')
    print(f'samples {reader.samples}, expected {asked.rate * elapsed:.0f}, lost {reader.lost}')
    print(f'latency, us: median {median:.0f}, p99 {p99:.0f}, p99.9 {p999:.0f}, max {worst:.0f}')
    print('CPU, % of a core: ' + ', '.join(f'{name} {100 * used:.0f}'
                                           for name, used in share.items()))
    print(f'reference: {REFERENCE}')


if __name__ == '__main__':
    raise SystemExit(main())
