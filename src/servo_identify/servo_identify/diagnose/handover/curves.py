"""The measured curve of an accepted mechanism, its band, and the effects it is made of."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls

from servo_twin.physics.servo import Placed

from ..decisions import FORM, WORTH
from ..mechanisms.hypothesis import Mechanism, UNKNOWN
from ..mechanisms.patterns import SPEED_FRICTION
from ..selection.explain import Explained

POINTS = 41  # of a curve
ENDS = (1.0, 99.0)  # percentiles of its variable between which it is drawn
BAND = (5.0, 95.0)  # percentiles of the redrawn curves
RARE = 0.1  # share of the angles at which friction may be less than what is there elsewhere
BELLS = 8  # speeds within which friction may fall
VALUES = {'coulomb_friction': ('level', 0), 'viscous_friction': ('slope', 1),
          'backlash': ('width', 0)}
"""The value of a law, and the power of the speed that it stands before."""

GROWTH = (0.5, 1.0, 2.0, 3.0)  # powers of the load with which friction may grow


@dataclass(frozen=True)
class Curve:
    """
    A mechanism over one variable, with a band of 90 %, shape (points,) each.

    ``x`` in ``unit``; ``y``, ``low`` and ``high`` in ``y_unit``, as of an axis that turns.
    ``density`` (points,) is how often the recordings were there.
    """

    variable: str
    unit: str
    y_unit: str
    x: np.ndarray
    y: np.ndarray
    low: np.ndarray
    high: np.ndarray
    density: np.ndarray

    def size(self, y: np.ndarray | None = None) -> float:
        """Root mean square of the curve (or another one) where the recordings were."""
        y = self.y if y is None else y
        return float(np.sqrt(np.average(y**2, weights=self.density)))

    def mean(self) -> float:
        """Mean of the curve where the recordings were."""
        return float(self.density @ self.y / self.density.sum())

    def slope(self) -> float:
        """Slope of the straight line through zero that is nearest where the recordings were."""
        return float((self.density * self.x) @ self.y) / float((self.density * self.x) @ self.x)

    def share(self, y: np.ndarray) -> Curve:
        """Return a part of the curve, with a band of the same width in proportion."""
        part = self.size(y) / max(self.size(), 1e-300)
        return replace(self, y=y, low=y + part * (self.low - self.y),
                       high=y + part * (self.high - self.y))


@dataclass(frozen=True)
class Part:
    """
    One missing effect of a hypothesis (by its ``number``): its mechanism and its curve.

    ``path`` is the value of the servo file that is off instead, and ``change`` by how much.
    ``way`` is the direction (1 or -1) that has it alone; zero where both have it.
    """

    number: int
    mechanism: Mechanism
    curve: Curve | None
    amplitudes: np.ndarray
    path: str = ''
    change: float = 0.0
    way: float = 0.0


def curve_of(found: Explained, number: int, draws: np.ndarray,
             amplitudes: np.ndarray | None = None) -> Curve | None:
    """
    Return the curve of a hypothesis; ``draws`` are its amplitudes, redrawn.

    ``amplitudes`` are those of the chosen set where they are not given.
    """
    amplitudes = found.amplitudes(number) if amplitudes is None else amplitudes
    one = found.hypotheses[number]
    if one.form is None:
        return None
    seen = np.concatenate([np.asarray(one.form.of(errors)) for errors in found.samples.errors])
    seen = seen[np.isfinite(seen)]
    if one.form.variable == 'angle' and np.ptp(seen) > 2.0 * np.pi:
        seen = np.mod(seen, 2.0 * np.pi)
        ends = (0.0, 2.0 * np.pi)
    else:
        ends = np.percentile(seen, ENDS)
    x = np.linspace(*ends, POINTS)
    table = one.form.shape(x)
    several = table @ draws.T
    low, high = np.percentile(several, BAND, axis=1)
    y = table @ amplitudes
    half = 0.5 * (x[1] - x[0])
    density = np.histogram(seen, np.append(x - half, x[-1] + half))[0].astype(float)
    return Curve(one.form.variable, one.form.unit, one.form.y_unit, x, y, np.minimum(low, y),
                 np.maximum(high, y), density + 0.01 * density.mean())


def parts_of(found: Explained, number: int, draws: np.ndarray,
             without: Collection[str]) -> list[Part]:
    """
    Return the effects that a chosen hypothesis is made of, the largest first.

    A pattern may be several: friction over speed is Coulomb, viscous, Stribeck friction and drag,
    as much as each takes. Friction over the load is Coulomb friction and what grows. What resists
    alike at all angles is Coulomb friction, the rest is what varies; a clearance that does not
    vary is backlash. Friction that one direction has alone is one effect. A part that does less
    than WORTH of the whole is not worth naming. Where the servo file has the law of a part at the
    same place, its value is what is off.
    """
    one = found.hypotheses[number]
    curve = curve_of(found, number, draws)
    amplitudes = found.amplitudes(number)
    whole = Part(number, one.mechanism, curve, amplitudes, way=one.detail.get('way', 0.0))
    if curve is None or one.mechanism.port not in ('friction', 'clearance'):
        return [whole]
    if one.mechanism.port == 'clearance':
        common = _common(curve)
        if one.mechanism.name == 'backlash' or curve.size(curve.y - common) > FORM * curve.size():
            return [whole]
        named = {'backlash': np.full(len(curve.x), common)}
    elif one.mechanism.name == SPEED_FRICTION:
        named = _over_speed(curve, _own(found, one.mechanism.site))
    elif one.mechanism.name == 'viscous_friction' and not whole.way:  # what bends may be a level
        named = _over_speed(curve, _own(found, one.mechanism.site))
        if curve.size(curve.y - sum(named.values())) > FORM * curve.size():
            largest = max(named, key=lambda name: curve.size(named[name]))
            return [replace(whole, mechanism=replace(one.mechanism, name=largest))]
    elif one.mechanism.name == 'asymmetric_friction' and one.columns.size == 3 and not whole.way:
        level, way = amplitudes[2], float(np.sign(curve.mean()))
        if curve.size(way * curve.y - level) < FORM * curve.size():  # as much as both have more
            return [replace(whole, way=way, curve=curve.share(way * curve.y + level))]
        named = {'coulomb_friction': np.full(len(curve.x), amplitudes[2]),
                 'asymmetric_friction': curve.y}
    elif one.mechanism.name == 'load_dependent_friction' and 'law' not in one.detail:
        named = _over_load(curve, _own(found, one.mechanism.site))
    elif one.mechanism.name == 'position_dependent_friction':
        common = _common(curve)
        if abs(common) < WORTH * curve.size():
            return [whole]
        named = {'coulomb_friction': np.full(len(curve.x), common),
                 one.mechanism.name: curve.y - common}
    else:
        return [whole]
    sizes = {name: curve.size(y) for name, y in named.items()}
    total = max(sum(sizes.values()), 1e-300)
    parts = [_of_file(found, Part(number, replace(one.mechanism, name=name, variables=(
        ('direction',) if name == 'coulomb_friction' else one.mechanism.variables)),
        curve.share(y), amplitudes)) for name, y in sorted(
            named.items(), key=lambda pair: -sizes[pair[0]]) if sizes[name] > WORTH * total]
    if any(part.mechanism.name in without for part in parts):
        return [replace(whole, mechanism=replace(one.mechanism, name=UNKNOWN))]
    return parts or [whole]


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


def _common(curve: Curve) -> float:
    """Return what resists at nearly all angles: the level that most of the curve is beyond."""
    low, high = np.quantile(curve.y, (RARE, 1.0 - RARE))
    return float(max(0.0, low) + min(0.0, high))


def _over_speed(curve: Curve, less: Collection[str]) -> dict[str, np.ndarray]:
    """
    Return what each friction law over speed takes of a curve.

    ``less`` are those that the servo file has there, and may have too much of.
    """
    speed, top = curve.x, float(np.max(curve.x)) or 1.0
    falls = np.geomspace(0.02, 0.5, BELLS) * top
    return _amounts(curve, {
        'coulomb_friction': np.ones((len(speed), 1)),
        'viscous_friction': speed[:, None] / top,
        'quadratic_drag': (speed[:, None] / top) ** 2,
        'stribeck_friction': np.exp(-(speed[:, None] / falls) ** 2)}, less)


def _over_load(curve: Curve, less: Collection[str]) -> dict[str, np.ndarray]:
    """Return what of a curve over the load is there without any, and what grows with it."""
    share = np.abs(curve.x) / (float(np.max(np.abs(curve.x))) or 1.0)
    return _amounts(curve, {
        'coulomb_friction': np.ones((len(share), 1)),
        'load_dependent_friction': share[:, None] ** GROWTH}, less)


def _amounts(curve: Curve, tables: dict[str, np.ndarray], less: Collection[str]
             ) -> dict[str, np.ndarray]:
    """Return what each of some laws takes of a curve: what resists, or of ``less`` too much."""
    signs = {name: (1.0, -1.0)[:1 + (name in less)] for name in tables}
    table = np.hstack([sign * some for name, some in tables.items() for sign in signs[name]])
    sure = np.sqrt(curve.density) / np.hypot(curve.high - curve.low, 0.02 * curve.size())
    amounts, _ = nnls(table * sure[:, None], curve.y * sure)
    found, at = {}, 0
    for name, some in tables.items():
        found[name] = np.zeros(len(curve.y))
        for sign in signs[name]:
            found[name] += sign * some @ amounts[at:at + some.shape[1]]
            at += some.shape[1]
    return found
