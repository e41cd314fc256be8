"""
Two emulated axes in one world: a pan that carries a tilt.

    python -m servo_rig_driver.emulated.coupled_axes --pan config/rigs/pan_tilt_azimuth.yaml \
        --tilt config/rigs/pan_tilt_elevation.yaml --waves waves.npz --pan-mode voltage \
        --tilt-mode position -o azimuth.csv elevation.csv

The file of set-points holds `pan` and `tilt`, each (n,), in the unit of its mode. What the tilt
turns changes the inertia of the pan while it moves, and the turning pan pulls at the tilt. The
table of the pan has the column coupled_position: what the encoder of the tilt read.
"""

from __future__ import annotations

import argparse
from math import pi
from pathlib import Path
import sys

import numpy as np

from ..devices.object_dictionary import DictionaryError
from ..devices.pdo_table import load_frames
from . import coupled_mass
from .emulated_bench import Bench, columns_of, commands_of
from .make_recording import write_table
from .rig_file import load_rig, RigFileError, RigSettings

Columns = dict[str, np.ndarray]


def run_pair(pan: RigSettings, tilt: RigSettings, pan_mode: str, pan_reference: np.ndarray,
             tilt_mode: str, tilt_reference: np.ndarray, period: float = 1e-3, seed: int = 0
             ) -> tuple[Columns, Columns]:
    """
    Return a recording of each axis, both in step, as columns in SI units.

    References (n,) as bench.run takes them, equally many. Raises ValueError for what cannot be
    played, and for a pan that carries nothing.
    """
    if len(pan_reference) != len(tilt_reference):
        raise ValueError(f'{len(pan_reference)} set-points for the pan, {len(tilt_reference)} for '
                         'the tilt; both axes need as many')
    if not pan.values.get('coupling.mass', 0.0) > 0.0:
        raise ValueError(f'coupling.mass of {pan.name} is 0: what the tilt does is nothing to it')
    rigs, modes = (pan, tilt), (pan_mode, tilt_mode)
    frames = [load_frames(rig.dictionaries) for rig in rigs]
    commands = [commands_of(mode, reference, 0.0, frame) for mode, reference, frame in zip(
        modes, (pan_reference, tilt_reference), frames, strict=True)]
    benches = [Bench(rig, seed + k, period) for k, rig in enumerate(rigs)]
    answers = [np.empty((len(one), len(benches[0].out))) for one in commands]
    carrier, carried = (bench.state[0] for bench in benches)
    pushed = pan.values['coupling.reaction']
    for k in range(len(commands[0])):
        for bench, command, answer in zip(benches, commands, answers, strict=True):
            answer[k] = bench.answer(*command[k])
        pull = coupled_mass.inertia_slope(benches[0].parameters[0], carrier)
        carried['reaction'] = 0.5 * pushed * pull * carrier['load_speed'] ** 2
        benches[1].advance()
        carrier['other_speed'] = (carried['load_angle'] - carrier['other_angle']) / period
        benches[0].advance()
    made = [columns_of(rig, mode, command, answer, period, frame) for rig, mode, command, answer,
            frame in zip(rigs, modes, commands, answers, frames, strict=True)]
    made[0]['coupled_position'] = pan.values['coupling.angle'] + made[1]['load_position']
    return made[0], made[1]


def main(arguments: list[str] | None = None) -> int:
    """Record both axes."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--pan', required=True, help='rig file of the axis that carries')
    parser.add_argument('--tilt', required=True, help='rig file of the axis that is carried')
    parser.add_argument('--waves', required=True, type=Path, metavar='FILE.npz',
                        help='arrays pan and tilt')
    for axis in ('pan', 'tilt'):
        parser.add_argument(f'--{axis}-mode', default='velocity',
                            choices=('voltage', 'current', 'velocity', 'position'))
    parser.add_argument('--seed', type=int, default=0, help='of the sensor noise')
    parser.add_argument('--rate', type=float, default=1000.0, help='samples a second')
    parser.add_argument('-o', '--output', required=True, nargs=2, type=Path,
                        metavar=('PAN', 'TILT'), help='.csv or .npz, one for each axis')
    options = parser.parse_args(arguments)
    try:
        if not 100.0 <= options.rate <= 20_000.0:
            raise ValueError(f'rate = {options.rate:g} Hz is outside [100, 20000]')
        with np.load(options.waves) as waves:
            for name in ('pan', 'tilt'):
                if name not in waves:
                    raise ValueError(f"{options.waves} has no array '{name}'; it has "
                                     f'{list(waves)}')
            references = waves['pan'], waves['tilt']
        made = run_pair(load_rig(options.pan), load_rig(options.tilt), options.pan_mode,
                        references[0], options.tilt_mode, references[1], 1.0 / options.rate,
                        options.seed)
        for path, columns in zip(options.output, made, strict=True):
            write_table(path, columns)
    except (RigFileError, DictionaryError, ValueError, OSError) as error:
        print(f'pair: {error}', file=sys.stderr)
        return 1
    reach = np.ptp(made[1]['load_position']) * 180.0 / pi
    print(f'{options.output[0]}, {options.output[1]}: {len(made[0]["t"])} samples, the tilt moved '
          f'over {reach:.0f} deg')
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
