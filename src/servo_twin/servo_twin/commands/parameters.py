"""
List every parameter of a servo file with its value, unit, bounds, tolerance and meaning.

With an effect's name instead of a file: what that effect of the catalogue can be told.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, TYPE_CHECKING

from .terminal import tell, terminal

if TYPE_CHECKING:
    from rich.table import Table

    from ..physics.effect import Parameter
    from ..physics.servo import Servo


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('subject', nargs='?', metavar='SERVO.yaml | EFFECT',
                        help='a servo file or the name of a shipped one, or an effect of the '
                             'catalogue; left out: all effects')


def main(arguments: argparse.Namespace) -> int:
    """Print the table."""
    from ..description.servo_file import load
    from ..description.shipped import servo_at
    from ..physics import catalogue

    console = terminal()
    subject = arguments.subject
    if subject is None:
        tell(arguments, effects={name: {
            'sites': catalogue.find(name).sites, 'source': catalogue.find(name).source,
            'parameters': list(catalogue.find(name).parameters)} for name in catalogue.names()})
        console.print(catalogue_table())
    elif subject in catalogue.names():
        tell(arguments, parameters=[
            {**declared(parameter), 'path': parameter.name, 'off': parameter.off}
            for parameter in catalogue.find(subject).parameters.values()])
        console.print(effect_table(subject))
    else:
        servo = load(servo_at(subject))
        tell(arguments, parameters=[
            {**declared(parameter), 'path': name, 'value': servo.values[name],
             'unit': servo.unit(name), 'tolerance': _tolerance(servo, name),
             'source': servo.provenance[name].source if name in servo.provenance else 'default'}
            for name, parameter in servo.declarations()])
        console.print(servo_table(servo, servo_at(subject)))
    return 0


def declared(parameter: Parameter) -> dict[str, Any]:
    """Return the declaration of a parameter as plain data."""
    return {'default': parameter.default, 'unit': parameter.unit, 'bounds': parameter.bounds,
            'meaning': parameter.meaning}


def servo_table(servo: Servo, path: Path) -> Table:
    """Return the parameters of the servo of a file."""
    table = _table(f'{servo.name} ({path})', 'value', 'tolerance', 'from')
    for name, parameter in servo.declarations():
        said = servo.provenance.get(name)
        table.add_row(
            name, _value(servo.values[name]), servo.unit(name), _bounds(parameter),
            _spans(_tolerance(servo, name)),
            said.source if said else 'default', parameter.meaning)
    return table


def _tolerance(servo: Servo, path: str) -> Any:
    """Return (low, high) of a value, of a row those of each number that has them; or None."""
    row = servo.values[path]
    if not isinstance(row, tuple):
        return servo.tolerance.get(path)
    several = [servo.tolerance.get(f'{path}[{i}]') for i in range(len(row))]
    return several if any(several) else None


def _spans(tolerance: Any) -> str:
    if not tolerance:
        return ''
    several = tolerance if isinstance(tolerance, list) else [tolerance]
    return ', '.join(f'{one[0]:.6g} ... {one[1]:.6g}' if one else 'exact' for one in several)


def effect_table(name: str) -> Table:
    """Return the parameters of one effect of the catalogue."""
    from ..physics import catalogue

    effect = catalogue.find(name)
    title = f'{name}, at {" or ".join(effect.sites)}\n{effect.source}'
    table = _table(title, 'default', 'vanishes at')
    for parameter in effect.parameters.values():
        off = '' if parameter.off is None else f'{parameter.off:g}'
        table.add_row(parameter.name, _value(parameter.default), parameter.unit,
                      _bounds(parameter), off, parameter.meaning)
    return table


def catalogue_table() -> Table:
    """Return all effects with their sites and what they are."""
    from rich import box
    from rich.table import Table

    from ..physics import catalogue

    table = Table(title='effects', title_justify='left', title_style='bold', box=box.SIMPLE)
    for column in ('effect', 'at', 'parameters', 'what it is'):
        table.add_column(column)
    for name in catalogue.names():
        effect = catalogue.find(name)
        words = (effect.__doc__ or '').strip().splitlines()
        table.add_row(name, ', '.join(effect.sites), ', '.join(effect.parameters),
                      words[0] if words else '')
    return table


def _table(title: str, value: str, *more: str) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify='left', title_style='bold', box=box.SIMPLE)
    table.add_column('parameter', no_wrap=True)
    table.add_column(value, justify='right', no_wrap=True)
    table.add_column('unit', no_wrap=True)
    for column in ('bounds', *more, 'meaning'):
        table.add_column(column)
    return table


def _value(value: float | tuple[float, ...]) -> str:
    if isinstance(value, tuple):
        return f'{len(value)} numbers' if len(value) > 4 else ', '.join(f'{v:g}' for v in value)
    return f'{value:g}'


def _bounds(parameter: Parameter) -> str:
    return f'{parameter.bounds[0]:g} ... {parameter.bounds[1]:g}'
