"""
Makes a recording of the emulated rig without its bus, faster than real time.

    python -m servo_rig_driver.emulated.make_recording sine --rig config/rigs/rv_bench.yaml \
        --setting amplitude=1.5 --set friction.level=1.5 --seed 7 -o sine.csv

The table has the columns that `servo-identify import` takes; .npz holds the same as arrays. With
--list, family and replicate are noted in the recordings.yaml beside the table. With --waves the
rig plays set-points of one's own, and the family is only their name:

    python -m servo_rig_driver.emulated.make_recording my_sweep --waves my_sweep.npz \
        --mode velocity ...
"""

from __future__ import annotations

import argparse
import fcntl
import os
from pathlib import Path
import sys

import numpy as np
import yaml

from ..devices.object_dictionary import DictionaryError
from .emulated_bench import COLUMNS, run
from .excitation_families import ExcitationError, FAMILIES, family
from .rig_file import load_rig, RigFileError

_DIGITS = '%.12g'


def make_recording(name: str, rig_file: str | Path, mode: str | None = None,
                   settings: dict[str, float] | None = None, overrides: list[str] | None = None,
                   duration: float | None = None, rate: float = 1000.0, seed: int = 0
                   ) -> dict[str, np.ndarray]:
    """
    Return the columns of one recording of an excitation family, SI units.

    Raises RigFileError, DictionaryError or ExcitationError (all ValueErrors) when told nonsense.
    """
    chosen = family(name)
    length = chosen.duration if duration is None else duration
    if not 100.0 <= rate <= 20_000.0:
        raise ExcitationError(f'rate = {rate:g} Hz is outside [100, 20000]')
    if not 0.0 < length <= 3600.0:
        raise ExcitationError(f'duration = {length:g} s is outside (0, 3600]')
    t = np.arange(round(length * rate)) / rate
    reference, external = chosen.waves(t, settings or {})
    rig = load_rig(rig_file, overrides or [])
    return run(rig, mode or chosen.mode, reference, external, 1.0 / rate, seed)


def play_waves(path: Path, rig_file: str | Path, mode: str | None, overrides: list[str],
               rate: float, seed: int) -> dict[str, np.ndarray]:
    """
    Return the columns of one recording of the set-points in an .npz file.

    Its arrays are `reference`, in the unit of ``mode``, and `external_torque`, N m, both (n,), one
    set-point a sample. Raises ValueError for a file or a mode that cannot be played.
    """
    if mode is None:
        raise ValueError(f'{path}: say by --mode what its reference is of')
    with np.load(path) as waves:
        for name in ('reference', 'external_torque'):
            if name not in waves:
                raise ValueError(f"{path} has no array '{name}'; it has {list(waves)}")
        reference, external = waves['reference'], waves['external_torque']
    if not 100.0 <= rate <= 20_000.0:
        raise ValueError(f'rate = {rate:g} Hz is outside [100, 20000]')
    return run(load_rig(rig_file, overrides), mode, reference, external, 1.0 / rate, seed)


def write_table(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Write columns as .csv (missing values are empty) or .npz; raises ValueError for others."""
    if path.suffix == '.npz':
        np.savez_compressed(path, **columns)
    elif path.suffix == '.csv':
        rows = np.column_stack([columns[name] for name in COLUMNS])
        missing = np.isnan(rows).all(axis=0)
        formats = ['' if gone else _DIGITS for gone in missing]
        line = ','.join(formats) + '\n'
        kept = rows[:, ~missing].tolist()
        with path.open('w', encoding='utf-8') as file:
            file.write(','.join(COLUMNS) + '\n')
            file.writelines(line % tuple(row) for row in kept)
    else:
        raise ValueError(f"cannot write '{path.name}'; the table ends in .csv or .npz")


def note(path: Path, name: str, replicate: int) -> None:
    """Note family and replicate of a table in the recordings.yaml beside it, each in its turn."""
    listing, folder = path.parent / 'recordings.yaml', os.open(path.parent, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)  # another recording may be noted at the same time
        known = yaml.safe_load(listing.read_text()) if listing.exists() else None
        known = {**(known or {}), path.name: {'family': name, 'replicate': replicate}}
        listing.write_text(yaml.safe_dump(known, sort_keys=True))
    finally:
        os.close(folder)


def _setting(text: str) -> tuple[str, float]:
    name, _, raw = text.partition('=')
    try:
        return name, float(raw)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' must read NAME=NUMBER") from None


def main(arguments: list[str] | None = None) -> int:
    """Make one recording."""
    listing = '\n'.join(f'  {f.name} ({f.mode}, {f.duration:g} s): '
                        + ', '.join(f'{k}={v:g}' for k, v in f.settings.items())
                        for f in FAMILIES.values())
    parser = argparse.ArgumentParser(
        description='Makes a recording of the emulated rig.',
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=f'families, their mode, duration and settings:\n{listing}')
    parser.add_argument('family', help='excitation family, see below')
    parser.add_argument('--rig', required=True, help='rig file, as config/rigs/rv_bench.yaml')
    parser.add_argument('--mode', choices=('voltage', 'current', 'velocity', 'position'))
    parser.add_argument('--waves', type=Path, metavar='FILE.npz',
                        help="set-points of one's own: arrays reference and external_torque")
    parser.add_argument('--setting', action='append', default=[], type=_setting,
                        metavar='NAME=NUMBER', help='of the family')
    parser.add_argument('--set', action='append', default=[], metavar='PATH=VALUE',
                        help='property of the rig, as friction.level=1.5')
    parser.add_argument('--seed', type=int, default=0, help='of the sensor noise')
    parser.add_argument('--duration', type=float, help='s')
    parser.add_argument('--rate', type=float, default=1000.0, help='samples a second')
    parser.add_argument('--replicate', type=int, default=1)
    parser.add_argument('--list', action='store_true',
                        help='note family and replicate in recordings.yaml')
    parser.add_argument('-o', '--output', required=True, type=Path, help='.csv or .npz')
    options = parser.parse_args(arguments)
    try:
        if options.waves:
            columns = play_waves(options.waves, options.rig, options.mode, options.set,
                                 options.rate, options.seed)
        else:
            columns = make_recording(
                options.family, options.rig, options.mode, dict(options.setting), options.set,
                options.duration, options.rate, options.seed)
        write_table(options.output, columns)
        if options.list:
            note(options.output, options.family, options.replicate)
    except (RigFileError, DictionaryError, ExcitationError, ValueError, OSError) as error:
        print(f'make: {error}', file=sys.stderr)
        return 1
    print(f'{options.output}: {len(columns["t"])} samples of {options.family}')
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
