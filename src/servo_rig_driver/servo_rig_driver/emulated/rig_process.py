"""
The emulated rig as a process of its own: an RV-reducer bench (or another one) on a CAN bus.

    python -m servo_rig_driver.emulated.rig_process --rig config/rigs/rv_bench.yaml \\
        --channel rig.can

It answers SYNC, so its time is that of the driver. SIGUSR1 reads the rig file again and turns
the effects of the running rig; a bus that goes away is opened again when it is back. With
`--faults SOCKET` its faults can be switched while it runs, see fault_port.py.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import replace
import logging
from pathlib import Path
from queue import SimpleQueue
import random
import signal
import time
from typing import Any

import can
import numpy as np

from ..can_bus.bus_opening import BusSettings, INTERFACES, open_bus, Wire
from ..devices.device import DeviceError
from ..devices.object_dictionary import DictionaryError, NODE_IDS
from ..devices.pdo_table import load_frames
from ..ending import Ending
from ..free_output import free_output
from .canopen_nodes import RigNodes, SYNC_LOST
from .drives.by_protocol import driver_parameters, emulated_drive
from .emulated_bench import Bench, COMMANDS
from .fault_port import FaultPort
from .other_rigs import OtherRigs
from .rig_file import load_rig, RigFileError

POLL = 0.02  # s, longest wait for a frame: heartbeats and signals are seen by then
RETRY = 0.2  # s
LISTENS = 0.3  # s for which a rig listens for another one before it speaks
TURNS = 2.0  # s within which a rig that is on its bus does what it is asked
LINGERS = 2.0  # s that a rig which is told to end gives its driver to take the drive down

log = logging.getLogger('emulated_rig')


class EmulatedRig:
    """
    One rig on one bus, from serve() until stop().

    ``driver`` are parameters of the driver by name, which say what the drive speaks: CANopen
    where they say nothing. ``period``, s, is that of the samples, which CANopen nodes are told.
    ``listens`` is for how long, s, it looks for another rig before it speaks.
    Raises RigFileError, DictionaryError or DeviceError when a file cannot be used.
    """

    def __init__(self, rig_file: str | Path, bus: BusSettings, overrides: list[str] | None = None,
                 seed: int = 0, ids: dict[str, int] | None = None,
                 driver: Mapping[str, Any] | None = None, period: float = 1e-3) -> None:
        self.rig_file = Path(rig_file)
        self.bus = bus
        self.overrides = overrides or []
        rig = load_rig(rig_file, self.overrides)
        self.bench = Bench(rig, seed, period)
        self._wire: Wire | None = None
        self._random = random.Random(seed)
        told = driver or {}
        self.nodes = emulated_drive(told, self.bench, self._send) or RigNodes(
            self.bench, load_frames(rig.dictionaries, ids or NODE_IDS), self._send,
            float(told.get('device.watchdog', SYNC_LOST)))
        self.bus = replace(bus, fd=self.nodes.fd)
        self._stopped = False
        self._ends_at: float | None = None
        self.listens = LISTENS
        self._others = OtherRigs(self.nodes.own, self.nodes.slowest_beat,
                                f'{bus.interface} {bus.channel}')
        self._reread = False
        self._asked: SimpleQueue[tuple[Callable[[], Any], Future]] = SimpleQueue()
        self._warm_up()

    def stop(self) -> None:
        """Make serve() return soon; safe to call from a signal handler."""
        self._stopped = True

    def end(self) -> None:
        """Make serve() return once the drive has no torque, at most LINGERS s from now."""
        self._ends_at = time.monotonic() + LINGERS

    @property
    def _over(self) -> bool:
        ends = self._ends_at is not None and (
            not self.nodes.gives_torque or time.monotonic() >= self._ends_at)
        return self._stopped or ends

    def reread(self) -> None:
        """Read the rig file again before the next frame; safe to call from a signal handler."""
        self._reread = True

    def between_frames(self, do: Callable[[], Any]) -> Any:
        """
        Run a function between two frames and return its result; called by another thread.

        Raises what the function raises, and TimeoutError where the rig is not on its bus.
        """
        result: Future = Future()
        self._asked.put((do, result))
        try:
            return result.result(TURNS)
        except TimeoutError:
            if result.cancel():
                raise TimeoutError('the rig is not on its bus: nothing was changed') from None
            return result.result()

    def serve(self) -> bool:
        """
        Answer the bus until it is to end, opening it again whenever it went away.

        Returns False where another rig with the same node ids is on the bus already, once that one
        is heard: two would both answer, and neither could be driven.
        """
        told = False
        while not self._over:
            try:
                self._wire = Wire(open_bus(self.bus, RETRY))
            except can.CanError as error:
                if not told:
                    log.warning('%s; trying on', error)
                told = True
                self.nodes.tick(time.monotonic())
                time.sleep(RETRY)
                continue
            told = False
            try:
                if not self._alone():
                    return False
                self.listens = 0.0
                log.info('%s on %s %s', self.bench.rig.name, self.bus.interface, self.bus.channel)
                self._others.speak(time.monotonic())
                self.nodes.boot()
                if not self._answer():
                    return False
            except can.CanError as error:
                log.warning('%s; opening the bus again', error)
            finally:
                wire, self._wire = self._wire, None
                wire.bus.shutdown()
        return True

    def _alone(self) -> bool:
        """Whether no other rig is heard for a moment."""
        until = time.monotonic() + self.listens
        while time.monotonic() < until:
            if any(self._others.was_there_before(identifier, data, time.monotonic())
                   for identifier, data in self._wire.recv(POLL)):
                return False
        return True

    def _answer(self) -> bool:
        """Answer the bus until it is to end; False where another rig was there before."""
        while not self._over:
            if self._reread:
                self._turn()
            while not self._asked.empty():
                self._obey(*self._asked.get())
            for identifier, data in self._wire.recv(POLL):
                now = time.monotonic()
                if self._others.was_there_before(identifier, data, now):
                    return False
                self.nodes.take(identifier, data, now)
            self.nodes.tick(time.monotonic())
        return True

    @staticmethod
    def _obey(do: Callable[[], Any], result: Future) -> None:
        if not result.set_running_or_notify_cancel():
            return
        try:
            result.set_result(do())
        except Exception as problem:  # told by the thread that asked; the rig goes on
            result.set_exception(problem)

    def _turn(self) -> None:
        self._reread = False
        try:
            rig = load_rig(self.rig_file, self.overrides)
        except RigFileError as error:
            log.error('the rig stays as it is: %s', error)
            return
        self.bench.change(rig.values)
        log.info('%s read again', self.rig_file)

    def _send(self, frames: list[tuple[int, bytes]]) -> None:
        if self._wire is None:
            return
        values = self.bench.rig.values
        delay = values['bus.delay']
        if values['bus.jitter'] > 0.0:
            delay += self._random.expovariate(1.0 / values['bus.jitter'])
        if delay > 0.0:
            time.sleep(delay)
        self._wire.send(frames)

    def _warm_up(self) -> None:
        """Compile before the bus is opened, on a bench that is thrown away."""
        bench = Bench(self.bench.rig)
        bench.answer(0.0, 0.0, 0.0)
        bench.advance()
        bench.record(np.zeros((1, COMMANDS)))


def _node(text: str) -> tuple[str, int]:
    name, equals, number = text.partition('=')
    if name not in NODE_IDS or not number.isdigit():
        raise argparse.ArgumentTypeError(f"'{text}' must read NODE=ID with one of "
                                         f'{list(NODE_IDS)}')
    return name, int(number)


def _one_line(record: logging.LogRecord) -> bool:
    """Have what canopen makes of a frame that it cannot take apart said in a sentence."""
    if record.exc_info:
        record.msg, record.args = f'{record.getMessage()}: {record.exc_info[1]}', ()
        record.exc_info = record.exc_text = None
    return True


def main(arguments: list[str] | None = None) -> int:
    """Run an emulated rig until a signal or the end of its parent; 1: it cannot be run."""
    parser = argparse.ArgumentParser(description='An emulated servo bench on a CAN bus.')
    defaults = BusSettings()
    parser.add_argument('--rig', required=True, help='rig file, as config/rigs/rv_bench.yaml')
    parser.add_argument('--set', action='append', default=[], metavar='PATH=VALUE',
                        help='turn a property, as friction.level=1.5')
    parser.add_argument('--interface', default=defaults.interface, choices=INTERFACES)
    parser.add_argument('--channel', default=defaults.channel)
    parser.add_argument('--bitrate', type=int, default=defaults.bitrate, help='bit/s')
    parser.add_argument('--node', action='append', default=[], type=_node, metavar='NODE=ID')
    parser.add_argument('--driver', metavar='D.yaml',
                        help='parameter file of the driver: the drive speaks its protocol')
    parser.add_argument('--period', type=float, metavar='S', help='of the samples, for a drive '
                        'that is asked for each (default: the sync_period of --driver)')
    parser.add_argument('--watchdog', type=float, metavar='S', help='of silence after which the '
                        'drive stops by itself (default: the device.watchdog of --driver, else '
                        f'{SYNC_LOST:g})')
    parser.add_argument('--seed', type=int, default=0, help='of the sensor noise')
    parser.add_argument('--faults', type=Path, metavar='SOCKET',
                        help='let faults be switched while it runs, by a Unix socket made here')
    options = parser.parse_args(arguments)
    free_output()
    logging.basicConfig(format='emulated_rig: %(message)s', level=logging.INFO)
    logging.getLogger('canopen').setLevel(logging.WARNING)
    for handler in logging.getLogger().handlers:
        handler.addFilter(_one_line)
    try:
        driver = driver_parameters(options.driver) if options.driver else {}
        if options.watchdog is not None:
            driver['device.watchdog'] = options.watchdog
        rig = EmulatedRig(options.rig, BusSettings(options.interface, options.channel,
                                                   options.bitrate),
                          options.set, options.seed, {**NODE_IDS, **dict(options.node)}, driver,
                          options.period or driver.get('sync_period', 1e-3))
        port = FaultPort(options.faults, rig.bench, rig.between_frames) if options.faults else None
    except (RigFileError, DictionaryError, DeviceError, ValueError, OSError) as error:
        log.error('%s', error)
        return 1
    Ending(rig.end)
    signal.signal(signal.SIGUSR1, lambda *_: rig.reread())
    try:
        if not rig.serve():
            return 1
    finally:
        if port is not None:
            port.close()
    log.info('%d requests answered, %d frames refused', rig.nodes.syncs, rig.nodes.refused)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
