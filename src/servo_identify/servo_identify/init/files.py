"""The two files that `init` writes, with comments that teach."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
import re

from servo_twin.description.servo_file import of_linear
from servo_twin.physics.step_limit import step_within

from ..data.column_units import UNIT
from ..data.shown_ratio import BELT
from ..data.unsigned import steps_of
from .machine import Machine
from .proposals import Proposal, sampled_less_often
from .sources import Offered

USUAL_STEP = 1e-4  # s, of a machine whose springs and winding bear it
_WIDE = 52  # columns before a comment
_LATER = """
# The loop that makes the command of a reference: with it the twin can run closed, and the
# diagnosis looks at its equation as well. Types: `servo-twin parameters`, docs/controllers.md.
# controller:
#   type: position_loop
#   kp: {value: 20.0, unit: 1/s, source: firmware}
#   kv: {value: 1.0, unit: V s/rad, source: firmware}
"""
_EFFECTS = """
# What an ideal servo does not do. Give what you know; what is missing the diagnosis finds. All
# effects: docs/effects.md, and `servo-twin parameters coulomb_friction` for one.
# effects:
#   bearing: {effect: coulomb_friction, at: load, level: {value: 1.5, unit: N m}}
#   weight: {effect: gravity, at: load, cosine: 0.0, sine: {value: -4.0, unit: N m}}
"""
_TOLERANCE = """
# How far off each value may be, as a share or as [low, high]: `fit` looks within it, and the
# diagnosis calls it a gap only beyond it. Without a line a value counts as exact.
"""
EXACT = {
    'mechanism.ratio': (f'{100.0 * BELT:g} %',
                        'only of a belt or a friction drive: teeth count exactly'),
    'drive.pole_pairs': ('', ''), 'drive.switching': ('', ''), 'drive.current_cycle': ('', ''),
    'drive.velocity_cycle': ('', '')}
"""Values that are exact, so that they get no tolerance: the one to write yet, and when."""


def servo_text(machine: Machine, noise: Mapping[str, tuple[float, str, str]],
               tolerance: str = '') -> str:
    """
    Return the servo file of a machine.

    ``noise`` maps a sensor to the standard deviation of one reading, its unit and its source;
    ``tolerance`` is a share such as '10 %' that is written for every value but those of
    :data:`EXACT`, '' leaves them out.
    """
    name = machine.name if re.fullmatch(r'[\w.-]+', machine.name) else _quoted(machine.name)
    lines = [f'# Servo {machine.name}: what is known of one machine. `servo-identify init` wrote '
             'it; change it freely.',
             '# A value is a number, or {value, unit, source}; its unit is the one that stands '
             'here, always SI.',
             f'servo: {name}']
    if machine.linear:
        lines.append(f'travel: linear              # {of_linear(machine.servo())}')
    step = f'{step_within(machine.servo(), USUAL_STEP):.1e}'
    lines.append(f'step: {step:<20} # s, of the simulation')
    known, values = machine.declared(), machine.values()
    for section, kind in machine.parts.items():
        if kind == 'none':
            continue
        chosen = [f'# {machine.chosen[section]}'] if section in machine.chosen else []
        lines += ['', *chosen, f'{section}:', f'  type: {kind}']
        for path, (parameter, unit) in known.items():
            if path.startswith(f'{section}.') and path in values:
                value = _value(values[path], unit, _origin(machine, path))
                lines.append(_line(f'  {path.partition(".")[2]}: {value}', parameter.meaning))
    if noise:
        lines += ['', 'sensors:                    # those that the machine has; noise is one '
                  'standard deviation']
        lines += [f'  {name}: {{noise: {{value: {size:.3g}, unit: {unit}, '
                  f'source: {_quoted(source)}}}}}'
                  for name, (size, unit, source) in noise.items()]
    text = '\n'.join(lines) + '\n'
    if machine.parts.get('controller', 'none') == 'none':
        text += _LATER
    text += _EFFECTS + _TOLERANCE
    paths = [path for path in values if values[path] and not path.startswith('controller.')]
    loose = [path for path in paths if path not in EXACT]
    if tolerance:
        text += 'tolerance:\n' + ''.join(f'  {path}: {tolerance}\n' for path in loose)
    else:
        text += '# tolerance:\n' + ''.join(f'#   {path}: 10 %\n' for path in loose)
    return text + ''.join(_line(f'#   {path}: {EXACT[path][0]}', EXACT[path][1]) + '\n'
                          for path in paths if path in EXACT and EXACT[path][0])


def mapping_text(of: Offered, chosen: Mapping[str, Proposal]) -> str:
    """Return the mapping file of the columns that were chosen."""
    lines = [f'# How the columns of {of.path.name} become those of a recording. `servo-identify '
             'init` wrote it.',
             '# Steps of a column: source, above, subtract, plus, minus, wraps, scale, offset, '
             'times, unit, negate, zero',
             '# (docs/recordings.md). negate: true turns the sign; unit: 1/4096 rev is one count '
             'of an encoder.']
    if of.rows:
        lines.append(f'rows: {of.rows}')
    if sampled_less_often(of, chosen):
        lines.append('join: true   # some columns are sampled less often than the encoder')
    if of.names:
        lines.append(f'names: [{", ".join(of.names)}]   # the file has no line of names')
    time = chosen['t']
    lines += [_line(f'time: {_steps(time)}', 's'), 'columns:']
    lines += [_line(f'  {column}: {_steps(one)}',
                    f'A: a torque in {one.was} that stands for it' if one.was else UNIT[column])
              for column, one in chosen.items() if column != 't']
    lines += ['# recording: {family: sine, note: no load}   # of all files that this one reads']
    return '\n'.join(lines) + '\n'


def _steps(one: Proposal) -> str:
    unit = '' if one.unit in ('', UNIT[one.column]) else f', unit: {_quoted(one.unit)}'
    wraps = f', wraps: {one.wraps:.12g}' if one.wraps else ''
    signed = f', {steps_of(one.signed)}' if one.signed else ''
    scale = '' if one.scale == 1.0 else f', scale: {one.scale:.12g}'
    if one.every:
        return f'{{every: {one.every:.12g}}}'
    negate = ', negate: true' if one.negate else ''
    return f'{{source: {_quoted(one.source)}{signed}{wraps}{scale}{unit}{negate}}}'


def _origin(machine: Machine, path: str) -> str:
    """Return where a value comes from: given, or taken and why."""
    return machine.chosen.get(path, f'given as {machine.texts[path]}')


def _value(value: float, unit: str, origin: str) -> str:
    shown = f'{value:.6g}'
    if 'e' in shown and '.' not in shown:
        shown = shown.replace('e', '.0e')
    told = f'unit: {unit}, ' if unit else ''
    return f'{{value: {shown}, {told}source: {_quoted(origin)}}}'


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


def _line(text: str, comment: str) -> str:
    return f'{text:<{_WIDE}}  # {comment}'


def write(path: Path, text: str) -> None:
    """Write a file, and the folder that it is in."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, 'utf8')
