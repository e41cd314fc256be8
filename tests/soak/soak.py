"""
Runs the bench for an hour while faults come one by one and in pairs: `make soak SOAK=1h`.

What was promised is judged from outside: by a log of the bus that a proxy keeps, by the topics,
by the bags and by /proc. The report is a page with a time line; the status is 1 for a broken
promise.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import json
import os
from pathlib import Path
from random import Random
import shutil
from signal import SIGTERM
import subprocess
import sys
import tempfile
from time import monotonic, sleep, time

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'support'))
sys.path.insert(0, str(Path(__file__).resolve().parent))

from bags import judged, replayed
from faults import all_faults
import quiet
from report import page, text
from rig import Rig
from tasks import PATIENCE, Tasks

from servo_rig_driver.ros_start import udp_alone

START, RECOVERY = 90.0, 40.0  # s
RECORDED = 50_000  # bytes of a bag whose recorder hears the rig


class Soak:
    """
    One run: ``log`` holds what happened, a dictionary a fault.

    Faults come to the first of ``rigs``; the others stand beside it on the same machine. After
    each ``each`` s of faults come ``lasts`` s without any, which are no part of the run's length.
    """

    def __init__(self, folder: Path, seed: str, identify: bool, rigs: int,
                 each: float = quiet.EACH, lasts: float = quiet.LASTS) -> None:
        self.random, self.seed, self.folder = Random(seed), seed, folder
        self.rig = Rig(folder, identify, 'rig')
        self.others = [Rig(folder / f'rig{k}', False, f'rig{k}') for k in range(1, rigs)]
        self.bench = self.rig.bench
        self.log: list[dict] = []
        self.misses: list[str] = []
        self.tasks: Tasks | None = None
        self.quiet: list[dict] = []
        self._each, self._lasts = each, lasts
        self._looked = self._ill = 0.0
        self._well_beside = monotonic()

    def run(self, seconds: float, most: int, only: list[str] | None) -> dict:
        """Run for some seconds, or until ``most`` faults were there; return the figures."""
        begun = time()
        left, killed = [], []
        try:
            for one in (self.rig, *self.others):
                one.start()
                self.bus, self.ears, self.graph = self.rig.bus, self.rig.ears, self.rig.graph
                if not self._well_within(START, one):
                    raise RuntimeError(f'the bench does not start: {one.state()}')
            if self.bench.identify:
                self.tasks = Tasks(self.rig, seconds)
            faults = all_faults(self.bench, self.graph, self.random)
            names = only or sorted(faults)
            order: list[str] = []
            until, rest = monotonic() + seconds, monotonic() + self._each
            while monotonic() < until and len(self.log) < most:
                if monotonic() > rest:
                    until += self._rested()
                    rest = monotonic() + self._each
                if len(order) < 2:
                    order += self.random.sample(names, len(names))
                pair = [faults[order.pop(self._next(order))]]
                other = self._next(order)
                if (self.random.random() < 0.25 and not only and pair[0].pairs
                        and faults[order[other]].pairs):
                    pair.append(faults[order.pop(other)])
                self._suffer(pair)
            self._asked()
            self._whole()
            self._deactivated()
        finally:
            for one in (self.rig, *self.others):
                killed += one.close()
            sleep(1.0)
            left = self.bench.left()
        return self._figures(begun, killed, left)

    def _rested(self) -> float:
        """Leave the bench alone for a while; return for how many s it had no fault."""
        begun = monotonic()
        if self.tasks is not None:
            self.tasks.held = True
            self._waited(PATIENCE, lambda: not self.tasks.busy)
        self.quiet.append(quiet.stretch(
            self.rig, self._lasts, min(quiet.SETTLES, 0.4 * self._lasts), self._waited))
        if self.tasks is not None:
            self.tasks.held = False
        print(f'quiet: {quiet.judged(self.quiet[-1:])}', flush=True)
        return monotonic() - begun

    def _waited(self, seconds: float, until: Callable[[], bool]) -> bool:
        """Look at everything for some seconds, or until a condition holds; return whether."""
        end = monotonic() + seconds
        while monotonic() < end and not until():
            self._turn()
        return until()

    def _next(self, order: list[str]) -> int:
        """Return the place of the next fault: none that ends the identify node at its work."""
        busy = self.tasks is not None and self.tasks.busy
        return next((k for k in reversed(range(len(order)))
                     if not (busy and 'identify' in order[k])), -1)

    def _asked(self) -> None:
        """Wait for the last answer."""
        if self.tasks is not None:
            self.tasks.end()
            until = monotonic() + RECOVERY
            while self.tasks.busy and monotonic() < until:
                self._turn()

    def _turn(self) -> None:
        """Look at everything once."""
        running = [one for one in (self.rig, *self.others) if hasattr(one, 'bus')]
        for one in running:
            one.bus.read()
        if self.tasks is not None:
            self.tasks.turn()
        now = monotonic()
        if now - self._looked > 2.0:
            self._looked = now
            for one in running:
                one.look()
        if all(one.well() for one in self.others if one in running):
            self._well_beside = now
        self._ill = max(self._ill, now - self._well_beside)
        sleep(0.02)

    def _well_within(self, patience: float, rig: Rig | None = None) -> bool:
        rig = rig or self.rig
        until, since = monotonic() + patience, None
        while monotonic() < until:
            self._turn()
            rig.bench.mend()
            since = (since or monotonic()) if rig.well() else None
            if since is not None and monotonic() - since > 0.3:
                return True
        return False

    def _for(self, seconds: float) -> None:
        self._waited(seconds, lambda: False)

    def _suffer(self, pair: list) -> None:
        """Make one or two faults, take their causes away, and see what came of it."""
        self._for(self.random.uniform(1.0, 3.0))
        said, bags, self._ill = len(self.ears.said), len(self.bench.bags), 0.0
        row = {'faults': [fault.name for fault in pair], 'at': time(), 'alone': len(pair) == 1}
        for fault in pair:
            fault.make()
        self._for(self.random.uniform(1.0, 2.5))
        for fault in pair:
            fault.unmake()
        row['cured'] = time()
        self.bench.mend()
        well = self._well_within(15.0 if any(fault.hand for fault in pair) else RECOVERY)
        if not well and any(fault.hand for fault in pair):
            row['by_hand'] = True
            self.graph.activate()
            well = self._well_within(RECOVERY)
        row['well'] = time() if well else None
        if not well:
            row['state'] = self.rig.state()
            self.misses.append(f'{" and ".join(row["faults"])}: not well again: {row["state"]}')
            self.graph.activate()
            self._well_within(RECOVERY)
        after = [at for at in self.bus.zeroed if at >= row['at'] - 0.05]
        row['zero'] = min(after) - row['at'] if after else None
        named = [(at, text) for at, name, _, text in self.ears.said[said:]
                 if name == pair[0].named and at >= row['at']]
        row['named'] = (named[0][0] - row['at'], named[0][1]) if named else None
        if row['alone'] and pair[0].named and not named:
            self.misses.append(f'{pair[0].name}: {pair[0].named} said nothing')
        row['beside'] = None if any(fault.beside for fault in pair) else self._ill
        row['new_bag'] = len(self.bench.bags) > bags
        row['zero_due'], row['gap'] = pair[0].zero, any(fault.gap for fault in pair)
        self.log.append(row)
        (self.folder / 'rows.json').write_text(json.dumps(self.log, default=str))
        print(f'{row["at"] - self.log[0]["at"]:7.1f} s  {" and ".join(row["faults"]):45} '
              f'well after {row["well"] - row["cured"] if well else float("nan"):5.1f} s',
              flush=True)

    def _whole(self) -> None:
        """Record a bag in which the twin begins twice, and changes, for a replay."""
        self._ended('recorder')
        self._ended('twin')
        self.bench.start('recorder')
        bag, until = self.bench.bags[-1], monotonic() + RECOVERY
        while monotonic() < until and sum(
                part.stat().st_size for part in bag.glob('*.mcap')) < RECORDED:
            self._turn()
        self.bench.mend()
        if not self._well_within(RECOVERY):
            self.misses.append(f'not well before the end: {self.rig.state()}')
        self._ended('twin')
        self.bench.mend()
        if not self._well_within(RECOVERY):
            self.misses.append(f'not well before the end: {self.rig.state()}')
        for _ in range(3):
            self.graph.odd_parameters(self.random)
            self._for(1.5)

    def _ended(self, name: str) -> None:
        """Have a process end in order."""
        self.bench.signal(name, SIGTERM)
        until = monotonic() + 15.0
        while self.bench.running[name].poll() is None and monotonic() < until:
            self._turn()

    def _deactivated(self) -> None:
        """Take the driver down while set-points go on coming: none may reach the drive."""
        if not self.graph.deactivate():
            self.misses.append('the driver could not be deactivated at the end')
            return
        self._for(0.2)
        moved = self.bus.moved
        self._for(2.0)
        if self.bus.moved > moved:
            self.misses.append('set-points reached the drive after deactivation')

    def _figures(self, begun: float, killed: list[str], left: list[str]) -> dict:
        windows = [(row['at'] - 1.0, (row['well'] or row['cured'] + RECOVERY) + 1.0)
                   for row in self.log if row['gap']]
        bags = judged(self.bench.bags, windows, self.bench.answers())
        beside = [(row['at'] - 1.0, row['cured'] + 1.0) for row in self.log
                  if row['beside'] is None]
        traces = []
        for path in sorted((self.folder / 'logs').glob('*.log')):
            said = path.read_text(errors='replace')
            if 'Traceback' in said:
                traces.append(f'{path.stem}: {said[said.rindex("Traceback"):][:1500]}')
        odd = sorted({f'{name} ended with {status}' for name, status in self.bench.ended
                      if status not in (0, -9, -15, 1, 143)})
        return {
            'seed': self.seed, 'seconds': time() - begun, 'rows': self.log,
            'commands': self.bus.commands, 'oldest': self.bus.oldest, 'stale': self.bus.stale,
            'powerless': self.bus.powerless,
            'beyond': self.bus.beyond, 'bags': bags, 'replays': replayed(self.bench.bags[-1:]),
            'traces': traces, 'ends': odd,
            'beside': [judged(one.bench.bags, beside, one.bench.answers())
                       for one in self.others],
            'events': [list(one) for one in self.ears.events if one[1] == 'change'],
            'slopes': [(f'{one.bench.namespace}: {told[0]}', *told[1:])
                       for one in (self.rig, *self.others) for told in one.usage.slopes()],
            'killed': killed, 'left': left,
            'tasks': self.tasks.rows if self.tasks is not None else [],
            'quiet': self.quiet, 'misses': self.misses, 'logs': sum(
                path.stat().st_size for path in (self.folder / 'logs').glob('*.log')),
            'refused': self.graph.refused, 'taken': self.graph.taken,
            'usage': self.rig.usage.rows}


def length(text_of: str) -> float:
    """Return seconds of a length such as 90, 90s, 15m, 1h."""
    factor = {'s': 1.0, 'm': 60.0, 'h': 3600.0}.get(text_of[-1:], None)
    try:
        return float(text_of[:-1]) * factor if factor else float(text_of)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f'{text_of!r} is no length; give such as 90s, 15m or 24h') from None


def main() -> int:
    """Soak, write the report, and say what was missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('length', type=length, nargs='?', default=3600.0)
    parser.add_argument('--seed', default='1', help='another seed, other faults')
    parser.add_argument('--most', type=int, default=10**9, help='faults at most')
    parser.add_argument('--only', nargs='*', help='names of faults')
    parser.add_argument('--no-identify', action='store_true', help='without the identify node')
    parser.add_argument('--rigs', type=int, default=1, help='on the machine; the first suffers')
    parser.add_argument('--quiet', type=length, nargs=2, metavar=('EACH', 'LASTS'),
                        default=(quiet.EACH, quiet.LASTS),
                        help='after how long a quiet stretch comes, and how long it lasts')
    parser.add_argument('-o', '--output', type=Path, help='folder of the report')
    parser.add_argument('--keep', action='store_true', help='keep logs and bags')
    arguments = parser.parse_args()
    os.environ.update(udp_alone(os.environ))  # the witnesses share no memory either
    folder = Path(tempfile.mkdtemp(prefix='servo_soak_'))
    try:
        soak = Soak(folder, arguments.seed, not arguments.no_identify, arguments.rigs,
                    *arguments.quiet)
        figures = soak.run(arguments.length, arguments.most, arguments.only)
    finally:
        subprocess.run(['umount', '-l', str(folder / 'small_disk')], capture_output=True,
                       check=False)
        if arguments.keep:
            print(f'kept: {folder}')
        else:
            shutil.rmtree(folder, ignore_errors=True)
    said, broken = text(figures)
    print(said)
    if arguments.output:
        arguments.output.mkdir(parents=True, exist_ok=True)
        (arguments.output / 'soak.json').write_text(json.dumps(figures, default=str))
        (arguments.output / 'soak.md').write_text(said)
        (arguments.output / 'soak.html').write_text(page(figures, said))
    return int(broken)


if __name__ == '__main__':
    status = main()
    sys.stdout.flush()
    os._exit(status)  # rclpy sometimes breaks down as its context is taken apart
