"""Runs the emulated rig as a command, and makes bags of what it recorded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import json
import os
from pathlib import Path
import subprocess
import sys
from typing import Any

from servo_identify.data.table_import import import_table
from servo_twin.bag import write_recording

_COMMAND = 'servo_rig_driver.emulated.make_many_recordings'


class Rig:
    """A process of the emulated rig that makes recordings as they are ordered."""

    def __enter__(self) -> Rig:
        self._process = subprocess.Popen(
            [sys.executable, '-m', _COMMAND, '-'], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True, env={**os.environ, 'OMP_NUM_THREADS': '1'})
        return self

    def __exit__(self, *problem: object) -> None:
        self._process.communicate()

    def record(self, orders: Sequence[Mapping[str, Any]], folder: Path) -> None:
        """
        Make recordings; servo_rig_driver.emulated.make_many_recordings says what an order holds.

        Raises RuntimeError with what the rig said where it could not.
        """
        folder.mkdir(parents=True, exist_ok=True)
        listing = (folder / 'orders.json').resolve()
        listing.write_text(json.dumps(list(orders), indent=1))
        print(listing, file=self._process.stdin, flush=True)
        if not self._process.stdout.readline():
            said = self._process.stderr.read().strip()
            raise RuntimeError(f'the emulated rig failed on {listing}: {said[-500:]}')


def make_bags(orders: Sequence[Mapping[str, Any]], servo: Path, folder: Path) -> list[Path]:
    """
    Record what is ordered as tables and import them as bags; return the bags.

    A bag that is there already is kept. The tables go once they are imported.
    """
    tables = folder / 'tables'
    bags = [folder / 'bags' / order['name'] for order in orders]
    todo = [(order, bag) for order, bag in zip(orders, bags, strict=True)
            if not (bag / 'metadata.yaml').is_file()]
    if not todo:
        return bags
    bags[0].parent.mkdir(parents=True, exist_ok=True)
    with Rig() as rig:
        rig.record([{**{k: v for k, v in order.items() if k != 'name'},
                     'output': str(tables / f'{order["name"]}.csv')} for order, _ in todo], tables)
    for order, bag in todo:
        table = tables / f'{order["name"]}.csv'
        write_recording(bag, import_table(table, servo))
        table.unlink()
    return bags
