"""One missing effect of the report: rung, confidence, size, curve, and how far the gap shrinks."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from servo_twin.physics.servo import Servo

from ..decisions import EVEN, PRACTICAL
from ..handover.added import Added
from ..handover.curves import Curve
from ..handover.gap import shrink_interval
from .evidence import Evidence, Finding, named_in
from .report import Alternative, MissingEffect, RUNGS
from .shown_units import curve_units
from .sizes import size_of, STRAIGHT, TOLD
from .telling import tell


def missing_effect(evidence: Evidence, one: Finding) -> MissingEffect:
    """Return a finding as the report has it."""
    mechanism, curve, added = one.part.mechanism, one.part.curve, one.added
    halves = named_in(evidence.found, evidence.halves, one)
    sure = min(one.confidence, max(halves, 0.5 * one.confidence))
    others = [*((r.mechanism, r.confidence) for r in one.rivals), *one.instead]
    place = min(1.0, sure + sum(share for other, share in others
                                if other.site == mechanism.site))
    # the same mechanism may act at another shaft: then it is known better than its place
    sure = min(1.0, sure + sum(share for other, share in others
                               if other.name == mechanism.name))
    confidence = {'place': place, 'mechanism': sure, 'curve': 0.0, 'law': 0.0}
    if curve is not None or added.law:  # who knows the law has its curve, drawn or not
        confidence['curve'] = sure * (curve.certain() if curve is not None else 1.0)
    if added.law:
        confidence['law'] = confidence['curve']
    rung = 'place' if sure < EVEN else 'law' if added.law else (
        'curve' if curve is not None else 'mechanism')
    reported, dropped = evidence.reported, evidence.dropped[id(one.part)].gap
    full = reported['given'].gap.total() or 1.0
    realised = (dropped.total() - reported['patch'].gap.total()) / full
    low, high = shrink_interval(dropped, reported['patch'].gap)
    part = dropped.total() / full  # the interval is of what is left without the effect
    interval = part * low, part * high
    predicted = evidence.accepted[id(one.part)]
    if evidence.worse:  # nothing is handed over, so nothing shrinks
        realised, interval = 0.0, (min(0.0, interval[0]), 0.0)
    if mechanism.outside:  # its equation shows it, no simulation does
        predicted = realised = _closed(evidence, one.part.number)
        interval = (realised, realised)
    parameters = _parameters(evidence, added)
    drawn = None if curve is None else drawn_curve(evidence, one, curve)
    alternatives = tuple(Alternative(other.name, other.site, round(share, 3),
                                     tell(mechanism.name, other.name))
                         for other, share in others)
    return MissingEffect(
        mechanism.name, mechanism.site, parameters, predicted, realised,
        interval,
        tuple(a.effect for a in alternatives), rung,
        {name: round(confidence[name], 3) for name in RUNGS},
        {'port': mechanism.port, 'site': mechanism.site, 'variables': list(mechanism.variables),
         'symmetry': mechanism.symmetry, 'memory': mechanism.memory,
         'driving': mechanism.driving},
        added.law, drawn, alternatives,
        _size(evidence, one, parameters, drawn),
        asdict(one.wave) if one.wave else None, round(halves, 3), not mechanism.outside)


def _size(evidence: Evidence, one: Finding, parameters: dict[str, dict[str, Any]],
          drawn: dict[str, Any] | None) -> str:
    """Return the size of an effect in words."""
    if one.wave:
        return str(one.wave)
    whole = evidence.found.hypotheses[one.part.number]
    detail = whole.detail
    told = detail.get('told') or detail.get('size')
    if told:
        return str(told(whole.knots, one.part.amplitudes, evidence.servo))
    if 'value' in detail and drawn:  # it varies, and the file gets its mean
        x = drawn['x']
        first, last = (f'{detail["is"](float(drawn["y"][k])):.3g}' for k in (0, -1))
        unit = evidence.servo.unit(detail['value'])
        if first == last:  # then that mean is the answer
            return size_of(parameters, None)
        return f'{first} to {last} {unit} from {x[0]:.3g} to {x[-1]:.3g} {drawn["unit"]}'
    turn = '' if 'along' in detail else _turn(one.added, evidence.servo)
    given = evidence.servo.numbers
    values = evidence.handover.patch.numbers
    stayed = {path.rpartition('.')[2] for path in one.added.free
              if path in given.keys() & values.keys()
              and abs(values[path] - given[path]) <= PRACTICAL * abs(given[path])}
    changed = {name: value for name, value in parameters.items() if name not in stayed}
    parameters = changed or parameters  # a setting that stayed is none of the answer
    # a controller is set by all that it has otherwise
    most = len(parameters) if one.part.mechanism.site == 'controller' else TOLD
    # the values of a law that does not hold say less than the curve
    return size_of(parameters if one.added.law or turn or not drawn else {}, drawn, turn, most)


def _turn(added: Added, servo: Servo) -> str:
    """Return the shaft in whose turns waves are counted: STRAIGHT of one that has none, or ''."""
    effects = [(p.effect.name, p.site) for p in added.placed if 'order' in p.effect.parameters]
    if not effects or len(effects) < len(added.placed):
        return ''
    motors = all(name == 'kinematic_error' or site.startswith('motor') for name, site in effects)
    if motors:
        return STRAIGHT if servo.straight('motor') else 'motor'
    return STRAIGHT if servo.linear else 'load'


def drawn_curve(evidence: Evidence, one: Finding, curve: Curve) -> dict[str, Any]:
    """Return the curve of a finding with its band, in the units of its place."""
    mechanism = one.part.mechanism
    law = evidence.found.hypotheses[one.part.number].detail.get('law', mechanism.name)
    unit, y_unit = curve_units(evidence.servo, replace(mechanism, name=law), curve)
    return {'variable': curve.variable, 'unit': unit, 'y_unit': y_unit,
            'x': curve.x, 'y': curve.y, 'low': curve.low, 'high': curve.high}


def _closed(evidence: Evidence, number: int) -> float:
    """Return the share of the gap that a hypothesis closes in the equation that it acts on."""
    search, fit = evidence.found.search, evidence.found.explanation.smallest
    rest = search.fitted(fit.choice.minus(number))
    before, without, after = (search.excess(one) for one in (search.nothing, rest, fit))
    at = int(np.argmax((without - after) * search.sizes.sum(axis=1)))
    return float((without - after)[at] / before[at]) if before[at] > 0.0 else 0.0


def _parameters(evidence: Evidence, added: Added) -> dict[str, dict[str, Any]]:
    """
    Return the values of a missing effect: value, standard deviation and unit.

    What is added comes first, then the values of the file: what changes most in proportion first.
    """
    patch, found, given = evidence.handover.patch, {}, evidence.servo.numbers

    def change(path: str) -> float:
        if path not in given:
            return np.inf
        return abs(float(patch.numbers[path]) - given[path]) / max(abs(given[path]), 1e-12)

    for path in sorted(added.free, key=change, reverse=True):
        value, unit = patch.values[path], patch.unit(path)
        several = [(f'[{i}]', v) for i, v in enumerate(value)] if isinstance(value, tuple) else [
            ('', value)]
        for index, v in several:
            std = evidence.handover.chosen.get(path + index)
            std = None if std is None or not np.isfinite(std) else float(std)
            short = path.rpartition('.')[2] + index
            name = path + index if short in found else short
            found[name] = {'value': float(v), 'std': std, 'unit': unit}
    for placed in added.placed:  # of waves, how often they repeat in a turn
        path = f'effects.{placed.name}.order'
        if path in added.values and path not in added.free:
            found['order' if 'order' not in found else path] = {
                'value': float(patch.numbers[path]), 'std': None, 'unit': patch.unit(path)}
    return found
