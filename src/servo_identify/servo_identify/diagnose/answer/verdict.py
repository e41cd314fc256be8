"""From the evidence to a report: where, which, how far, and what follows from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS, UNITS
from servo_twin.physics.servo import Servo

from ..decisions import CALIBRATED, EVEN, SOLVED
from ..handover.added import Added
from ..handover.curves import Curve
from ..handover.gap import Gap, shrink, shrink_interval
from ..mechanisms.hypothesis import UNKNOWN
from ..selection.choice import Fitted
from ..selection.stability import share_of
from .evidence import Evidence, Finding
from .report import Alternative, GapReport, Located, MissingEffect, RUNGS
from .row_instants import told_late
from .sentences import sentence, size_of
from .shown_units import channel_unit, curve_units
from .telling import confirmations, tell


def report_of(evidence: Evidence, following: dict[str, Any], warnings: list[str],
              timing: dict[str, float]) -> GapReport:
    """Put the evidence into a report."""
    located, squares = _where(evidence)
    named = {one.part.mechanism.key: _stable(evidence, one) for one in evidence.findings
             if one.part.mechanism.name != UNKNOWN}
    which = tuple(_effect(evidence, one) for one in evidence.named)
    gap = _gap(evidence)
    balance = _place(evidence, located)
    unknown = _unknown(evidence, located)
    status = _status(evidence, which, gap, squares)
    late = told_late(evidence.found)
    verdict = {'status': status, 'effects': [one.effect for one in which], 'balance': balance,
               'sentence': sentence(status, which, balance, gap, unknown, late),
               'remains': _remains(evidence, gap, status)}
    split = evidence.split
    channels = _channels(evidence)
    return GapReport(
        servo=evidence.servo.name,
        recordings={p: [r.name for r in getattr(split, p)] for p in ('screen', 'accept',
                                                                       'report')},
        channels=channels, where=located, which=which, verdict=verdict, gap=gap,
        unknown=unknown if status in ('unknown', 'partly_explained') else {},
        next_experiment=following, warnings=tuple(dict.fromkeys(
            [*warnings, *([late] if late else []), *_worse(channels)])),
        moved=tuple(_moved(evidence)),
        stability={'splits': len(evidence.halves), 'named_in': {
            key[0]: round(share, 3) for key, share in named.items()}},
        equations=_equations(evidence), confirm=tuple(confirmations(which, evidence.servo)),
        timing=timing)


def _where(evidence: Evidence) -> tuple[tuple[Located, ...], dict[str, float]]:
    """Return the equations with how far they are off, and their mean squares at the start."""
    search = evidence.found.search
    regression = search.regression
    errors, counts = search.nothing.held_out, regression.counts
    squares = {EQUATIONS[e]: float(errors[i].sum() / max(1, counts[i].sum()))
               for i, e in enumerate(regression.equations)}
    excess = {name: max(0.0, square - CALIBRATED) for name, square in squares.items()}
    total = sum(excess.values()) or 1.0
    acting = _acting(evidence)
    chance, located = np.random.default_rng(0), []
    for name in EQUATIONS:
        if name not in squares:
            located.append(Located(name, 0.0, 0.0, (0.0, 0.0), 'not observable'))
            continue
        i = regression.equations.index(EQUATIONS.index(name))
        drawn = chance.integers(0, regression.blocks, (200, regression.blocks))
        ratios = np.sqrt(errors[i][drawn].sum(axis=1)
                         / np.maximum(1, counts[i][drawn].sum(axis=1)))
        low, high = np.percentile(ratios, (5, 95))
        gap = name in acting or squares[name] > search.open_from[i]
        located.append(Located(name, excess[name] / total if gap else 0.0,
                               float(np.sqrt(squares[name])), (float(low), float(high)),
                               'gap' if gap else 'at the noise floor'))
    return tuple(located), squares


def _acting(evidence: Evidence) -> set[str]:
    """Return the equations in which what was found takes a worthwhile part."""
    search = evidence.found.search
    best = evidence.found.explanation.smallest
    if not best.choice.members:
        return set()
    before, after = search.excess(search.nothing), search.excess(best)
    return {EQUATIONS[e] for i, e in enumerate(search.regression.equations)
            if before[i] - after[i] > 0.1 * before[i] and before[i] > 0.0}


def _place(evidence: Evidence, located: tuple[Located, ...]) -> str:
    """
    Return the equation that is at fault: where the first effect (or pattern) takes most.

    Where nothing was found it is the one that is off most.
    """
    search, fit = evidence.found.search, evidence.found.explanation.smallest
    first = [f for f in (*evidence.named, *evidence.unnamed, *evidence.findings)]
    gaps = [one for one in located if one.verdict == 'gap']
    if first:
        detail = evidence.found.hypotheses[first[0].part.number].detail.get('equation')
        if detail and not evidence.named:
            return str(detail)
        rest = search.fitted(fit.choice.minus(first[0].part.number))
        gained = (search.groups(rest.held_out) - search.groups(fit.held_out)) * search.sizes
        gained = gained.sum(axis=1)
        if np.max(gained, initial=0.0) > 0.0:
            return EQUATIONS[search.regression.equations[int(np.argmax(gained))]]
    return max(gaps, key=lambda one: one.gap_to_noise).balance if gaps else ''


def _status(evidence: Evidence, which: Sequence[MissingEffect], gap: dict[str, Any],
            squares: dict[str, float]) -> str:
    if which:
        if gap['solved'] >= SOLVED and not evidence.unnamed and _closed_all(evidence):
            return 'explained'
        helps = max(gap['solved'], gap['refitted_solved'], *(
            one.shrink_realised for one in which)) > 0.0
        return 'partly_explained' if helps else 'unknown'
    limits = evidence.found.samples.open_from
    if evidence.findings or any(square > limits(name) for name, square in squares.items()):
        return 'unknown'
    return 'no_gap'


def _closed_all(evidence: Evidence) -> bool:
    """Tell whether no equation is certainly off still, or each by a small part of what it was."""
    search, best = evidence.found.search, evidence.found.explanation.smallest
    before, after = search.excess(search.nothing), search.excess(best)
    quiet = search.power(best) <= search.open_from
    return bool(np.all(quiet | (after <= (1.0 - SOLVED) * before)))


def _effect(evidence: Evidence, one: Finding) -> MissingEffect:
    mechanism, curve, added = one.part.mechanism, one.part.curve, one.added
    stable = _stable(evidence, one)
    sure = min(one.confidence, max(stable, 0.5 * one.confidence))
    place = min(1.0, sure + sum(r.confidence for r in one.rivals
                                if r.mechanism.site == mechanism.site))
    # the same mechanism may act at another shaft: then it is known better than its place
    sure = min(1.0, sure + sum(r.confidence for r in one.rivals
                               if r.mechanism.name == mechanism.name))
    confidence = {'place': place, 'mechanism': sure, 'curve': 0.0, 'law': 0.0}
    if curve is not None:
        confidence['curve'] = sure * curve.certain()
    if added.law:
        confidence['law'] = confidence['curve'] if curve is not None else sure
    rung = 'place' if sure < EVEN else 'law' if added.law else (
        'curve' if curve is not None else 'mechanism')
    reported, dropped = evidence.reported, evidence.dropped[id(one.part)].gap
    full = reported['given'].gap.total() or 1.0
    realised = (dropped.total() - reported['patch'].gap.total()) / full
    interval = shrink_interval(dropped, reported['patch'].gap)
    predicted = evidence.accepted[id(one.part)]
    if evidence.worse:  # nothing is handed over, so nothing shrinks
        realised, interval = 0.0, (min(0.0, interval[0]), 0.0)
    if mechanism.site == 'controller':  # no simulation under the recorded command shows it
        predicted = realised = _closed(evidence, 'controller')
        interval = (realised, realised)
    parameters = _parameters(evidence, added)
    drawn = None if curve is None else _drawn(evidence, one, curve)
    alternatives = tuple(Alternative(r.mechanism.name, r.mechanism.site, round(r.confidence, 3),
                                     tell(mechanism.name, r.mechanism.name))
                         for r in one.rivals)
    return MissingEffect(
        mechanism.name, mechanism.site, parameters, predicted, realised,
        interval,
        tuple(a.effect for a in alternatives), rung,
        {name: round(confidence[name], 3) for name in RUNGS},
        {'port': mechanism.port, 'site': mechanism.site, 'variables': list(mechanism.variables),
         'symmetry': mechanism.symmetry, 'memory': mechanism.memory},
        added.law, drawn, alternatives,
        str(one.wave) if one.wave else _fed_forward(evidence, one) or size_of(
            parameters, drawn, _turn(added, evidence.servo)),
        asdict(one.wave) if one.wave else None, round(stable, 3))


def _fed_forward(evidence: Evidence, one: Finding) -> str:
    """Return what a controller adds that no value of the file is, with its size; '' of others."""
    of = evidence.found.hypotheses[one.part.number].detail.get('adds')
    if not of:
        return ''
    unit = evidence.servo.reads('rad', 'load')
    return f'it adds {one.part.amplitudes[0]:.3g} V per {unit}/s2 of {of}'


def _stable(evidence: Evidence, one: Finding) -> float:
    """
    Return in how many of the halves a finding came out.

    By its own name, by that of the hypothesis that it is a part of, or by that of a rival: what
    these recordings do not tell apart, its confidence says already.
    """
    whole = evidence.found.hypotheses[one.part.number].mechanism
    return share_of(evidence.halves, one.part.mechanism, whole,
                    *(rival.mechanism for rival in one.rivals))


def _turn(added: Added, servo: Servo) -> str:
    """Return the shaft in whose turns the waves of an effect are counted; '' where in none."""
    effects = [(p.effect.name, p.site) for p in added.placed if 'order' in p.effect.parameters]
    if not effects or len(effects) < len(added.placed):
        return ''
    motors = all(name == 'kinematic_error' or site.startswith('motor') for name, site in effects)
    return 'motor' if motors else '' if servo.linear else 'load'


def _drawn(evidence: Evidence, one: Finding, curve: Curve) -> dict[str, Any]:
    """Return the curve of a finding with its band, in the units of its place."""
    mechanism = one.part.mechanism
    law = evidence.found.hypotheses[one.part.number].detail.get('law', mechanism.name)
    unit, y_unit = curve_units(evidence.servo, replace(mechanism, name=law), curve)
    return {'variable': curve.variable, 'unit': unit, 'y_unit': y_unit,
            'x': curve.x, 'y': curve.y, 'low': curve.low, 'high': curve.high}


def _closed(evidence: Evidence, equation: str) -> float:
    """Return the share of the gap of one equation that the explanation closes."""
    at = evidence.found.search.regression.equations.index(EQUATIONS.index(equation))
    search, fit = evidence.found.search, evidence.found.explanation.smallest
    before, after = (search.excess(one)[at] for one in (search.nothing, fit))
    return float(1.0 - after / before) if before > 0.0 else 0.0


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


def _gap(evidence: Evidence) -> dict[str, Any]:
    gaps = {name: one.gap for name, one in evidence.reported.items()}
    given, after = gaps['given'], evidence.handed.gap
    solved = shrink(given, after)
    return {'before': given.total(excess=False), 'after': after.total(excess=False),
            'floor': given.noise(), 'shrink': solved,
            'interval': (0.0, 0.0) if after is given else shrink_interval(given, after),
            'as_given': given.total(excess=False),
            'within_tolerance': gaps['within'].total(excess=False),
            'refitted': gaps['refit'].total(excess=False), 'solved': solved,
            'refitted_solved': shrink(given, gaps['refit'])}


def _channels(evidence: Evidence) -> dict[str, dict[str, Any]]:
    gaps: dict[str, Gap] = {name: one.gap for name, one in evidence.reported.items()}
    return {channel: {
        'unit': channel_unit(evidence.servo, channel), 'rms_gap': gaps['given'].rms(channel),
        'noise_floor': gaps['given'].floor[channel],
        'fit': 1.0 - gaps['given'].rms(channel) / gaps['given'].signal[channel],
        'as_given': gaps['given'].rms(channel), 'augmented': evidence.handed.gap.rms(channel),
        'within_tolerance': gaps['within'].rms(channel)} for channel in gaps['given'].squares}


def _worse(channels: dict[str, dict[str, Any]]) -> list[str]:
    return [f'the {name.replace("_", " ")} gets worse with what is added: '
            f'{one["as_given"]:.3g} to {one["augmented"]:.3g} {one["unit"]}'
            for name, one in channels.items()
            if one['augmented'] > 1.1 * one['as_given']
            and one['augmented'] > 2.0 * one['noise_floor']]


def _moved(evidence: Evidence) -> list[dict[str, Any]]:
    """Return the values within tolerance that the fit would move."""
    joint, servo = evidence.handover.joint, evidence.servo
    rows: list[dict[str, Any]] = []
    if joint is None:
        return rows
    for path, (low, high) in servo.tolerance.items():
        if path in joint.values:
            given, value = servo.numbers[path], joint.values[path]
            half = 0.5 * (high - low) or 1.0
            rows.append({'path': path, 'given': given, 'found': value, 'low': low, 'high': high,
                         'unit': servo.unit(path), 'sigma': 2.0 * (value - given) / half})
    return rows


def _equations(evidence: Evidence) -> dict[str, dict[str, Any]]:
    search = evidence.found.search
    best: Fitted = evidence.found.explanation.smallest
    sizes = np.maximum(search.sizes.sum(axis=1), 1.0)
    before, after = (np.sqrt(np.maximum(one.held_out.sum(axis=1), 0.0) / sizes)
                     for one in (search.nothing, best))
    return {EQUATIONS[e]: {'before': float(before[i]), 'after': float(after[i]),
                           'unit': evidence.servo.reads(UNITS[EQUATIONS[e]], EQUATIONS[e])}
            for i, e in enumerate(search.regression.equations)}


def _remains(evidence: Evidence, gap: dict[str, Any], status: str) -> str:
    if status == 'no_gap':
        share = round(100.0 * max(0.0, gap['refitted_solved']))
        return (f'Nothing that these recordings show. Values moved within their tolerances take '
                f'{share} % of the error above the noise from the simulation.')
    limits = evidence.found.samples.open_from
    left = [name for name, one in _equations(evidence).items() if one['after']**2 > limits(name)]
    text = f'{round(100.0 * max(0.0, 1.0 - gap["solved"]))} % of the error above the noise remains'
    return text + (f'; the equations of {", ".join(left)} are still off' if left else '') + '.'


def _unknown(evidence: Evidence, located: tuple[Located, ...]) -> dict[str, Any]:
    """Return what is known of a pattern without a name, or of a gap that follows none."""
    nothing = {'depends_on': [], 'parity': 'even', 'orders': [], 'memory': False, 'drift': False,
               'nearest': _nearest(evidence)}
    if not evidence.unnamed:
        return nothing
    one = evidence.unnamed[0].part
    variables, curve = list(one.mechanism.variables), one.curve
    detail = evidence.found.hypotheses[one.number].detail
    known = nothing | {
        'depends_on': variables, 'balance': str(detail.get('equation', '')),
        'parity': 'odd' if one.mechanism.symmetry == 'odd' else 'even',
        'memory': 'travel since reversal' in variables,
        'drift': bool({'time', 'temperature'} & set(variables))}
    if curve is not None:
        drawn = _drawn(evidence, evidence.unnamed[0], curve)
        known |= {'size': f'{curve.size():.2g} {drawn["y_unit"]}', 'curve': drawn}
    return known


def _nearest(evidence: Evidence, most: int = 3) -> list[dict[str, Any]]:
    """Return what predicts best of all that is no finding, where nothing was found."""
    if evidence.findings:
        return []
    several: dict[tuple[str, ...], dict[str, Any]] = {}
    for fit in evidence.found.search.singles:
        mechanism = evidence.found.hypotheses[fit.choice.numbers[0]].mechanism
        if mechanism.name != UNKNOWN:
            several.setdefault(mechanism.key, {'effect': mechanism.name, 'site': mechanism.site})
    return list(several.values())[:most]
