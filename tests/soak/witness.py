"""What is judged from outside: the bus log, the topics, /diagnostics and /proc."""

from __future__ import annotations

from collections import defaultdict, deque
from dataclasses import dataclass, field
from functools import partial
from math import inf
import os
from pathlib import Path
from threading import Thread
from time import time

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import QoSProfile
from wire_proxy import CONTROL, MODE, RECORD, STATUS, SYNC, VELOCITY, VOLTAGE

from servo_twin_msgs.msg import Command, Encoder, Event, Prediction

TIMEOUT, LIMIT = 0.1, 2.0  # s, rad/s: command_timeout and limit.velocity of the driver
LOOKED = 0.02  # s between a frame and its entry in the log, on a loaded machine
READ = 0.003  # s: the age of a set-point by its value, which the bus carries in steps
SLOPE, TOP, HALF = 0.05, 0.5, 20.0  # rad/s2, rad/s, s: the reference, which tells its own time
VELOCITY_MODE = 9
WATCHDOG = 0.1  # s without SYNC, of the emulated drive


def reference(at: float) -> float:
    """Return the set-point of an instant, rad/s: a triangle, so that a value tells its age."""
    phase = at % (2.0 * HALF)
    return SLOPE * (phase if phase < HALF else 2.0 * HALF - phase) - TOP


def age(value: float, sent: float, seen: float | None = None) -> float:
    """
    Return how old a set-point of this value was at least when it was sent, s.

    It was sent between ``sent`` and ``seen``, left out at ``sent``; negative: due only after
    ``sent``. The reference has each value twice: what makes it younger counts.
    """
    phase, span = (value + TOP) / SLOPE, (sent if seen is None else seen) - sent
    ages = []
    for place in (phase, 2.0 * HALF - phase):
        ahead = (place - sent) % (2.0 * HALF)
        ages.append(-ahead if ahead <= span + 1.0 else 2.0 * HALF - ahead)
    return min(ages)


def last_instant(message: Encoder | Prediction) -> float:
    """
    Return the instant of the last sample of a message, s; at most now.

    These ears may be behind: when a message is heard says nothing of who still sends.
    """
    stamp = message.header.stamp
    begin = stamp.sec + 1e-9 * stamp.nanosec
    return min(time(), begin + message.period * len(message.load_position))


@dataclass
class Bus:
    """What the log of the bus holds so far."""

    path: Path
    at: int = 0
    mode: int = 0
    control: int = 0
    status: int = 0
    sync: float = 0.0
    torque_since: float | None = None
    zero_since: float | None = 0.0
    moved: float = 0.0
    commands: int = 0
    oldest: float = 0.0
    powerless: int = 0
    stale: list[tuple[float, float]] = field(default_factory=list)
    beyond: list[tuple[float, float]] = field(default_factory=list)
    zeroed: deque = field(default_factory=lambda: deque(maxlen=1000))

    def read(self) -> None:
        """Take in what the proxy has written since."""
        with self.path.open('rb') as file:
            file.seek(self.at)
            data = file.read()
        whole = len(data) // RECORD.size * RECORD.size
        self.at += whole
        for sent, now, kind, value in RECORD.iter_unpack(data[:whole]):
            if kind == SYNC:
                self._missed(now)
                self.sync = now
            elif kind == MODE:
                self.mode = int(value)
            elif kind == CONTROL:
                self.control = int(value)
            elif kind == STATUS:
                self._stands(now, int(value))
            elif kind == VELOCITY:
                self._told(now, sent, value)
            elif kind == VOLTAGE and self.mode != VELOCITY_MODE:
                self._zero(now, value == 0.0)
        self._missed(time() - LOOKED)

    def _missed(self, now: float) -> None:
        """Without SYNC the drive takes its torque away by itself: its watchdog."""
        if self.sync and now - self.sync > WATCHDOG:
            self._zero(self.sync + WATCHDOG, True)

    def _stands(self, now: float, status: int) -> None:
        self.status = status
        if status & 0x6F != 0x27:
            self._zero(now, True)

    def _zero(self, now: float, zero: bool) -> None:
        if zero and self.zero_since is None:
            self.zero_since = now
            self.zeroed.append(now)
        elif not zero:
            self.zero_since = None

    def _told(self, now: float, sent: float, value: float) -> None:
        if self.mode != VELOCITY_MODE or self.control & 0x0F != 0x0F:
            return
        self.commands += 1
        if value == 0.0:
            self._zero(now, True)
            return
        self.zero_since, self.moved = None, now
        if abs(value) > LIMIT * 1.000001:
            self.beyond.append((now, value))
        elif abs(value) <= TOP:
            old = age(value, sent, now)
            if now - self.sync > WATCHDOG:
                self.powerless += old > TIMEOUT
                return
            self.oldest = max(self.oldest, old)
            if old > TIMEOUT + READ:
                self.stale.append((now, old))


