"""One rig under the soak: its processes, what is heard of it, and whether it is well."""

from __future__ import annotations

from pathlib import Path
from time import sleep, time

from bench import Bench
from graph import Graph
from witness import Bus, Ears, Usage

FRESH = 0.5  # s: samples, predictions and set-points newer than that flow


class Rig:
    """A bench in its namespace, with the log of its bus, ears in its graph and a reference."""

    def __init__(self, folder: Path, identify: bool, namespace: str) -> None:
        self.bench = Bench(folder, identify, namespace)
        self.usage = Usage()

    def start(self) -> None:
        """Start all processes, and send set-points."""
        log = self.bench.folder / 'bus.log'
        log.touch()  # the proxy may be slow to begin
        for name in self.bench.names:
            self.bench.start(name)
            sleep(0.5)
        self.bus, self.ears = Bus(log), Ears(self.bench.namespace)
        self.graph = Graph(self.ears, lambda: self.bench.clock.ahead)
        self.graph.play()

    def look(self) -> None:
        """Note what the processes hold."""
        for name, pid in self.bench.pids().items():
            self.usage.look(name, pid)

    def well(self) -> bool:
        """Whether the drive has torque, and set-points, samples and predictions flow."""
        now = time()
        return (now - self.bus.moved < FRESH and self.bus.status & 0x6F == 0x27
                and now - self.ears.heard['encoder'] < FRESH
                and now - self.ears.heard['prediction'] < FRESH)

    def state(self) -> str:
        """Return what is seen of it."""
        now = time()
        return (f'set-points {now - self.bus.moved:.1f} s old, status {self.bus.status:#x}, '
                f'encoder {now - self.ears.heard["encoder"]:.1f} s, prediction '
                f'{now - self.ears.heard["prediction"]:.1f} s, {self.ears.said[-1:]}')

    def close(self) -> list[str]:
        """End all; return what had to be killed."""
        if hasattr(self, 'graph'):
            self.graph.close()
        return self.bench.close()
