"""
What might be missing in a twin: every effect of the catalogue at every site, every parameter.

The extended servo carries all candidates at once, switched off; to try one is a switch and a
value, never a compilation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from servo_twin.physics.catalogue import find, names
from servo_twin.physics.effect import Effect, Parameter
from servo_twin.physics.servo import Placed, Servo

from .spring import may_bend, SPRING
from .spring import NAME as SPRING_NAME

CONTROLLER = 'controller_mismatch'
ROW = 3  # multiples of a base order that a candidate may have

TABLE_NAMES = {
    'drive.torque_constant': 'torque_constant_error',
    'mechanism.stiffness': 'stiffness_error',
}
"""Parameters whose error has a name of its own in the table of signatures."""
ALIASES = {name: f'parameter:{path.split(".")[-1]}' for path, name in TABLE_NAMES.items()}
"""What these are called as the parameters that they are."""


def has_order(effect: type[Effect]) -> bool:
    """Tell whether a law is periodic with an order that is read off the residual."""
    return 'order' in effect.parameters and bool(effect.parameters['order'].grid)


@dataclass(frozen=True)
class Candidate:
    """
    One possible cause: an effect at a site with given shapes, or a parameter beyond its tolerance.

    ``paths`` are the servo paths of its amplitudes (rows spelled out by ``elements``), ``shapes``
    the values of its shape parameters by path.
    """

    name: str
    site: str
    paths: tuple[str, ...]
    elements: tuple[int, ...]
    shapes: tuple[tuple[str, float], ...] = ()
    switch: int | None = None
    effect: type[Effect] | None = None

    @property
    def key(self) -> tuple[str, str]:
        """What makes two candidates the same cause: name and site, whatever the shapes."""
        return self.name, self.site

    @property
    def kind(self) -> tuple | None:
        """
        Where its law acts and on what: port, site, variables, memory; None for a parameter.

        Two laws of one kind can take each other's shape.
        """
        if self.effect is None:
            return None
        return self.effect.port, self.site, self.effect.variables(), bool(self.effect.memory)

    @property
    def order(self) -> float:
        """Periods in one turn, of a periodic law whose order was read off; 0 of any other."""
        if self.effect is None or not has_order(self.effect):
            return 0.0
        return next(value for path, value in self.shapes if path.endswith('.order'))

    def takes_shape_of(self, other: Candidate) -> bool:
        """
        Tell whether it can take up what the law of another leaves: of one kind, or of one order.

        Two laws of one order at one place are waves of the same angle, one of them weighed by a
        torque or a direction.
        """
        of_one_order = self.site == other.site and 0.0 < self.order == other.order
        return of_one_order or (self.kind is not None and self.kind == other.kind)

    @property
    def bends_mesh(self) -> bool:
        """Whether it is a law of the mesh: then what a stiffness does hangs on it."""
        return self.effect is not None and self.effect.port in ('mesh', 'clearance')

    @property
    def of_mesh(self) -> bool:
        """Whether it says how the mesh winds up under a torque: such a law, or its stiffness."""
        return self.bends_mesh or 'mechanism.stiffness' in self.paths

    @property
    def label(self) -> str:
        """For people."""
        return f'{self.name} ({self.site})' if self.site else self.name


@dataclass(frozen=True)
class Extended:
    """
    A servo with every candidate effect placed and switched off.

    ``theta`` is where the laws are made linear: the values of the file, or those within tolerance
    that fit best.
    """

    servo: Servo
    given: int  # how many effects are the servo's own
    theta: np.ndarray
    on: np.ndarray
    bends: bool = False  # whether the values of a spring stand behind those of the servo
    without: tuple[str, ...] = ()  # names of causes that shall not be considered

    @property
    def nominal(self) -> np.ndarray:
        """The values as the servo file says them, everything else vanished."""
        values = self.servo.theta
        return np.concatenate((values, np.zeros(len(self.theta) - len(values))))

    def slot(self, path: str, element: int = 0) -> int:
        """Index of a parameter (or one number of a row) in theta."""
        if path in SPRING:
            return len(self.theta) - len(SPRING) + list(SPRING).index(path)
        return self._slots[path].start + element

    def declaration(self, path: str) -> Parameter:
        """Declaration of a parameter."""
        return SPRING[path] if path in SPRING else self._declared[path]

    @cached_property
    def _slots(self) -> dict[str, slice]:
        return self.servo.slots()

    @cached_property
    def _declared(self) -> dict[str, Parameter]:
        return dict(self.servo.declarations())


def extend(servo: Servo, sides: tuple[str, ...], channels: tuple[str, ...],
           without: tuple[str, ...] = ()) -> Extended:
    """
    Place every candidate that the recorded channels could tell anything about.

    ``sides`` are the shafts whose balances are observable on their own, ``channels`` the measured
    ones, ``without`` the names of causes, as a report has them, that shall not be considered.
    Raises KeyError for a name that no cause has.
    """
    without = _known(without, servo)
    present = {(p.effect.name, p.site) for p in servo.effects}
    placed, values = [], {}
    for name in names():
        effect = find(name)
        if not effect.candidate or name in without:
            continue
        for site in _sites(effect, servo, sides, channels):
            if (name, site) in present:
                continue
            instance = f'{name}__{site}'
            placed.append(Placed(instance, effect, site))
            for parameter in effect.parameters.values():
                path = f'effects.{instance}.{parameter.name}'
                off = parameter.off
                if parameter.row:
                    values[path] = (0.0 if off is None else off,) * ROW
                elif off is not None:
                    values[path] = off
    full = servo.with_effects(*placed, values=values)
    on = full.switches
    on[len(servo.effects):] = False
    bends = may_bend(servo, channels)
    theta = np.concatenate((full.theta, np.zeros(len(SPRING) if bends else 0)))
    return Extended(full, len(servo.effects), theta, on, bends, without)


def _known(without: tuple[str, ...], servo: Servo) -> tuple[str, ...]:
    """
    Return the names of the table for what shall be left out.

    Raises KeyError for a name that neither an effect nor a value of a servo has in a report.
    """
    values = {c.name for c in _of_parameters(servo, len(servo.effects))}
    of_the_table = {alias: name for name, alias in ALIASES.items()}
    for name in without:
        if name not in {*names(), *values, *ALIASES, *of_the_table, CONTROLLER}:
            raise KeyError(f'there is no cause {name!r} to leave out; there are '
                           f'{[*names(), CONTROLLER]} and, of this servo, {sorted(values)}')
    return tuple(of_the_table.get(name, name) for name in without)


def candidates_of(extended: Extended,
                  shapes: Callable[[type[Effect], str], list[dict[str, float]]],
                  ) -> list[Candidate]:
    """
    List all candidates of an extended servo.

    ``shapes`` gives the combinations of shape values worth trying for an effect at a site.
    """
    servo, candidates = extended.servo, []
    for index in range(extended.given, len(servo.effects)):
        candidates += _of_effect(servo, servo.effects[index], index, shapes,
                                 servo.effects[:extended.given])
    candidates += _of_parameters(servo, extended.given)
    if extended.bends:
        candidates.append(Candidate(SPRING_NAME, 'mesh', tuple(SPRING), (0,) * len(SPRING)))
    settings = tuple(p for p, d in servo.declarations()
                     if p.startswith('controller.') and d.off is not None)
    if settings:
        candidates.append(Candidate(CONTROLLER, '', settings, (0,) * len(settings)))
    return [one for one in candidates if one.name not in extended.without]


def _sites(effect: type[Effect], servo: Servo, sides, channels) -> list[str]:
    both_encoders = {'motor_position', 'load_position'} <= set(channels)
    if effect.port in ('torque', 'friction'):
        # what only one side can do is a candidate there, whichever balance it shows in
        return [s for s in effect.sites if s in sides] or list(effect.sites[:1])
    if effect.port in ('mesh', 'clearance'):
        return ['mesh'] if servo.mechanism.compliant and both_encoders else []
    if effect.port == 'mesh_error':
        return ['mesh'] if both_encoders else []
    if effect.port == 'sensor':
        return [s for s in effect.sites if s in channels]
    return list(effect.sites)


def _of_effect(servo: Servo, place: Placed, index: int, shapes,
               own: tuple[Placed, ...]) -> list[Candidate]:
    effect, prefix = place.effect, f'effects.{place.name}'
    paths, elements = [], []
    for name in effect.amplitudes():
        if name in effect.leaves:
            continue
        size = ROW if effect.parameters[name].row else 1
        for element in range(size):
            paths.append(f'{prefix}.{name}')
            elements.append(element)
    for other in own:  # bristles carry what Coulomb friction was said to carry
        if other.effect.name in effect.replaces and other.site == place.site:
            paths += [f'effects.{other.name}.{name}' for name in other.effect.amplitudes()]
            elements += [0] * len(other.effect.amplitudes())
    grids = [tuple((f'{prefix}.{n}', v) for n, v in values.items())
             for values in shapes(effect, place.site)]
    return [Candidate(effect.name, place.site, tuple(paths), tuple(elements), grid, index, effect)
            for grid in grids]


def _of_parameters(servo: Servo, given: int) -> list[Candidate]:
    """Every physical value of the servo, beyond its tolerance or without one."""
    found = []
    own = {p.name: p.site for p in servo.effects[:given]}
    for path, parameter in servo.declarations():
        owner = path.split('.')[0]
        if owner not in ('drive', 'mechanism', 'effects') or parameter.row:
            continue
        if path == 'mechanism.ratio':
            continue  # the number of teeth is known
        if owner == 'effects' and parameter.off is None:
            continue
        site = ''
        if owner == 'effects':
            instance = path.split('.')[1]
            if instance not in own:
                continue
            site = own[instance]
        leaf = path.removeprefix('effects.') if owner == 'effects' else path.split('.')[-1]
        name = TABLE_NAMES.get(path, f'parameter:{leaf}')
        found.append(Candidate(name, site, (path,), (0,)))
    return found
