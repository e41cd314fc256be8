"""
What a fault adds to a machine: tabulated curves, terms, elements with memory, and their scales.

A fault is made of an `amount`, the `Scale` of its machine and shaft, and a generator of chance for
what the amount leaves open (a phase, an order, a width).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
import inspect
import re
from typing import Any

import numpy as np

from .plant import Plant
from .terms import ELEMENTS, LAPSE, NODES, PORTS, REACH, VARIABLES, WEIGHT

Law = Callable[[Any], Any]
PLACES = ('motor', 'load', 'mesh')


class Inapplicable(ValueError):
    """A machine does not have what a curve is about."""


@dataclass(frozen=True)
class Table:
    """A curve over the range of its variable; ``warp`` puts more nodes near zero."""

    law: Law
    low: float
    high: float
    warp: float = 0.0
    wraps: bool = False

    def nodes(self) -> np.ndarray:
        """Return the curve at the NODES + 1 edges of its cells."""
        at = np.linspace(*self._edges(), NODES + 1)
        at = self.warp * np.sinh(at) if self.warp else at
        return np.broadcast_to(np.asarray(self.law(at), dtype=float), at.shape)

    def head(self) -> tuple[float, float, float, float]:
        """Return where the table begins, its cells per unit, its warp and whether it repeats."""
        low, high = self._edges()
        return low, NODES / (high - low), self.warp, float(self.wraps)

    def _edges(self) -> tuple[float, float]:
        """Return the ends of the range as they are tabulated."""
        if not self.warp:
            return self.low, self.high
        return float(np.arcsinh(self.low / self.warp)), float(np.arcsinh(self.high / self.warp))


@dataclass(frozen=True)
class Term:
    """A product of up to three tables, each of a variable, that adds to a port."""

    port: str
    factors: tuple[tuple[str, Table], ...]


def laws_of(terms: tuple[Term, ...]) -> np.ndarray:
    """Return terms as the integrator reads them."""
    terms = sorted(terms, key=lambda one: PORTS.index(one.port))
    ports = [PORTS.index(one.port) for one in terms]
    head = len(PORTS) + 1
    first = head + 6 * np.searchsorted(ports, np.arange(head))
    factors, tables = np.full((len(terms), 6), -1.0), []
    for n, one in enumerate(terms):
        for j, (name, table) in enumerate(one.factors):
            factors[n, j] = VARIABLES.index(name)
            factors[n, 3 + j] = head + 6 * len(terms) + (5 + NODES) * len(tables)
            tables.append((*table.head(), *table.nodes()))
    return np.concatenate((first, factors.ravel(), np.ravel(tables)))


@dataclass(frozen=True)
class Elements:
    """Elements with memory at one place, see `terms.py`."""

    kind: int
    reach: np.ndarray  # rad
    weight: np.ndarray
    height: float = 0.0
    power: float = 1.0
    lapse: float | np.ndarray = 0.0


def memory_of(places: dict[str, Elements]) -> np.ndarray:
    """Return the elements of each place as the integrator reads them."""
    rows = np.zeros((3, 3 + 3 * ELEMENTS))
    for name, one in places.items():
        row, n = rows[PLACES.index(name)], len(one.reach)
        row[:3] = one.kind, one.height, one.power
        for start, what in ((REACH, one.reach), (WEIGHT, one.weight), (LAPSE, one.lapse)):
            row[start:start + n] = what
    return rows


@dataclass(frozen=True)
class Change:
    """What is other than the plain machine."""

    plant: dict[str, float] = field(default_factory=dict)
    terms: tuple[Term, ...] = ()
    memory: dict[str, Elements] = field(default_factory=dict)
    delay: Callable[[np.ndarray], np.ndarray] | None = None  # of sample numbers: s

    def __add__(self, other: Change) -> Change:
        return Change({**self.plant, **other.plant}, self.terms + other.terms,
                      {**self.memory, **other.memory}, other.delay or self.delay)


@dataclass(frozen=True)
class Scale:
    """The sizes that faults of a machine are counted in, at the site where they act."""

    plant: Plant
    site: str
    way: float              # 1 where a fault is more, -1 where less or the other way
    load_torque: float      # N m, rated, at the load
    load_speed: float       # rad/s, highest, at the load
    travel: float           # rad of the load, to either side of zero
    seconds: float          # of a recording
    hung: tuple[float, float] = (6.0, 15.0)  # Hz
    known: tuple[float, ...] = ()  # orders that the servo file has

    @property
    def turns(self) -> float:
        """Turns of the shaft of this site for one of the load."""
        return self.plant.ratio if self.site == 'motor' else 1.0

    @property
    def torque(self) -> float:
        """Rated torque at this site, N m."""
        return self.load_torque / self.turns

    @property
    def speed(self) -> float:
        """Highest speed at this site, rad/s."""
        return self.load_speed * self.turns

    @property
    def current(self) -> float:
        """Current at rated torque, A."""
        return self.load_torque / self.plant.ratio / self.plant.torque_constant

    @property
    def command(self) -> float:
        """Command at rated torque and, of a winding, 0.7 of the highest speed, V."""
        p = self.plant
        volts = p.resistance * self.current + 0.7 * p.back_emf * p.ratio * self.load_speed
        return (volts if p.resistance else self.current) / p.gain

    @property
    def twist(self) -> float:
        """Twist of the gear at rated torque, rad."""
        return self.load_torque / self.plant.stiffness

    def order(self, chance: np.random.Generator, *choices: float) -> float:
        """Return one of the orders that the servo file does not have."""
        return float(chance.choice([one for one in choices if one not in self.known]))

    def by(self, variable: str, law: Law) -> tuple[str, Table]:
        """Return a curve of a variable over all that a recording may show of it."""
        shaft = self.plant.ratio if variable.startswith('motor') else 1.0
        if variable.endswith(('speed', 'rate')):
            most = 4.0 * self.load_speed * shaft
            return variable, Table(law, -most if variable.endswith('rate') else 0.0, most,
                                   1e-3 * most)
        most = {'direction': 1.0, 'flank': 1.0, 'time': 2.0 * self.seconds,
                'torque': 8.0 * self.load_torque, 'driven_torque': 8.0 * self.load_torque,
                'current': 8.0 * self.current, 'command': 1.5 * self.plant.limit,
                'temperature_rise': 80.0, 'contact': 8.0 * self.twist,
                'load_angle': 2.0 * self.travel, 'motor_angle': 2.0 * self.travel * shaft,
                'rest': 0.0}[variable]
        if variable == 'rest':
            return variable, Table(law, 0.0, 1e4, 1e-3)
        return variable, Table(law, 0.0 if variable in ('time', 'temperature_rise') else -most,
                               most)

    def turn(self, law: Law, order: float = 1.0, shaft: str = '') -> tuple[str, Table]:
        """Return a curve of ``order`` times the angle of a shaft, which repeats after 2 pi."""
        return f'{shaft or self.site}_angle', Table(lambda q: law(order * q), 0.0,
                                                    2.0 * np.pi / order, wraps=True)

    def resists(self, amount: float, *factors: tuple[str, Table],
                speed: Law = lambda x: 1.0) -> Change:
        """Return friction at this site: ``amount`` of rated torque by a curve of speed / top."""
        curve = self.by(f'{self.site}_speed',
                        lambda v: amount * self.torque * speed(v / self.speed))
        return Change(terms=(Term(f'{self.site}_friction', (curve, *factors)),))

    def adds(self, port: str, *factors: tuple[str, Table]) -> Change:
        """Return what adds to a port."""
        return Change(terms=(Term(port, factors),))

    def at(self, site: str) -> Scale:
        """Return the scale of another site."""
        return replace(self, site=site)


@dataclass(frozen=True)
class Mechanism:
    """A fault by name: where it may act, what a machine must have for it, and its curves."""

    name: str
    sites: tuple[str, ...]
    needs: frozenset[str]
    curves: dict[str, str]
    build: Callable[[float, Scale, np.random.Generator, str], Change]
    balance: str = ''        # of what no catalogue has
    variables: tuple[str, ...] = ()


MECHANISMS: dict[str, Mechanism] = {}


def mechanism(sites: str, needs: str = '', name: str = '', balance: str = '',
              variables: str = '') -> Callable:
    """Register a function as a mechanism; its docstring lists `curve: law; source`."""
    def register(build: Callable) -> Callable:
        called = name or build.__name__
        said = inspect.cleandoc(build.__doc__).replace('\n  ', ' ')
        curves = dict(re.findall(r'^(\w+): (.+)$', said, re.MULTILINE))
        MECHANISMS[called] = Mechanism(called, tuple(sites.split()), frozenset(needs.split()),
                                       curves, build, balance, tuple(variables.split()))
        return build
    return register
