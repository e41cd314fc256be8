"""
Transfer function and state space of a servo file, its Bode and step plots, beside a recording.

  servo-twin linearise rv_bench                                 command to speed of the load
  servo-twin linearise rv_bench --output motor_speed torque     several outputs
  servo-twin linearise rv_bench --input reference_velocity      the closed loop, with its margins
  servo-twin linearise S.yaml BAG --output motor_speed          laid over a recording's response

What the linear form holds and leaves out: docs/linear_forms.md.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from ..linear.signal_names import FRICTIONS, INPUT_UNITS, OUTPUT_UNITS
from .any_bag import bag_of
from .terminal import named_servo, new_folder, plain, tell, terminal

if TYPE_CHECKING:
    import numpy as np
    from rich.table import Table as RichTable

    from ..linear.frequency_response import Measured
    from ..linear.state_space import LinearForm
    from ..physics.servo import Servo

PERIOD = 1e-3  # s, of a closed loop without recording


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('servo', type=named_servo, metavar='S.yaml',
                        help='servo file, or the name of a shipped one')
    parser.add_argument('bag', nargs='?', type=Path,
                        help='recording whose frequency response is laid under the plots')
    parser.add_argument('--input', default='voltage', choices=list(INPUT_UNITS),
                        help='what drives it; a reference closes the loop (default %(default)s)')
    parser.add_argument('--output', nargs='+', default=['load_speed'], choices=list(OUTPUT_UNITS),
                        metavar='OUTPUT', help='what answers: %(choices)s (default load_speed)')
    parser.add_argument('--closed-loop', action='store_true',
                        help='close the loop for the inputs voltage and external_torque too')
    parser.add_argument('--friction', default='sliding', choices=FRICTIONS,
                        help='its slope at the speed, none, or it holds the load '
                             '(default %(default)s)')
    parser.add_argument('--speed', type=float,
                        help='of the load at the operating point, rad/s (default 1; 0.1 m/s of a '
                             'linear axis; 0 unless sliding)')
    parser.add_argument('--angle', type=float, default=0.0, help='of the load there, rad')
    parser.add_argument('--torque', type=float, default=0.0, help='external torque there, N m')
    parser.add_argument('--coupled', type=float, default=0.0,
                        help='angle there of an axis that changes the inertia of this one, rad')
    parser.add_argument('--period', type=float,
                        help="of the controller, s (default: the recording's, or 0.001)")
    parser.add_argument('--segment', type=float, default=0.0,
                        help='length of what is averaged of the recording, s (default: a '
                             'sixteenth of it)')
    parser.add_argument('--band', type=float, nargs=2, metavar=('LOW', 'HIGH'),
                        help='of the Bode plot, Hz')
    parser.add_argument('--duration', type=float, help='of the step plot, s')
    parser.add_argument('--effects', metavar='FOLDER', help='folder of effect files of your own')
    parser.add_argument('--namespace', help='which rig, of a bag with several')
    parser.add_argument('--mapping', type=Path, metavar='M.yaml',
                        help='how columns of a table, or fields of messages, become channels')
    parser.add_argument('-o', '--output-folder', type=Path, default=Path('linear'), metavar='DIR',
                        help='page, pictures and linear.json (default %(default)s)')


def main(arguments: argparse.Namespace) -> int:
    """Print the tables, and write the page and what belongs to it."""
    from ..bag import read_recording
    from ..description.servo_file import load
    from ..linear import bode_plots, linear_page
    from ..linear.frequency_response import estimate
    from ..linear.sampled_loop import margins
    from ..physics import catalogue

    if arguments.effects:
        catalogue.register(arguments.effects)
    servo = load(arguments.servo)
    new_folder(arguments.output_folder, arguments.force, 'linear.json', 'linear.html')
    recording = None
    if arguments.bag:
        with bag_of(arguments.bag, arguments.servo, arguments.mapping) as bag:
            recording = read_recording(bag, arguments.namespace, digest=False)
    form = form_of(servo, arguments, recording.period if recording else None)
    measured: dict[str, Measured] = {}
    if recording:
        measured = {name: estimate(recording, form.input, name, arguments.segment)
                    for name in form.outputs}

    tables = [linear_page.root_table(form, name) for name in form.outputs]
    if measured:
        tables.append(linear_page.agreement_table(form, measured))
    if form.loop is not None:
        tables.append(linear_page.margin_table(margins(form)))
    tables.append(linear_page.point_table(form))
    pictures = {}
    for name in form.outputs:
        band = band_of(form, name, measured.get(name), arguments.band)
        pictures[f'bode_{name}'] = bode_plots.bode(form, name, band, measured.get(name))
        pictures[f'step_{name}'] = bode_plots.step(form, name, arguments.duration)

    console = terminal(quiet=arguments.quiet)
    for table in tables:
        console.print(_rich(table))
    folder = arguments.output_folder
    for name, png in pictures.items():
        (folder / f'{name}.png').write_bytes(png)
    (folder / 'linear.json').write_text(json.dumps(plain(as_data(form)), indent=1,
                                                     allow_nan=False) + '\n')
    title = f'{form.servo}: linear form from {bode_plots.spoken(form.input)}'
    systems = [f'{form.transfer(name)}' for name in form.outputs] + [f'{form.system}']
    (folder / 'linear.html').write_text(linear_page.page(title, tables, pictures, systems))
    tell(arguments, **as_data(form), written=[folder])
    console.print(f'page: {folder / "linear.html"}', highlight=False, soft_wrap=True)
    return 0


def form_of(servo: Servo, arguments: argparse.Namespace, period: float | None) -> LinearForm:
    """Return the linear form that was asked for; raises ServoError."""
    from ..linear.operating_point import usual_point
    from ..linear.sampled_loop import closed_loop, REFERENCES
    from ..linear.state_space import linearise
    from ..physics.servo import ServoError

    point = usual_point(servo, arguments.friction, arguments.speed, arguments.angle,
                        arguments.torque, arguments.coupled)
    if not arguments.closed_loop and arguments.input not in REFERENCES:
        return linearise(servo, arguments.input, arguments.output, point)
    period = arguments.period or period or PERIOD
    if not 0.0 < period <= 1.0:
        raise ServoError(f'--period = {period:g} s is outside (0, 1]')
    return closed_loop(servo, arguments.input, arguments.output, point, period)


def band_of(form: LinearForm, output: str, measured: Measured | None,
            given: tuple[float, float] | None) -> np.ndarray:
    """Return frequencies in Hz for a plot: those given, measured, or around poles and zeros."""
    import numpy as np

    from ..physics.servo import ServoError

    roots = [r.frequency for r in (*form.poles(output), *form.zeros(output))
             if np.isfinite(r.frequency) and r.frequency > 1e-6]
    if given:
        low, high = given
    elif measured:
        low, high = float(measured.frequency[0]), float(measured.frequency[-1])
    else:
        low, high = min(roots, default=1.0) / 10.0, max(roots, default=1.0) * 10.0
    if form.system.isdtime(strict=True):
        high = min(high, 0.5 / form.system.dt)
    if not 0.0 < low < high:
        raise ServoError(f'--band from {low:g} to {high:g} Hz is none')
    inside = [f for f in roots if low < f < high]
    around = [np.geomspace(0.8 * f, min(1.25 * f, high), 200) for f in inside]
    found = np.unique(np.concatenate([np.geomspace(low, high, 800), *around]))
    return found[(found >= low) & (found <= high)]


def as_data(form: LinearForm) -> dict:
    """Return a form as what JSON can hold: matrices, names, transfer functions."""
    system = form.system
    transfers = {}
    for name in form.outputs:
        transfer = form.transfer(name)
        transfers[name] = {'numerator': transfer.num[0][0].tolist(),
                           'denominator': transfer.den[0][0].tolist(),
                           'dead_time': form.dead[name]}
    return {'servo': form.servo, 'input': form.input, 'outputs': list(form.outputs),
            'units': {n: form.units[n] for n in (form.input, *form.outputs)},
            'period': float(system.dt) if system.isdtime(strict=True) else 0.0,
            'states': list(system.state_labels), 'A': system.A.tolist(), 'B': system.B.tolist(),
            'C': system.C.tolist(), 'D': system.D.tolist(), 'transfer': transfers,
            'point': vars(form.point), 'command': form.command, 'left_out': form.left_out}


def _rich(table) -> RichTable:
    from rich import box
    from rich.table import Table as RichTable

    shown = RichTable(title=table.title, title_justify='left', title_style='bold', box=box.SIMPLE,
                      show_header=any(table.columns))
    for i, column in enumerate(table.columns):
        shown.add_column(column, overflow='fold', no_wrap=i == 0)
    for row in table.rows:
        shown.add_row(*row)
    return shown
