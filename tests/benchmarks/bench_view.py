"""
The live view: frames a second in a browser, and what the server costs with and without one.

    python tests/benchmarks/bench_view.py                     4 kHz in blocks of 40, 10 s each
    python tests/benchmarks/bench_view.py --rate 1000 --block 10

A program publishes samples, predictions and residuals of a rig that moves; `servo-twin view`
serves them to a headless Chromium, which draws without a graphics card. Frames are counted by
requestAnimationFrame.
"""

from __future__ import annotations

import argparse
from array import array
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
import rclpy
from rclpy.qos import QoSProfile

from servo_rig_driver.ros_start import udp_alone
from servo_twin.nodes.message_conversion import to_time, TOPICS
from servo_twin_msgs.msg import Prediction, Residual

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'support'))
from headless_chromium import Browser

COUNT = """new Promise(done => {
  const times = [];
  const note = now => {
    times.push(now);
    now - times[0] < %d ? requestAnimationFrame(note) : done(times);
  };
  requestAnimationFrame(note);
})"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--rate', type=float, default=4000.0, help='samples a second')
    parser.add_argument('--block', type=int, default=40, help='samples a message')
    parser.add_argument('--seconds', type=float, default=10.0)
    parser.add_argument('--width', type=int, default=1400, help='of the window, px')
    parser.add_argument('--height', type=int, default=900, help='of the window, px')
    parser.add_argument('--publish', action='store_true', help=argparse.SUPPRESS)
    asked = parser.parse_args()
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.update(udp_alone(os.environ))
    os.environ.setdefault('ROS_DOMAIN_ID', '99')
    if asked.publish:
        return publish(asked)
    source = subprocess.Popen([sys.executable, *sys.argv, '--publish'])
    view = subprocess.Popen([sys.executable, '-m', 'servo_twin.cli', 'view', '--namespace',
                             'bench', '--port', '0'], stdout=subprocess.PIPE, text=True)
    try:
        return measure(asked, view, re.search(r'http://\S+', view.stdout.readline())[0])
    finally:
        for process in (source, view):
            process.send_signal(signal.SIGINT)
            process.wait(10.0)


def measure(asked: argparse.Namespace, view: subprocess.Popen, url: str) -> int:
    """Print the figures of a view that runs."""
    time.sleep(2.0)
    print(f'nobody looks: {share(view.pid, asked.seconds):.1%} of a core')
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        browser = Browser(Path(folder))
        try:
            browser.open(url, asked.width, asked.height)
            browser.until('buckets.count > 300 && buckets.known("balance.load")')
            begin, before = time.monotonic(), cpu_seconds(view.pid)
            times = np.array(browser.run(COUNT % round(asked.seconds * 1000)))
            used = (cpu_seconds(view.pid) - before) / (time.monotonic() - begin)
            plots = browser.run('visible.size')
            errors = browser.errors
        finally:
            browser.close()
    gaps = np.diff(times)
    print(f'one browser, {asked.width} x {asked.height} px, {plots} plots in sight, '
          f'{asked.rate:g} samples a second: {1e3 / gaps.mean():.1f} frames a second, '
          f'99 % within {np.percentile(gaps, 99):.1f} ms; the server takes {used:.1%} of a core; '
          f'{len(errors)} errors; load of the machine {os.getloadavg()[0]:.1f} on '
          f'{len(os.sched_getaffinity(0))} cores')
    return 0


def share(pid: int, seconds: float) -> float:
    """Return the share of a core that a process takes over some seconds."""
    begin, before = time.monotonic(), cpu_seconds(pid)
    time.sleep(seconds)
    return (cpu_seconds(pid) - before) / (time.monotonic() - begin)


def cpu_seconds(pid: int) -> float:
    """Return the processor time that a process has taken (Linux)."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def publish(asked: argparse.Namespace) -> int:
    """Publish all topics of a rig and its twin at an even rate, until a signal."""
    rclpy.init()
    node = rclpy.create_node('source', namespace='bench')
    kinds = {**TOPICS, 'twin/prediction': Prediction, 'twin/residual': Residual}
    topics = []
    for topic, kind in kinds.items():
        fields = kind.get_fields_and_field_types()
        names = [name for name, of in fields.items() if of == 'sequence<double>']
        topics.append((node.create_publisher(kind, topic, QoSProfile(depth=1000)), kind(), names))
    random = np.random.default_rng(1)
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    start, begin, sequence = time.time_ns(), time.monotonic(), 0
    while rclpy.ok():
        rest = begin + (sequence + asked.block) / asked.rate - time.monotonic()
        if rest > 0.0:
            time.sleep(rest)
        t = (sequence + np.arange(asked.block)) / asked.rate
        values = array('d', (np.sin(1.5 * t) + 0.05 * random.standard_normal(len(t))).tobytes())
        for publisher, message, names in topics:
            message.header.stamp = to_time(start + round(sequence / asked.rate * 1e9))
            message.sequence, message.period = sequence, 1.0 / asked.rate
            for name in names:
                setattr(message, name, values)
            publisher.publish(message)
        sequence += asked.block
    return 0


if __name__ == '__main__':
    sys.exit(main())
