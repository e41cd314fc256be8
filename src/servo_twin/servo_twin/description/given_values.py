"""What a servo file must give, and the defaults that were taken for what it left out."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass

from ..physics.effect import Declared, Effect
from ..physics.servo import Servo, ServoError, Value


@dataclass(frozen=True)
class Default:
    """A value that the servo file did not give: its path in the servo, value and unit."""

    path: str
    value: Value
    unit: str


def defaults(servo: Servo) -> tuple[Default, ...]:
    """
    Return the defaults that stand in for what the servo file left out, in its own order.

    What is so by nature (gravity once a turn) and the observer's bandwidth are not listed; per
    metre nothing is by nature.
    """
    declared = dict(servo.declarations())
    units = {path: servo.unit(path) for path in declared}
    quiet = {path for path, one in declared.items() if not one.told and units[path] == one.unit}
    now = {**servo.values, 'step': servo.step}
    return tuple(Default(path, value, units.get(path, 's'))
                 for path, value in servo.left_out.items()
                 if now.get(path) == value and path not in quiet)


def left_out(servo: Servo, given: Container[str], typical: Container[str]) -> dict[str, Value]:
    """
    Return the defaults of all that is not among the paths ``given``.

    ``typical`` are paths for which a named model (``harmonic_drive``) has values of its own.
    Raises ServoError where results hang on a value that is not given. The error names all of
    them with unit and meaning.
    """
    missing, taken = [], {}
    for path, owner in servo.owners():
        needed = required(owner)
        for name, parameter in owner.parameters.items():
            own = f'{path}.{name}'
            if own in given:
                continue
            if name in needed and own not in typical:
                unit = servo.unit(own)
                missing.append(f'{own}{f" [{unit}]" if unit else ""}: {parameter.meaning}')
            elif servo.values[own] != ():
                taken[own] = servo.values[own]
    if missing:
        raise ServoError('values are missing that the results hang on; there is no default for '
                         'them:\n  ' + '\n  '.join(missing))
    return taken


def required(owner: type[Declared]) -> tuple[str, ...]:
    """
    Name the parameters of a part or an effect for which no default may stand.

    These are the ones declared so, and of an effect its amplitudes: an effect that a file names
    without its size would get that of another machine. An amplitude may be left out where its
    default is off, or the whole of something (1 without a unit).
    """
    names = [name for name, parameter in owner.parameters.items() if parameter.required]
    if issubclass(owner, Effect):
        for name in owner.amplitudes():
            parameter = owner.parameters[name]
            sizes = parameter.default if parameter.row else (parameter.default,)
            whole = parameter.unit == '' and sizes == (1.0,)
            if not whole and any(size != parameter.off for size in sizes):
                names.append(name)
    return tuple(names)
