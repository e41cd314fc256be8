"""One machine: which parts and effects it has, and the value of every parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from .controllers import Cascade, Impedance, Open, PositionLoop, VelocityPi
from .drives import CurrentAmplifier, CurrentDrive, VoltageDrive
from .effect import Declared, Effect, Parameter
from .element_names import split_name
from .mechanisms.ball_screw import BallScrew
from .mechanisms.rigid import Rigid
from .mechanisms.two_inertia import TwoInertia
from .pmsm_drive import PmsmDrive
from .sensors import CurrentSensor, LoadEncoder, MotorEncoder, TorqueSensor, VoltageSensor
from .servo_parts import Controller, Correction, Mechanism, MotorDrive, Part, SensorPart
from .state import PARTS
from .straight_units import straightened

DRIVES: dict[str, type[MotorDrive]] = {
    'current': CurrentDrive, 'voltage': VoltageDrive, 'pmsm': PmsmDrive,
    'current_amplifier': CurrentAmplifier,
}
MECHANISMS: dict[str, type[Mechanism]] = {
    'two_inertia': TwoInertia, 'rigid': Rigid, 'ball_screw': BallScrew,
}
CONTROLLERS: dict[str, type[Controller]] = {
    'none': Open, 'velocity_pi': VelocityPi, 'position_loop': PositionLoop,
    'cascade': Cascade, 'impedance': Impedance,
}
SENSORS: dict[str, type[SensorPart]] = {
    s.name: s for s in (MotorEncoder, LoadEncoder, TorqueSensor, CurrentSensor, VoltageSensor)
}

TURNING = ('motor', 'motor_position', 'current', 'command')
"""Sites on the side of the motor."""

Value = float | tuple[float, ...]
Kept = TypeVar('Kept')


class ServoError(ValueError):
    """A servo that cannot be: names the thing, the value, the limit and the choice."""


class MechanismFailure(ServoError):
    """A mechanism that failed while it ran: what it answers from there on is NaN."""


@dataclass(frozen=True)
class Placed:
    """An effect at its place: the name it has in this servo, the effect, the site."""

    name: str
    effect: type[Effect]
    site: str

    def paths(self, values: Mapping[str, Value]) -> dict[str, Value]:
        """Return values that are given by the names of parameters by their paths in a servo."""
        return {f'effects.{self.name}.{name}': value for name, value in values.items()}


@dataclass(frozen=True)
class Provenance:
    """Where a value comes from."""

    source: str = ''
    std: float | None = None
    bags: tuple[str, ...] = ()


@dataclass(frozen=True)
class Servo:
    """
    One machine.

    ``values`` maps the path of every parameter (``drive.gain``, ``mechanism.ratio``,
    ``sensors.load_encoder.noise``, ``effects.bearing.level``) to its value; what is left out gets
    its default, and rows of one effect are filled up to the longest of them with what they are
    when off. ``tolerance`` maps paths, and ``path[i]`` of a row, to the (low, high) within which
    the true value must lie.
    ``linear`` says that the load moves straight: its angles are metres, its torques newtons, its
    inertia is a mass. ``turning`` says whether the motor of such an axis turns; its ratio is then
    in rad/m. None: it does unless the ratio is 1, which is a linear motor. ``left_out`` maps what
    a servo file did not give to the default that was taken. Immutable; raises ServoError.
    """

    name: str
    drive: type[MotorDrive]
    mechanism: type[Mechanism]
    controller: type[Controller] = Open
    sensors: tuple[type[SensorPart], ...] = ()
    effects: tuple[Placed, ...] = ()
    values: Mapping[str, Value] = field(default_factory=dict)
    tolerance: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    provenance: Mapping[str, Provenance] = field(default_factory=dict)
    step: float = 1e-4
    linear: bool = False
    turning: bool | None = None
    left_out: Mapping[str, Value] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        taken = set()
        for placed in self.effects:
            effect = placed.effect
            if placed.name in taken:
                raise ServoError(f'{self.name}: two effects are named {placed.name!r}')
            taken.add(placed.name)
            if placed.site not in effect.sites:
                raise ServoError(f'{self.name}: effects.{placed.name}: {effect.name} cannot act '
                                 f'at {placed.site!r}; it can at {list(effect.sites)}')
            if not self.mechanism.carries and effect.port == 'inertia':
                able = [name for name, one in MECHANISMS.items() if one.carries]
                raise ServoError(f'{self.name}: effects.{placed.name}: {effect.name} needs a '
                                 f'mechanism that minds it; there are {able}')
        if not 1e-7 <= self.step <= 0.1:
            raise ServoError(f'{self.name}: step = {self.step:g} s is outside [1e-07, 0.1]')
        declared = dict(self.declarations())
        values = {}
        for path, parameter in declared.items():
            values[path] = self._checked(path, parameter, self.values.get(path, parameter.default))
        for path in self.values:
            if path not in declared:
                raise self._unknown(path)
        self._fill_rows(values)
        for placed in self.effects:
            why = self.mechanism.refuses(placed.effect, placed.site, values)
            if why:
                raise ServoError(f'{self.name}: effects.{placed.name}: {placed.effect.name} {why}')
        object.__setattr__(self, 'values', values)
        for name in self.tolerance:
            self.place(name)
        if not self.linear or self.mechanism.slides:
            object.__setattr__(self, 'turning', True)
        elif self.turning is None:
            object.__setattr__(self, 'turning', values['mechanism.ratio'] != 1.0)

    def _checked(self, path: str, parameter: Parameter, value: Any) -> Value:
        try:
            numbers = tuple(float(v) for v in (value if parameter.row else (value,)))
        except (TypeError, ValueError, OverflowError):
            kind = 'a row of numbers' if parameter.row else 'a number'
            if parameter.row and isinstance(value, int | float):
                kind += f'; a row of one is written [{value}]'
            raise ServoError(f'{self.name}: {path} = {value!r} is not {kind}') from None
        for single in numbers:
            problem = parameter.refuse(single)
            if problem:
                raise ServoError(f'{self.name}: {path} = {problem} ({parameter.meaning})')
        return numbers if parameter.row else numbers[0]

    def _fill_rows(self, values: dict[str, Value]) -> None:
        """Make the rows of each effect equally long: laws run over them side by side."""
        for path, owner in self.owners():
            rows = {f'{path}.{name}': p for name, p in owner.parameters.items() if p.row}
            longest = max((len(_row(values[row])) for row in rows), default=0)
            for row, parameter in rows.items():
                numbers = _row(values[row])
                if len(numbers) == longest:
                    continue
                if parameter.off is None:
                    raise ServoError(f'{self.name}: {row} has {len(numbers)} numbers, and the '
                                     f'longest row of {path} has {longest}; all must have as many')
                values[row] = numbers + (parameter.off,) * (longest - len(numbers))

    def owners(self) -> Iterator[tuple[str, type[Declared]]]:
        """Yield (path, declaring class) of every part and effect, in the order of `theta`."""
        yield 'drive', self.drive
        yield 'mechanism', self.mechanism
        yield 'controller', self.controller
        yield 'observer', Correction
        for sensor in self.sensors:
            yield f'sensors.{sensor.name}', sensor
        for placed in self.effects:
            yield f'effects.{placed.name}', placed.effect

    def declarations(self) -> Iterator[tuple[str, Parameter]]:
        """Yield (path, declaration) of every parameter, in the order of `theta`."""
        for path, owner in self.owners():
            for name, parameter in owner.parameters.items():
                yield f'{path}.{name}', parameter

    def slots(self) -> dict[str, slice]:
        """Where each parameter stands in the flat vector `theta`."""
        slots, start = {}, 0
        for path, _ in self.declarations():
            size = len(_row(self.values[path]))
            slots[path] = slice(start, start + size)
            start += size
        return slots

    @property
    def theta(self) -> np.ndarray:
        """All values as one flat vector, float64, in the order of `slots`."""
        flat: list[float] = []
        for value in self.values.values():
            flat.extend(value if isinstance(value, tuple) else (value,))
        return np.array(flat)

    @property
    def switches(self) -> np.ndarray:
        """One switch an effect, all on, bool."""
        return np.ones(len(self.effects), dtype=np.bool_)

    def memories(self) -> dict[str, slice]:
        """Where the memory of drive, mechanism and each effect stands in the state, by path."""
        slots, start = {}, PARTS
        remembering: tuple[tuple[str, type[Part] | type[Effect]], ...] = (
            ('drive', self.drive), ('mechanism', self.mechanism),
            *((f'effects.{p.name}', p.effect) for p in self.effects))
        for path, owner in remembering:
            slots[path] = slice(start, start + owner.memory)
            start += owner.memory
        return slots

    def place(self, name: str) -> int:
        """Where a number stands in `theta`, by its path or as `path[i]`; raises ServoError."""
        return int(self._slots[split_name(name)[0]].start) + self._index(name)

    def number(self, name: str) -> float:
        """One value by its path, or one of a row as `path[i]`; raises ServoError."""
        index = self._index(name)
        return _row(self.values[split_name(name)[0]])[index]

    def _index(self, name: str) -> int:
        """Place of a number in its row, 0 of what is one number; raises ServoError."""
        path, index = split_name(name)
        if path not in self.values:
            raise self._unknown(path)
        value, size = self.values[path], len(_row(self.values[path]))
        if isinstance(value, tuple) != (index is not None) or (index or 0) >= size:
            raise ServoError(f'{self.name}: {name}: {path} is ' + (
                f'a row of {size}: {path}[0] to {path}[{size - 1}]' if isinstance(value, tuple)
                else 'one number'))
        return index or 0

    def _unknown(self, path: str) -> ServoError:
        """Return the error of a path that is none, with those near it."""
        paths = [known for known, _ in self.declarations()]
        near = [p for p in paths if p.rpartition('.')[0] == path.rpartition('.')[0]]
        return ServoError(f'{self.name}: there is no parameter {path!r}; '
                          f'there are {near or paths}')

    @cached_property
    def _slots(self) -> dict[str, slice]:
        return self.slots()

    @cached_property
    def numbers(self) -> Mapping[str, float]:
        """The values that are one number each, by path; rows are left out."""
        return {path: value for path, value in self.values.items()
                if not isinstance(value, tuple)}

    @cached_property
    def _declared(self) -> Mapping[str, Parameter]:
        return dict(self.declarations())

    @cached_property
    def _places(self) -> Mapping[str, Placed]:
        return {f'effects.{placed.name}': placed for placed in self.effects}

    def with_values(self, changes: Mapping[str, Value], source: str | None = None) -> Servo:
        """Return this servo with values changed, of a row all or `path[i]`; raises ServoError."""
        values = dict(self.values)
        for name, value in changes.items():
            path, index = split_name(name)
            if path not in self.values:
                raise self._unknown(path)
            if index is None:
                values[path] = value
            else:
                index, row = self._index(name), _row(values[path])
                values[path] = (*row[:index], *_row(value), *row[index + 1:])
        provenance = dict(self.provenance)
        if source is not None:
            provenance.update({split_name(name)[0]: Provenance(source) for name in changes})
        return replace(self, values=values, provenance=provenance)

    def with_effects(self, *more: Placed, values: Mapping[str, Value] | None = None,
                     provenance: Mapping[str, Provenance] | None = None) -> Servo:
        """Return this servo with effects added behind those it has; raises ServoError."""
        return replace(self, effects=self.effects + more, values={**self.values, **(values or {})},
                       provenance={**self.provenance, **(provenance or {})})

    def without_effects(self, gone: Callable[[Placed], bool]) -> Servo:
        """Return this servo without some effects, and without all that was said of them."""
        lost = tuple(f'effects.{placed.name}.' for placed in self.effects if gone(placed))

        def kept(table: Mapping[str, Kept]) -> dict[str, Kept]:
            return {path: what for path, what in table.items() if not path.startswith(lost)}

        return replace(self, effects=tuple(p for p in self.effects if not gone(p)),
                       values=kept(self.values), tolerance=kept(self.tolerance),
                       provenance=kept(self.provenance))

    def unit(self, path: str) -> str:
        """Unit of a parameter, of what moves straight in metres and newtons."""
        if path == 'mechanism.ratio' and self.linear and self.turning:
            return 'rad/m'
        return self.reads(self._declared[split_name(path)[0]].unit, split_name(path)[0])

    def reads(self, unit: str, thing: str) -> str:
        """Return a unit of what turns as `thing` has it; see :meth:`straight`."""
        return straightened(unit) if self.straight(thing) else unit

    def straight(self, thing: str) -> bool:
        """
        Tell whether a parameter (by its path), a channel, a site or an equation moves straight.

        All of a linear axis does, but a motor that turns and what is counted at it. The observer
        is no side of it: its rad/s is a frequency.
        """
        if thing.startswith('observer.'):
            return False
        if not (self.linear and self.turning):
            return self.linear
        if thing.startswith('mechanism.'):  # a screw declares the units of either side
            return thing != 'mechanism.rotor_inertia' and not self.mechanism.slides
        path, _, name = thing.rpartition('.')
        placed = self._places.get(path)
        if placed is not None:
            at_motor = name == 'order' and hasattr(placed.effect, 'motor_slope')
            return placed.site not in TURNING and not at_motor
        return thing not in TURNING and not thing.startswith(
            ('drive.', 'sensors.motor_encoder.', 'motor_'))

    def noise(self, channel: str) -> float:
        """Noise floor of a channel in its unit; NaN where the machine has no such sensor."""
        for sensor in self.sensors:
            if sensor.channel == channel:
                return _row(self.values[f'sensors.{sensor.name}.noise'])[0]
        return float('nan')


def _row(value: Value) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)
