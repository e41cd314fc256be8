"""The servo with the missing effects in it: what is added, changed, and free in a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from servo_twin.physics.catalogue import find
from servo_twin.physics.effect import Effect
from servo_twin.physics.element_names import split_name
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.servo import Placed, Servo, Value

from ..decisions import WORTH
from ..mechanisms.hypothesis import Hypothesis, UNKNOWN
from ..residuals.nuisance import value_of
from ..selection.explain import Explained
from .compliance import met, sprung
from .curves import Part
from .drawn_values import by_path, stds_of, with_others
from .effect_values import by_orders, direct, one_way, scale_std, warmed, warms, wave_stds
from .laws import Formed, formed, lawful
from .with_values import with_values

SITES = {'transmission': 'mesh', 'drive': 'command'}


@dataclass(frozen=True)
class Added:
    """
    One missing effect in the servo file.

    ``placed`` are its effects, ``values`` those of their parameters and of what it changes, by
    path; ``free`` paths that a fit moves, but those ``held`` at what the equations say; ``stds``
    how sure that is by name, where it is known; ``law`` whether it has the formula of the
    catalogue; ``as_law`` the same mechanism with that formula, where its curve lies outside;
    ``evidence`` what the equations would lose without it, nats; ``holds`` the share of its curve's
    squares that its formula has. An empty one stands for a mechanism that no effect of the twin
    can show.
    """

    part: Part
    placed: tuple[Placed, ...] = ()
    values: Mapping[str, Value] = field(default_factory=dict)
    free: tuple[str, ...] = ()
    held: frozenset[str] = frozenset()
    stds: Mapping[str, float] = field(default_factory=dict)
    law: bool = False
    mechanism: type | None = None
    step: float | None = None
    as_law: Added | None = None
    evidence: float = 0.0
    holds: float = 1.0

    @property
    def fitted(self) -> tuple[str, ...]:
        """Paths that a simulation is asked for."""
        return tuple(path for path in self.free if path not in self.held)

    @property
    def acts(self) -> bool:
        """Whether the twin can show it."""
        return bool(self.values)


def servo_with(servo: Servo, several: Sequence[Added]) -> Servo:
    """Return the servo with missing effects in it; raises ServoError."""
    effects, values = list(servo.effects), dict(servo.values)
    for one in several:
        effects += one.placed
        values |= one.values
        if one.mechanism is not None:
            servo = replace(servo, mechanism=one.mechanism, step=one.step or servo.step)
    freed = {path for one in several for path in one.values}
    tolerance = {n: span for n, span in servo.tolerance.items() if split_name(n)[0] not in freed}
    return replace(servo, effects=tuple(effects), values=values, tolerance=tolerance)


def added_of(found: Explained, parts: Sequence[Part]) -> list[Added]:
    """Return the parts of an answer as effects of the servo."""
    taken = {placed.name for placed in found.samples.servo.effects}
    changed = {path: value for part in parts for path, value in _value_of(found, part).items()}
    several = [_added(found, part, taken, changed) for part in parts]
    left = {path: value for one in several if one.placed for path, value in one.values.items()}
    return [replace(one, values={p: left.get(p, value) for p, value in one.values.items()})
            for one in several]


def _value_of(found: Explained, part: Part) -> Mapping[str, Value]:
    """Return the value of the servo file that a part stands for, by path; empty for others."""
    servo, one = found.samples.servo, found.hypotheses[part.number]
    if part.path:
        changes = {part.path: part.change}
    elif 'law' in one.detail:
        return {}
    elif 'value' in one.detail and part.curve is not None:  # the file has one value of it
        path, given = one.detail['value'], servo.numbers[one.detail['value']]
        changes = {path: one.detail['is'](part.curve.mean()) - given}
    elif one.path:
        value = value_of(found.samples, one.path, float(part.amplitudes[0]))
        changes = {one.path: value - servo.numbers[one.path]}
    else:
        return {}
    return _changed(servo, part, changes).values


def _added(found: Explained, part: Part, taken: set[str], changed: Mapping[str, Value]) -> Added:
    servo, one = found.samples.servo, found.hypotheses[part.number]
    name, site = part.mechanism.name, part.mechanism.site
    amplitudes = part.amplitudes
    value = _value_of(found, part)
    if value:
        return Added(part, (), value, tuple(value), law='value' not in one.detail,
                     stds=stds_of(part, lambda drawn: _value_of(found, drawn)))
    if 'told' in one.detail:  # nothing of the catalogue has it
        return Added(part)
    if name == 'controller_mismatch':
        return _changed(servo, part, dict(zip(one.knots, map(float, amplitudes), strict=True)))
    if 'effect' in one.detail:
        values = dict(zip(one.detail['amplitudes'], map(float, amplitudes), strict=True))
        values |= one.detail['shapes']
        return _placed(part, [Formed(one.detail['effect'], values, tuple(values), True)], site,
                       taken)
    now = replace(servo, values={**servo.values, **changed})
    both = with_values(part, one, now)
    if both is not None:
        effects = _placed(part, both[0], site, taken)
        own = _changed(now, part, both[1])
        return replace(effects, values={**effects.values, **own.values},
                       free=(*effects.free, *own.free), stds=stds_of(part, lambda drawn: (
                           with_others(drawn, one, now, effects.placed))))
    stiffness = servo.numbers.get('mechanism.stiffness', np.inf)
    if name == 'stiffness_error':
        relaxes = one.detail.get('relaxation')
        if servo.mechanism not in ((Rigid,) if relaxes is None else (Rigid, TwoInertia)):
            return Added(part)
        searched = relaxes, 0.0 if relaxes is None else one.knots[0]
        values, step = sprung(servo, part, *searched)
        stds = stds_of(part, lambda drawn: sprung(servo, drawn, *searched)[0])
        if relaxes is not None:  # by one shaft it is told as badly as when a row was read
            stds['mechanism.damping'] = np.inf
        return Added(part, (), values, tuple(values), law=True, mechanism=TwoInertia, step=step,
                     stds=stds)
    waves = by_orders(part, one)
    if waves:
        mean = amplitudes[np.asarray(one.knots) == 0.0][:1] if len(one.knots) else []
        level = {'position_dependent_friction': 'coulomb_friction',
                 'position_dependent_backlash': 'backlash'}.get(name)
        if level and len(mean) and mean[0] > 0.0 and name != 'position_dependent_friction':
            effect = find(level)
            waves.append(Formed(effect, {effect.amplitudes()[0]: float(mean[0])},
                                effect.amplitudes()[:1], True))
        effects = _placed(part, waves, site, taken)
        return _with_contact(replace(effects, stds=wave_stds(
            part.curve, effects.placed, effects.values)), servo, one)
    if part.way and part.curve is not None:
        return _placed(part, one_way(part.curve, part.way), site, taken)
    if warms(one) and amplitudes[-1]:
        fades = part.curve is not None and part.curve.size() > WORTH * abs(amplitudes[-1])
        timed = lawful(_by_its_law(part, one), servo) if fades else None
        added = _placed(part, [warmed(part, one, timed)], site, taken)
        return replace(added, stds=stds_of(part, lambda drawn: by_path(
            added.placed, [warmed(drawn, one, timed)])))
    same = direct(part, one)
    if same:
        added = _placed(part, [same], site, taken)
        added = replace(added, stds=stds_of(part, lambda drawn: by_path(
            added.placed, [direct(drawn, one)])))
        return _with_contact(added, servo, one)
    if name == UNKNOWN and part.mechanism.port == 'sensor':
        return Added(part)
    if 'law' in one.detail:
        known = lawful(_by_its_law(part, one), servo)
        return Added(part) if known is None else _placed(part, [known], site, taken)
    known = formed(_with_port(part), servo, stiffness)
    if known is None:
        return Added(part)
    other = None if known.law else lawful(_with_port(part), servo, stiffness)
    as_law = None if other is None or not other.holds else replace(  # a law that has none of it
        _placed(part, [replace(other, law=True)], site, taken), holds=other.holds)
    effects = _placed(part, [known], site, taken)
    return replace(effects, as_law=as_law, stds=scale_std(
        part.curve, effects.placed, effects.values, effects.free))


def _with_contact(added: Added, servo: Servo, one: Hypothesis) -> Added:
    """Return what acts between teeth with the spring on which they meet, where there is none."""
    if 'contact' not in one.detail:
        return added
    values, step = met(servo, one.detail['contact'])
    return replace(added, values={**added.values, **values}, free=(*added.free, *values),
                   mechanism=TwoInertia, step=step)


def _by_its_law(part: Part, one: Hypothesis) -> Part:
    name = one.detail.get('law', part.mechanism.name)
    return replace(part, mechanism=replace(part.mechanism, name=name))


def _with_port(part: Part) -> Part:
    """Return a part with the port of the twin at which its curve acts."""
    mechanism = part.mechanism
    port = mechanism.port
    if port == 'shaft':
        port = 'friction' if mechanism.symmetry == 'odd' and part.curve is not None and (
            part.curve.variable not in ('current', 'acceleration')) else 'torque'
    elif port == 'transmission':
        port = 'mesh_error' if mechanism.symmetry == 'even' else 'mesh'
    return replace(part, mechanism=replace(mechanism, port=port))


def _named(effect: str, site: str, taken: set[str]) -> str:
    for name in (effect, f'{effect}_{site}', *(f'{effect}_{site}_{n}' for n in range(2, 99))):
        if name not in taken:
            taken.add(name)
            return name
    raise AssertionError('a hundred effects of one kind')


def _placed(part: Part, several: Sequence[Formed], site: str, taken: set[str]) -> Added:
    placed: list[Placed] = []
    values: dict[str, Value] = {}
    free: list[str] = []
    for one in several:
        at = site if site in one.effect.sites else SITES.get(site, one.effect.sites[0])
        instance = Placed(_named(one.effect.name, at, taken), one.effect, at)
        placed.append(instance)
        values |= instance.paths({name: _inside(one.effect, name, value)
                                  for name, value in one.values.items()})
        free += [f'effects.{instance.name}.{name}' for name in one.free]
    return Added(part, tuple(placed), values, tuple(free), law=all(one.law for one in several))


def _inside(effect: type[Effect], name: str, value: Value) -> Value:
    low, high = effect.parameters[name].bounds
    if isinstance(value, tuple):
        return tuple(float(np.clip(v, low, high)) for v in value)
    return float(np.clip(value, low, high))


def _changed(servo: Servo, part: Part, by: dict[str, float]) -> Added:
    declared = dict(servo.declarations())
    values: dict[str, Value] = {}
    for path, change in by.items():
        low, high = declared[path].bounds
        values[path] = float(np.clip(servo.numbers[path] + change, low, high))
    return Added(part, (), values, tuple(values), law=True)
