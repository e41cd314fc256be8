"""
Makes several recordings of emulated rigs in one process.

    python -m servo_rig_driver.emulated.make_many_recordings orders.json

The file holds a list of mappings: `family`, `rig` (a rig file), `output` (.csv or .npz), and where
they differ from what the family has, `mode`, `settings`, `set` (properties by path), `duration`
(s), `rate` (Hz), `seed` and `replicate`. A .csv is noted in the recordings.yaml beside it. With
`-` for the file, names of such files are read from the standard input, one a line, each answered
by a line.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
import sys

from .make_recording import make_recording, note, write_table

_NEEDED = {'family', 'rig', 'output'}
_KNOWN = _NEEDED | {'mode', 'settings', 'set', 'duration', 'rate', 'seed', 'replicate'}


def make(order: dict) -> Path:
    """Make the recording of one order; raises ValueError for an order that makes no sense."""
    if not isinstance(order, dict) or not _NEEDED <= set(order) <= _KNOWN:
        raise ValueError(f'{order!r} must have {sorted(_NEEDED)} and may have '
                         f'{sorted(_KNOWN - _NEEDED)}')
    overrides = [f'{path}={value!r}' for path, value in order.get('set', {}).items()]
    columns = make_recording(order['family'], order['rig'], order.get('mode'),
                             order.get('settings'), overrides, order.get('duration'),
                             order.get('rate', 1000.0), order.get('seed', 0))
    output = Path(order['output'])
    write_table(output, columns)
    if output.suffix == '.csv':
        note(output, order['family'], order.get('replicate', 1))
    return output


def main(arguments: list[str] | None = None) -> int:
    """Make all recordings of a file of orders."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('orders', help='.json, or - for many of them')
    options = parser.parse_args(arguments)
    listings = (line.strip() for line in sys.stdin) if options.orders == '-' else (options.orders,)
    for listing in listings:
        try:
            orders = json.loads(Path(listing).read_text('utf8'))
            for order in orders:
                make(order)
        except (ValueError, OSError) as error:
            print(f'many: {error}', file=sys.stderr)
            return 1
        print(f'{len(orders)} recordings', flush=True)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