class Ears:
    """Hears the graph of one rig in a thread of its own."""

    def __init__(self, namespace: str) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node('soak', namespace=namespace, context=self.context)
        self.prefix = namespace.strip('/')
        self.heard = defaultdict(float)
        self.levels: dict[str, int] = {}
        self.said: list[tuple[float, str, int, str]] = []
        self.events: list[tuple[float, str, str]] = []
        self.facts: dict[str, dict[str, str]] = defaultdict(dict)
        deep, newest = QoSProfile(depth=5000), QoSProfile(depth=1)  # who is behind hears the last
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnosis, deep)
        self.node.create_subscription(Encoder, 'encoder', partial(self._hear, 'encoder'), newest)
        self.node.create_subscription(Prediction, 'twin/prediction',
                                      partial(self._hear, 'prediction'), newest)
        self.node.create_subscription(Event, 'events', self._event, deep)
        self.command = self.node.create_publisher(Command, 'command', deep)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.thread = Thread(target=self._spin, daemon=True)
        self.thread.start()

    def _spin(self) -> None:
        try:
            self.executor.spin()
        except (ExternalShutdownException, AttributeError):  # the latter of rclpy, as it ends
            return

    def _hear(self, what: str, message: Encoder | Prediction) -> None:
        self.heard[what] = last_instant(message)

    def _event(self, message: Event) -> None:
        self.events.append((time(), message.kind, message.text))

    def _diagnosis(self, message: DiagnosticArray) -> None:
        now, worst = time(), {}
        for status in message.status:
            owner = status.name.partition(':')[0].strip().lstrip('/')
            prefix, _, name = owner.rpartition('/')
            if prefix != self.prefix:
                continue
            level = int.from_bytes(status.level, 'little')
            self.facts[name].update({one.key: one.value for one in status.values})
            if level:
                self.said.append((now, name, level, status.message))
            worst[name] = max(level, worst.get(name, 0))
        self.levels.update(worst)


@dataclass
class Usage:
    """Memory, threads and open files of processes over time, by their names and ids."""

    rows: list[tuple[float, str, int, float, int, int]] = field(default_factory=list)

    def look(self, name: str, pid: int) -> None:
        """Note what a process holds now (Linux)."""
        try:
            status = Path(f'/proc/{pid}/status').read_text()
            files = len(os.listdir(f'/proc/{pid}/fd'))
        except OSError:
            return
        values = dict(line.split(':', 1) for line in status.splitlines() if ':' in line)
        if 'VmRSS' in values:
            self.rows.append((time(), name, pid, int(values['VmRSS'].split()[0]) / 1024.0,
                              int(values['Threads']), files))

    def slopes(self, settle: float = 60.0, span: tuple[float, float] = (0.0, inf)
               ) -> list[tuple[str, float, float, int, int]]:
        """
        Return (name, minutes, MiB an hour, threads gained, files gained) of long lives.

        What a life was within ``span`` counts, from ``settle`` s on.
        """
        lives: dict[tuple[str, int], list] = defaultdict(list)
        for row in self.rows:
            if span[0] <= row[0] <= span[1]:
                lives[row[1], row[2]].append(row)
        found = []
        for (name, _), rows in lives.items():
            rows = [row for row in rows if row[0] - rows[0][0] > settle]
            if len(rows) < 6 or rows[-1][0] - rows[0][0] < settle:
                continue
            t = [row[0] - rows[0][0] for row in rows]
            mean, memory = sum(t) / len(t), [row[3] for row in rows]
            middle = sum(memory) / len(memory)
            slope = (sum((a - mean) * (b - middle) for a, b in zip(t, memory, strict=True))
                     / sum((a - mean) ** 2 for a in t))
            found.append((name, t[-1] / 60.0, slope * 3600.0, rows[-1][4] - rows[0][4],
                          rows[-1][5] - rows[0][5]))
        return found
