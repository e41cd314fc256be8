"""
The emulated rig as a process of its own: an RV-reducer bench (or another one) on a CAN bus.

    python -m servo_rig_driver.emulated.rig_process --rig config/rigs/rv_bench.yaml \\
        --channel /tmp/rig.can

It answers SYNC, so its time is that of the driver. SIGHUP reads the rig file again and turns the
traits of the running rig; a bus that goes away is opened again when it is back.
"""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
import random
import signal
import time

import can

from ..can_bus.opening import BusSettings, INTERFACES, open_bus, Wire
from ..devices.object_dictionary import DictionaryError, NODE_IDS
from ..devices.pdo_table import load_frames
from .bench import Bench
from .nodes import RigNodes
from .settings import load_rig, RigFileError

POLL = 0.02  # s, longest wait for a frame: heartbeats and signals are seen by then
RETRY = 0.2  # s

log = logging.getLogger('emulated_rig')


class EmulatedRig:
    """
    One rig on one bus, from serve() until stop().

    Raises RigFileError or DictionaryError when rig file or object dictionaries cannot be used.
    """

    def __init__(self, rig_file: str | Path, bus: BusSettings, overrides: list[str] | None = None,
                 seed: int = 0, ids: dict[str, int] | None = None) -> None:
        self.rig_file = Path(rig_file)
        self.bus = bus
        self.overrides = overrides or []
        rig = load_rig(rig_file, self.overrides)
        self.bench = Bench(rig, seed)
        self._wire: Wire | None = None
        self._random = random.Random(seed)
        self.nodes = RigNodes(self.bench, load_frames(rig.dictionaries, ids or NODE_IDS),
                              self._send)
        self._stopped = False
        self._reread = False
        self._warm_up()

    def stop(self) -> None:
        """Make serve() return soon; safe to call from a signal handler."""
        self._stopped = True

    def reread(self) -> None:
        """Read the rig file again before the next frame; safe to call from a signal handler."""
        self._reread = True

    def serve(self) -> None:
        """Answer the bus until stop() is called, opening it again whenever it went away."""
        told = False
        while not self._stopped:
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
            log.info('%s on %s %s', self.bench.rig.name, self.bus.interface, self.bus.channel)
            try:
                self.nodes.boot()
                self._answer()
            except can.CanError as error:
                log.warning('%s; opening the bus again', error)
            finally:
                wire, self._wire = self._wire, None
                wire.bus.shutdown()

    def _answer(self) -> None:
        while not self._stopped:
            if self._reread:
                self._turn()
            for identifier, data in self._wire.recv(POLL):
                self.nodes.take(identifier, data, time.monotonic())
            self.nodes.tick(time.monotonic())

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


def _node(text: str) -> tuple[str, int]:
    name, equals, number = text.partition('=')
    if name not in NODE_IDS or not number.isdigit():
        raise argparse.ArgumentTypeError(f"'{text}' must read NODE=ID with one of "
                                         f'{list(NODE_IDS)}')
    return name, int(number)


def main(arguments: list[str] | None = None) -> int:
    """Run an emulated rig until SIGTERM or SIGINT."""
    parser = argparse.ArgumentParser(description='An emulated servo bench on a CAN bus.')
    defaults = BusSettings()
    parser.add_argument('--rig', required=True, help='rig file, as config/rigs/rv_bench.yaml')
    parser.add_argument('--set', action='append', default=[], metavar='PATH=VALUE',
                        help='turn a property, as friction.level=1.5')
    parser.add_argument('--interface', default=defaults.interface, choices=INTERFACES)
    parser.add_argument('--channel', default=defaults.channel)
    parser.add_argument('--bitrate', type=int, default=defaults.bitrate, help='bit/s')
    parser.add_argument('--node', action='append', default=[], type=_node, metavar='NODE=ID')
    parser.add_argument('--seed', type=int, default=0, help='of the sensor noise')
    options = parser.parse_args(arguments)
    logging.basicConfig(format='emulated_rig: %(message)s', level=logging.INFO)
    logging.getLogger('canopen').setLevel(logging.WARNING)
    try:
        rig = EmulatedRig(options.rig, BusSettings(options.interface, options.channel,
                                                   options.bitrate),
                          options.set, options.seed, {**NODE_IDS, **dict(options.node)})
    except (RigFileError, DictionaryError, ValueError) as error:
        log.error('%s', error)
        return 1
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: rig.stop())
    signal.signal(signal.SIGHUP, lambda *_: rig.reread())
    rig.serve()
    log.info('%d SYNCs answered, %d frames refused', rig.nodes.syncs, rig.nodes.refused)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
