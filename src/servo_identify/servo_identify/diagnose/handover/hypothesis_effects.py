"""The effects that a hypothesis is made of: a curve may be several, and several one."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from servo_twin.physics.servo import Placed

from ..decisions import FORM, OPEN, WORTH
from ..mechanisms.hypothesis import UNKNOWN
from ..mechanisms.patterns import SPEED_FRICTION
from ..selection.explain import Explained
from .curves import Curve, curve_of, Part
from .friction_shares import (
    common,
    nearest_over_speed,
    over_load,
    over_speed,
    settled,
    SPEED_LAWS,
)
from .laws import lawful

VALUES = {'coulomb_friction': ('level', 0), 'viscous_friction': ('slope', 1),
          'backlash': ('width', 0)}
"""The value of a law, and the power of the speed that it stands before."""

OVER_ANGLE = ('gravity', 'spring_load')  # torques of the load over its angle, by their law alone


def parts_of(found: Explained, number: int, draws: np.ndarray,
             without: Collection[str]) -> list[Part]:
    """
    Return the effects that a chosen hypothesis is made of, the largest first.

    A pattern may be several: friction over speed is Coulomb, viscous, Stribeck friction and drag,
    as much as each takes. Friction over the load is Coulomb friction and what grows. What resists
    alike at all angles, or once it has settled, is Coulomb friction, the rest is what varies; a
    clearance that does not vary is backlash. Friction that one direction has alone is one effect.
    An angle that is lost alike at every load is a clearance too.
    A part that does less than WORTH of the whole is not worth naming. Where the servo file has
    the law of a part at the same place, its value is what is off.
    """
    one = found.hypotheses[number]
    curve = curve_of(found, number, draws)
    amplitudes = found.amplitudes(number)
    whole = Part(number, one.mechanism, curve, amplitudes, way=one.detail.get('way', 0.0),
                 draws=draws)
    if curve is not None and one.mechanism.name in OVER_ANGLE:
        return [_by_law(found, whole)]
    if curve is not None and _jumps(found, whole):
        whole = _as_clearance(whole)
        return _nameable([_of_file(found, whole)], whole, without)
    if curve is None or one.mechanism.port not in ('friction', 'clearance'):
        return [whole]
    if one.mechanism.name == SPEED_FRICTION or (
            one.mechanism.name == 'viscous_friction' and not whole.way):  # its bend may be a level
        return _by_speed(found, whole, without)
    if one.mechanism.port == 'clearance':
        level = _level(curve)
        if one.mechanism.name == 'backlash' or not level:
            return [whole]
        named = {'backlash': np.full(len(curve.x), level)}
    elif one.mechanism.name == 'asymmetric_friction' and one.columns.size == 3 and not whole.way:
        level, way = amplitudes[:2].mean(), float(np.sign(curve.mean()))
        if curve.size(way * curve.y - level) < FORM * curve.size():  # as much as both have more
            return [replace(whole, way=way, curve=curve.share(way * curve.y + level))]
        named = {'coulomb_friction': np.full(len(curve.x), level),
                 'asymmetric_friction': curve.y}
    elif one.mechanism.name == 'load_dependent_friction' and 'law' not in one.detail:
        named = over_load(curve, _own(found, one.mechanism.site))
    elif one.mechanism.name == 'position_dependent_friction' or (
            one.mechanism.name == 'friction_drift' and 'law' not in one.detail):
        level = settled(curve) if curve.variable == 'time' else common(curve)
        if abs(level) < WORTH * curve.size():
            return [whole]
        named = {'coulomb_friction': np.full(len(curve.x), level),
                 one.mechanism.name: curve.y - level}
    else:
        return [whole]
    return _nameable(_worth_naming(found, whole, named), whole, without)


def _jumps(found: Explained, whole: Part) -> bool:
    """
    Tell whether a curve of the angle lost over the load is all there as the flank changes.

    What is lost alike at every load is a clearance; an elasticity loses more the more it carries.
    """
    one, curve = found.hypotheses[whole.number], whole.curve
    return (curve is not None and one.detail.get('equation') == 'transmission'
            and one.mechanism.variables == ('load',) and one.mechanism.symmetry == 'odd'
            and found.samples.servo.mechanism.compliant and _level(curve) > 0.0)


def _level(curve: Curve) -> float:
    """Return what a curve is all along; 0.0 of one that varies by more than a form may be off."""
    level = common(curve)
    return level if curve.size(curve.y - level) <= FORM * curve.size() else 0.0


def _as_clearance(whole: Part) -> Part:
    """Return an angle lost to either side as the clearance whose half it is."""
    assert whole.curve is not None
    width = whole.curve.share(np.full(len(whole.curve.x), 2.0 * _level(whole.curve)))
    return replace(whole, curve=width, mechanism=replace(
        whole.mechanism, name='backlash', port='clearance'))


def _by_law(found: Explained, whole: Part) -> Part:
    """
    Return a torque over an angle with the name of the law that holds more of its curve.

    Its own stays where that is the curve. A weight with multiples of its order, and a spring that
    bends, are any curve: a hose that stiffens is nearer to a spring, whatever it was made of.
    """
    several = {name: lawful(replace(whole, mechanism=replace(whole.mechanism, name=name)),
                            found.samples.servo) for name in OVER_ANGLE}
    own = several[whole.mechanism.name]
    if own is not None and own.law:
        return whole
    best = max(several, key=lambda name: getattr(several[name], 'holds', 0.0))
    return replace(whole, mechanism=replace(whole.mechanism, name=best))


def friction_at_once(found: Explained, several: Sequence[Part],
                     without: Collection[str]) -> list[Part]:
    """
    Return parts with the friction over speed of one shaft, of several hypotheses, split once.

    It is one curve: how much of it is a level is not told by which of them holds it. What replaces
    them has the number of that which the equations need most.
    """
    left, search, choice = list(several), found.search, found.explanation.smallest.choice
    for site in dict.fromkeys(part.mechanism.site for part in several):
        mine = [part for part in left if part.mechanism.site == site and _over_one_speed(part)]
        if len({part.number for part in mine}) < 2:
            continue
        whole = max(mine, key=lambda part: search.fitted(choice.minus(part.number)).total)
        curves = [part.curve for part in mine if part.curve is not None]
        curve = curves[0]
        for other in curves[1:]:
            curve = curve.plus(other)
        at = next(k for k, part in enumerate(left) if part is mine[0])
        rest = [part for part in left if all(part is not one for one in mine)]
        split = _by_speed(found, replace(whole, curve=curve), without)
        left = [*rest[:at], *split, *rest[at:]]
    return left


def _over_one_speed(part: Part) -> bool:
    return (part.mechanism.name in SPEED_LAWS and part.curve is not None and not part.way
            and part.curve.variable == 'speed' and not part.path)


def _by_speed(found: Explained, whole: Part, without: Collection[str]) -> list[Part]:
    """Return the laws that friction over speed is made of, or its curve where no sum is it."""
    assert whole.curve is not None
    curve = whole.curve
    named = over_speed(curve, _own(found, whole.mechanism.site))
    parts = _worth_naming(found, whole, named)
    if curve.size(curve.y - sum(named.values())) > FORM * curve.size() or (
            _follow_not(found, whole, parts)):
        parts = [_bent(found, whole)]
    return _nameable(parts, whole, without)


def _bent(found: Explained, whole: Part) -> Part:
    """Return a curve that no sum of laws is, with the name of the one that holds most of it."""
    assert whole.curve is not None
    return replace(whole, mechanism=replace(whole.mechanism, name=nearest_over_speed(
        whole.curve, _own(found, whole.mechanism.site))))


def _follow_not(found: Explained, whole: Part, parts: Sequence[Part]) -> bool:
    """
    Tell whether parts that are values of the file cannot follow a curve: what they leave is there.

    Where no law is missing, only its shape says that something is.
    """
    curve, one = whole.curve, found.hypotheses[whole.number]
    assert curve is not None and one.form is not None
    if not all(part.path for part in parts):
        return False
    moved = one.columns.table @ whole.amplitudes  # in noise and margin, where it moves anything
    unit = float(np.sqrt(np.mean(moved**2))) / max(
        curve.size(one.form.shape(curve.x) @ whole.amplitudes), 1e-300)
    left = curve.y - sum(part.curve.y for part in parts if part.curve is not None)
    return curve.size(left) * unit > OPEN


def _nameable(parts: list[Part], whole: Part, without: Collection[str]) -> list[Part]:
    """Return parts, or the whole where there are none, nameless where one is left out."""
    if any(part.mechanism.name in without for part in parts):
        return [replace(whole, mechanism=replace(whole.mechanism, name=UNKNOWN))]
    return parts or [whole]


def _worth_naming(found: Explained, whole: Part, named: dict[str, np.ndarray]) -> list[Part]:
    """Return the parts of a curve that are worth it, the largest first."""
    curve = whole.curve
    assert curve is not None
    sizes = {name: curve.size(y) for name, y in named.items()}
    total = max(sum(sizes.values()), 1e-300)
    return [_of_file(found, replace(whole, mechanism=replace(
        whole.mechanism, name=name, variables=(
            ('direction',) if name == 'coulomb_friction' else whole.mechanism.variables)),
        curve=curve.share(y), way=0.0)) for name, y in sorted(
            named.items(), key=lambda pair: -sizes[pair[0]]) if sizes[name] > WORTH * total]


def _value(found: Explained, name: str, site: str) -> Placed | None:
    """Return the effect of the servo file that is this law at a shaft (or at either, as felt)."""
    several = [placed for at in _felt(found, site) for placed in found.samples.servo.effects
               if placed.effect.name == name and placed.site == at]
    return several[0] if several else None


def _own(found: Explained, site: str) -> set[str]:
    """Return the names of the friction laws that the servo file has at a shaft (or at either)."""
    return {placed.effect.name for placed in found.samples.servo.effects
            if placed.effect.port == 'friction' and placed.site in _felt(found, site)}


def _felt(found: Explained, site: str) -> tuple[str, ...]:
    """Return the sites that are as one: both shafts where their balance is that of both."""
    return ('load', 'motor') if 'torque' in found.samples.present and site != 'mesh' else (site,)


def _of_file(found: Explained, part: Part) -> Part:
    """Return a part as a change of a value, where the servo file has its law there."""
    known = _value(found, part.mechanism.name, part.mechanism.site)
    if part.mechanism.name not in VALUES or known is None or part.curve is None:
        return part
    name, power = VALUES[part.mechanism.name]
    ratio = found.samples.servo.numbers['mechanism.ratio']
    lever = ratio if known.site != part.mechanism.site and known.site == 'motor' else 1.0
    x, y = part.curve.x, part.curve.y
    change = float((x**power @ y) / (x**power @ x**power)) / lever**(1 + power)
    return replace(part, path=f'effects.{known.name}.{name}', change=change, mechanism=replace(
        part.mechanism, name=f'parameter:{known.name}.{name}', site=known.site))
