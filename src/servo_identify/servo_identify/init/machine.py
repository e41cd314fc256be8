"""The parts of a machine and their values, as they are asked for and given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from servo_twin.description.given_values import required
from servo_twin.description.nearest_name import or_what
from servo_twin.physics.effect import Parameter
from servo_twin.physics.servo import CONTROLLERS, DRIVES, MECHANISMS, Servo

from ..data.physical_units import value_in
from ..data.unit_symbols import UnitError

SECTIONS = {'drive': DRIVES, 'mechanism': MECHANISMS, 'controller': CONTROLLERS}
ABOUT = {
    'voltage': 'the command is a voltage at the winding',
    'current': 'the command becomes a current at once',
    'current_amplifier': 'a current loop whose supply can run out',
    'pmsm': 'a synchronous motor with its loops of speed and current',
    'rigid': 'motor and load move as one',
    'two_inertia': 'an elastic transmission between motor and load',
    'ball_screw': 'a screw that moves a table',
    'none': 'the command is recorded; nothing is said of what makes it',
}


RATIO = 'mechanism.ratio'


def flags() -> dict[str, list[tuple[str, str]]]:
    """Return all values that a part can have: name, and the (section, type) that have it."""
    found: dict[str, list[tuple[str, str]]] = {}
    for section, types in SECTIONS.items():
        for kind, part in types.items():
            for name in part.parameters:
                found.setdefault(name, []).append((section, kind))
    return found


@dataclass
class Machine:
    """
    What was given of a machine so far.

    ``linear``: its load moves straight. ``parts`` maps a section to the type of its part,
    ``texts`` a value's path to what was given for it, with its unit. ``chosen`` says of each part
    that nobody gave what it is, why, and what else there is.
    """

    name: str
    linear: bool = False
    parts: dict[str, str] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    chosen: dict[str, str] = field(default_factory=dict)

    @property
    def turning(self) -> bool:
        """Whether its motor turns: that of a linear axis does unless its ratio is a mere 1."""
        try:
            return not self.linear or float(self.texts[RATIO]) != 1.0
        except (KeyError, ValueError):
            return True

    def choose(self, section: str, kind: str, why: str) -> None:
        """Give a part a type that nobody gave, and say why."""
        others = ', '.join(one for one in SECTIONS[section] if one != kind)
        self.parts[section] = kind
        self.chosen[section] = f'{kind}, as {why} (--{section} takes {others} too)'

    def declared(self) -> dict[str, tuple[Parameter, str]]:
        """Return declaration and unit of every value of the parts that are chosen, by path."""
        chosen = {section: SECTIONS[section][kind] for section, kind in self.parts.items()}
        whole = {'drive': DRIVES['voltage'], 'mechanism': MECHANISMS['rigid']} | chosen
        servo = Servo(self.name, **whole, linear=self.linear, turning=self.turning)
        return {path: (parameter, servo.unit(path)) for path, parameter in servo.declarations()
                if path.partition('.')[0] in self.parts}

    def needed(self) -> list[str]:
        """Return the paths of values that must be given and are not."""
        found = []
        for section, kind in self.parts.items():
            names = required(SECTIONS[section][kind])
            found += [path for name in names if (path := f'{section}.{name}') not in self.texts]
        if self.linear:
            found.sort(key=lambda path: path != RATIO)  # the units of the others hang on it
        return found

    def flags_needed(self, section: str) -> list[str]:
        """Return the flags of the values of a part that are not given, each with an example."""
        return [f"{flag(path)} '{example(self.declared()[path][1], path)}'"
                for path in self.needed() if path.startswith(f'{section}.')]

    def give(self, path: str, text: str) -> None:
        """Take a value as text with its unit; raises ValueError that names it."""
        known = replace(self, texts={**self.texts, path: text}).declared()
        if path not in known:
            section = path.partition('.')[0]
            raise ValueError(f'{path}: a {section} of type {self.parts.get(section)!r} has no '
                             f'such value; {or_what(path, known, "it has")}')
        parameter, unit = known[path]
        try:
            value = value_in(text, unit)
        except UnitError as problem:
            raise ValueError(f'{flag(path)}: {problem}') from None
        refused = parameter.refuse(value)
        if refused:
            raise ValueError(f'{flag(path)} {text!r}: {refused} {unit}')
        self.texts[path] = text

    def values(self) -> Mapping[str, float]:
        """Return all that was given, in SI units."""
        known = self.declared()
        return {path: value_in(text, known[path][1]) for path, text in self.texts.items()}

    def servo(self) -> Servo:
        """Return the servo; raises ServoError where it cannot be."""
        parts = {section: SECTIONS[section][kind] for section, kind in self.parts.items()}
        return Servo(self.name, **parts, values=dict(self.values()), linear=self.linear,
                     turning=self.turning)


def flag(path: str) -> str:
    """Return the flag that gives a value."""
    return '--' + path.rpartition('.')[2].replace('_', '-')


def example(unit: str, path: str) -> str:
    """Return a value as one may write it, with a unit that is usual."""
    usual = {'H': '1.2 mH', 'ohm': '2.1 ohm', 'V s/rad': "45 mV s/rad' or '212 rpm/V",
             'N m/A': '45 mN m/A', 'kg m2': '32 g cm2', '': '50', 'kg': '12 kg',
             'A/V': '0.5 A/V', 'rad/m': "157 rad/m' or '40 mm/rev",
             'N m/rad': '2e4 N m/rad', 'N m s/rad': '40 N m s/rad'}
    return usual.get(unit, f'1 {unit}')
