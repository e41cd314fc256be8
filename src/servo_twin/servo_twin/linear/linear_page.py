"""The page of a linear form: its plots and tables as one HTML file that needs nothing else."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files

from jinja2 import Environment, StrictUndefined
import numpy as np

from .bode_plots import spoken
from .frequency_response import extremes, Measured
from .state_space import LinearForm, Root


@dataclass(frozen=True)
class Table:
    """A table: what it is, its columns, its rows of text."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def root_table(form: LinearForm, output: str) -> Table:
    """Return poles and zeros, slowest first, with what each is."""
    rows = []
    for kind, roots, resonant, right in (
            ('pole', form.poles(output), 'resonance', 'unstable'),
            ('zero', form.zeros(output), 'antiresonance', 'not of minimum phase')):
        for root in roots:
            said = (resonant if root.resonant else right
                    if root.place.real > 1e-6 * abs(root.place) else '')
            if root.place.imag >= 0.0:
                rows.append((*_root(kind, root), said))
    return Table(f'{spoken(form.input)} to {spoken(output)}',
                 ('', 'place, 1/s', 'frequency, Hz', 'damping', ''), tuple(rows))


def point_table(form: LinearForm) -> Table:
    """Return where the form holds, and what is not in it."""
    point, unit = form.point, form.units
    friction = {'sliding': 'its slope at the speed', 'none': 'left out',
                'stuck': 'holds the load fast; left out at the motor'}[point.friction]
    drive = 'current' if form.input == 'current' else 'voltage'
    rows = [('speed of the load', f'{point.speed:g} {unit["load_speed"]}'),
            ('angle of the load', f'{point.angle:g} {unit["load_position"]}'),
            ('external torque', f'{point.torque:g} {unit["torque"]}'),
            *([('angle of the coupled axis', f'{point.coupled:g} rad')] if point.coupled else []),
            ('friction', friction),
            (f'{drive} that keeps it there', f'{form.command:.6g} {unit[drive]}'),
            ('torque through the gear', f'{form.carried:.6g} {unit["torque"]}')]
    if form.system.isdtime(strict=True):
        rows.append(('sampled every', f'{form.system.dt:g} s'))
    rows += [(f'dead time to {spoken(name)}', f'{late:g} s')
             for name, late in form.dead.items() if late > 0.0]
    rows += [(f'left out: {name}', why) for name, why in form.left_out.items()]
    return Table('Where it holds', ('', ''), tuple(rows))


def agreement_table(form: LinearForm, measured: Mapping[str, Measured]) -> Table:
    """Return how far the recording is from the form, where it is coherent."""
    rows = []
    for output, seen in measured.items():
        clear = seen.clear
        share = f'{clear.sum()} of {len(clear)}'
        if not clear.any():
            rows.append((spoken(output), share, '', '', '', ''))
            continue
        model = form.response(output, seen.frequency[clear], seen.period)
        ratio = seen.response[clear] / model
        low, top = extremes(seen)
        rows.append((spoken(output), share,
                     f'{np.median(np.abs(20.0 * np.log10(np.abs(ratio)))):.3g} dB',
                     f'{np.median(np.abs(np.degrees(np.angle(ratio)))):.3g} deg',
                     _number(low), _number(top)))
    return Table('Beside the recording', (
        'output', 'coherent points', 'median difference of size', 'of phase',
        'measured antiresonance, Hz', 'measured resonance, Hz'), tuple(rows))


def margin_table(found: Mapping[str, float]) -> Table:
    """Return the margins of the opened loop."""
    return Table('Margins of the loop', ('', ''),
                 tuple((name, _number(value)) for name, value in found.items()))


def page(title: str, tables: Sequence[Table], pictures: Mapping[str, bytes],
         systems: Sequence[str]) -> str:
    """Return the page as HTML with its pictures (PNG by name) inside."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    template = environment.from_string(
        files(__package__).joinpath('linear_page.html').read_text('utf8'))
    return template.render(title=title, tables=tables, systems=systems, pictures={
        name: b64encode(png).decode() for name, png in pictures.items()})


def _root(kind: str, root: Root) -> tuple[str, ...]:
    place = f'{root.place.real + 0.0:.6g}'
    if root.place.imag > 0.0:
        place += f' ± {root.place.imag:.6g}j'
    return kind, place, _number(root.frequency), _number(root.damping)


def _number(value: float) -> str:
    return f'{value:.5g}' if np.isfinite(value) else 'none'
