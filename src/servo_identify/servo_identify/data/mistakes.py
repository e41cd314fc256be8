"""Mistakes that people make in a table of measurements: units, signs, shafts, columns."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from math import log, pi
from types import SimpleNamespace

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.state import CONTROLLER_SIZE

from .signals import ANGLES, Signals, TURN
from .survey import limit_of

MISTAKE = log(100.0)  # nats: one column in a hundred
DEGREE, RPM = pi / 180.0, pi / 30.0
EDGES = 4.0  # counts of a line of a quadrature encoder
REFERENCES = ('reference_position', 'reference_velocity')
FULL = {1.0: 'a duty', 100.0: 'a duty in %'}
_LITTLE = 1e-6  # rad and rad/s: no command is at its limit for it


@dataclass(frozen=True)
class Mistake:
    """
    A mistake, by what undoes it.

    ``factors`` multiply channels, ``time`` the period, ``renamed`` gives channels their right
    name. ``what`` reads after "a factor of X closes 99 %:" or alone, ``action`` says what to do.
    """

    what: str
    action: str
    factors: Mapping[str, float] = field(default_factory=dict)
    time: float = 1.0
    renamed: Mapping[str, str] = field(default_factory=dict)
    cost: float = MISTAKE

    def undone(self, at: Signals) -> Signals:
        """Return the channels without it."""
        return at.scaled(self.factors, self.time, self.renamed)

    @property
    def touches(self) -> frozenset[str]:
        """Channels (and ``time``) that it is about."""
        return frozenset([*self.factors, *self.renamed, *(['time'] if self.time != 1.0 else [])])

    @property
    def factor(self) -> str:
        """What is done to undo it, as a phrase."""
        if self.time != 1.0:
            return f'a factor of {self.time:g} on the time'
        some = set(self.factors.values())
        names = ' and '.join(self.factors)
        if some == {-1.0}:
            return f'the other sign of {names}'
        if len(some) == 1:
            return f'a factor of {_number(*some)} on {names}'
        if some:
            return ' and '.join(f'a factor of {_number(value)} on {name}'
                                for name, value in self.factors.items())
        return 'exchanging ' + ' and '.join(sorted(self.renamed)) if len(
            self.renamed) > 1 else f'calling {next(iter(self.renamed))} ' + next(
                iter(self.renamed.values()))


def _number(value: float) -> str:
    large = value if value >= 1.0 else 1.0 / value
    return ('' if value >= 1.0 else '1/') + (f'{large:.3g}' if large < 999.5 else f'{large:.0f}')


def mistakes(channels: Collection[str], servo: Servo) -> Iterator[Mistake]:
    """Yield what may be wrong with these channels of a servo."""
    angles = [name for name in ANGLES if name in channels]
    ratio = servo.values['mechanism.ratio']
    groups = [[name] for name in angles] + ([angles] if len(angles) > 1 else [])
    for group in groups:
        yield from _angle(group, servo)
    for name in angles:  # each encoder has lines of its own
        yield from _edges(name)
    yield from _shafts(angles, ratio)
    yield from _references(channels, angles, servo)
    yield Mistake('the time is in milliseconds', 'give its unit in the header or the mapping: '
                  't [ms]', time=1e-3)
    yield Mistake('the time is in microseconds', 'give its unit in the header or the mapping: '
                  't [us]', time=1e-6)
    yield from _electrical(channels)
    if 'voltage' in channels:
        yield from _duty(limit_of(servo))
    if 'torque' in channels:
        yield _turned(['torque'], 'the torque sensor reads against the torque of the motor')
        yield _unit(['torque'], 1e-3, 'mN m')
        yield _unit(['torque'], 1e-2, 'N cm')
    if 'external_torque' in channels:
        yield _turned(['external_torque'], 'external_torque is positive where it pushes forward, '
                      'and should be where it resists the load')


def unread(servo: Servo) -> set[str]:
    """Return the references that change nothing in the command of the controller of a servo."""
    p = SimpleNamespace(**{name: servo.values[f'controller.{name}']
                           for name in servo.controller.parameters})

    def command(position: float, speed: float) -> float:
        return servo.controller.law(p, [0.0] * CONTROLLER_SIZE, position, speed, 0.0, 0.0, 0.0,
                                    servo.values['mechanism.ratio'], 1e-3)

    return {name for name, at in zip(REFERENCES, ((_LITTLE, 0.0), (0.0, _LITTLE)), strict=True)
            if command(*at) == command(0.0, 0.0)}


def _unit(names: list[str], factor: float, unit: str) -> Mistake:
    verb = 'is' if len(names) == 1 else 'are'
    told = ', '.join(f'{name} [{unit}]' for name in names)
    words = {'deg': 'degrees', 'rev': 'turns'}.get(unit, unit)
    return Mistake(f'{" and ".join(names)} {verb} in {words}',
                   f'give the unit in the header or the mapping: {told}',
                   dict.fromkeys(names, factor))


def _turned(names: list[str], what: str = '') -> Mistake:
    told = ' and '.join(names)
    verb = 'has' if len(names) == 1 else 'have'
    return Mistake(what or f'{told} {verb} the other sign',
                   f'turn the sign of {told} in the mapping: negate: true',
                   dict.fromkeys(names, -1.0))


def _angle(group: list[str], servo: Servo) -> Iterator[Mistake]:
    turning = [name for name in group if not servo.straight(name)]
    if turning:
        yield _unit(turning, DEGREE, 'deg')
        yield _unit(turning, TURN, 'rev')
    sliding = [name for name in group if name not in turning]
    if sliding:
        yield _unit(sliding, 1e-3, 'mm')
        yield _unit(sliding, 1e-6, 'um')
    yield _turned(group, f'{" and ".join(group)} '
                  + ('runs against the rest' if len(group) == 1 else 'have the other sign'))


def _edges(name: str) -> Iterator[Mistake]:
    for factor, told in ((1.0 / EDGES, 'counts read as lines'), (EDGES, 'lines read as counts')):
        yield Mistake(f'{name}: {told} of a quadrature encoder, which has {EDGES:g} counts a line',
                      f'give what one of its numbers is, as in the header {name} [1/4096 rev], or '
                      f'multiply it in the mapping: scale: {factor:g}', {name: factor})


def _shafts(angles: list[str], ratio: float) -> Iterator[Mistake]:
    action = 'map it to {}, the shaft that its encoder sits on'
    if ratio <= 1.2 and ratio >= 1.0 / 1.2:
        return
    if len(angles) == 2:
        yield Mistake('the encoders are exchanged: each is that of the other shaft',
                      'exchange motor_position and load_position in the mapping',
                      renamed={'motor_position': 'load_position',
                               'load_position': 'motor_position'})
        yield Mistake('motor_position is counted at the load shaft: that of the other shaft',
                      'multiply it with the ratio in the mapping: '
                      f'motor_position: {{scale: {ratio:g}}}', {'motor_position': ratio})
        yield Mistake('load_position is counted at the motor shaft: that of the other shaft',
                      'divide it by the ratio in the mapping: '
                      f'load_position: {{scale: {1.0 / ratio:.6g}}}',
                      {'load_position': 1.0 / ratio})
    elif angles == ['motor_position']:
        yield Mistake('motor_position is the angle of the other shaft, the load',
                      action.format('load_position'),
                      renamed={'motor_position': 'load_position'})
    elif angles == ['load_position']:
        yield Mistake('load_position is the angle of the other shaft, the motor',
                      action.format('motor_position'),
                      renamed={'load_position': 'motor_position'})


def _references(channels: Collection[str], angles: list[str], servo: Servo) -> Iterator[Mistake]:
    ratio = servo.values['mechanism.ratio']
    units = {'reference_position': ((1e-3, 'mm'),) if servo.linear else ((DEGREE, 'deg'),
                                                                        (TURN, 'rev')),
             'reference_velocity': ((1e-3, 'mm/s'), (1e-3 / 60.0, 'mm/min')) if servo.linear else
             ((DEGREE, 'deg/s'), (RPM, 'rpm'), (TURN, 'rev/s'))}
    there = [name for name in REFERENCES if name in channels]
    for name in there:
        for factor, unit in units[name]:
            yield _unit([name], factor, unit)
        yield _turned([name], f'{name} runs against the angle')
        if not 1.0 / 1.2 < ratio < 1.2:
            yield Mistake(f'{name} is counted at the motor', 'divide it by the ratio in the '
                          f'mapping: {name}: {{scale: {1.0 / ratio:.6g}}}', {name: 1.0 / ratio})
    if there and angles and not servo.linear:
        yield _unit([*angles, *there], DEGREE, 'deg')
    if there and angles:
        yield _turned([*angles, *there])


def _electrical(channels: Collection[str]) -> Iterator[Mistake]:
    for name, unit in (('current', 'mA'), ('voltage', 'mV')):
        if name in channels:
            yield _unit([name], 1e-3, unit)
            yield _turned([name])
    if 'current' in channels and 'voltage' in channels:
        both = _turned(['voltage', 'current'], 'the motor accelerates against its torque: '
                       'command and current have the opposite sign of the angles')
        yield Mistake(both.what, 'turn the sign of the angles, or of voltage and current, in the '
                      'mapping: negate: true', both.factors)
        yield Mistake('voltage and current are swapped', 'swap the two columns in the mapping',
                      renamed={'voltage': 'current', 'current': 'voltage'})


def _duty(limit: float) -> Iterator[Mistake]:
    """Yield that the command is a share of its limit, which the servo file gives in V or A."""
    for full, words in FULL.items():
        factor = limit / full
        if np.isfinite(factor) and not 1.0 / 1.2 < factor < 1.2:
            yield Mistake(f'voltage is {words}, a share of its limit of {limit:g} V',
                          'give the volts of 1 of it in the header or the mapping: '
                          f'voltage [{factor:.4g} V]', {'voltage': factor})
