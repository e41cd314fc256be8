"""
The Unix bus and the emulated rig in figures, each beside its reference.

    python tests/benchmarks/bench_bus.py [--seconds 5]

Prints frames a second through the hub beside python-can's virtual bus in one process, losses and
latency of SYNC answered by an emulated rig at 1 and 4 kHz, and the emulator's speed beside real
time.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import subprocess
import sys
import tempfile
from threading import Thread
import time

import numpy as np

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire
from servo_rig_driver.devices.pdo_table import load_frames, sync_counter, sync_frame
from servo_rig_driver.emulated.make_recording import make_recording

RIG = Path(__file__).parents[2] / 'config' / 'rigs' / 'rv_bench.yaml'
FRAMES = 30_000


def started(*arguments: str) -> subprocess.Popen:
    """Start a module of the rig as a process."""
    return subprocess.Popen([sys.executable, '-m', *arguments], stderr=subprocess.DEVNULL)


def flood(settings: BusSettings) -> float:
    """Send frames one by one and return how many a second came through; all must."""
    sender, receiver = Wire(open_bus(settings, 10.0)), Wire(open_bus(settings, 10.0))
    begin = time.perf_counter()
    thread = Thread(target=lambda: [sender.send([(0x100, k.to_bytes(4, 'little'))])
                                    for k in range(FRAMES)])
    thread.start()
    got = 0
    while got < FRAMES:
        frames = receiver.recv(5.0)
        if not frames:
            raise SystemExit(f'{FRAMES - got} of {FRAMES} frames lost')
        got += len(frames)
    thread.join()
    rate = FRAMES / (time.perf_counter() - begin)
    sender.bus.shutdown()
    receiver.bus.shutdown()
    return rate


def samples(wire: Wire, rate: float, seconds: float) -> tuple[int, np.ndarray]:
    """Send SYNC at a rate; return the number unanswered and the latencies of the last frame, s."""
    table = load_frames()
    last = table['torque_sensor.tpdo1']
    wire.send([(0x601, bytes([0x23, 0x06, 0x10, 0]) + round(1e6 / rate).to_bytes(4, 'little')),
               (0, bytes([1, 0]))])
    latencies, lost = [], 0
    begin = time.perf_counter() + 0.1
    for k in range(round(rate * seconds)):
        due = begin + k / rate
        time.sleep(max(0.0, due - time.perf_counter()))
        sent = time.perf_counter()
        wire.send([sync_frame(k)])
        answered = False
        while not answered and time.perf_counter() < sent + 1.0:
            for identifier, data in wire.recv(0.1):
                if identifier == last.cob_id:
                    answered = last.unpack(data)[2] == sync_counter(k)
        lost += not answered
        latencies.append(time.perf_counter() - sent)
    return lost, np.array(latencies)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=5.0)
    seconds = parser.parse_args().seconds
    with tempfile.TemporaryDirectory() as folder:
        bus = BusSettings('unix_bus', f'{folder}/can')
        hub = started('servo_rig_driver.can_bus.can_hub', bus.channel)
        try:
            ours, theirs = flood(bus), flood(BusSettings('virtual', 'bench'))
            print(f'unix bus through its hub       {ours:9.0f} frames/s, none lost')
            print(f'python-can virtual, one process{theirs:9.0f} frames/s, ratio '
                  f'{ours / theirs:.2f}')
            rig = started('servo_rig_driver.emulated.rig_process', '--rig', str(RIG), '--channel',
                          bus.channel)
            wire = Wire(open_bus(bus, 10.0))
            while not any(identifier == 0x701 for identifier, _ in wire.recv(1.0)):
                pass
            try:
                for rate in (1000.0, 4000.0):
                    lost, latency = samples(wire, rate, seconds)
                    p50, p99, most = np.percentile(latency, [50, 99, 100]) * 1e6
                    print(f'SYNC at {rate:.0f} Hz, {seconds:g} s: {lost} of '
                          f'{round(rate * seconds)} unanswered, median {p50:.0f} us, p99 '
                          f'{p99:.0f} us, longest {most:.0f} us; period / p99 '
                          f'{1e6 / rate / p99:.1f}')
            finally:
                wire.bus.shutdown()
                rig.terminate()
                rig.wait()
        finally:
            hub.terminate()
            hub.wait()
    make_recording('sine', RIG, duration=0.1)
    begin = time.perf_counter()
    make_recording('sine', RIG, duration=60.0)
    print(f'emulated rig without a bus: {60.0 / (time.perf_counter() - begin):.0f} times real '
          'time (1 kHz, 20 us steps)')


if __name__ == '__main__':
    main()
