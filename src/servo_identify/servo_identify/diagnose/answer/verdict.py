"""From the evidence to a report: where, which, how far, and what follows from it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS, UNITS

from ..decisions import CALIBRATED, EVEN, OPEN, SOLVED
from ..handover.gap import Gap, shrink, shrink_interval
from ..mechanisms.hypothesis import UNKNOWN
from ..selection.choice import Fitted
from .closed_equations import acting, closed, closed_all
from .evidence import Evidence, named_in
from .left_over import left_over
from .missing_effect import drawn_curve, missing_effect
from .report import GapReport, Located, MissingEffect
from .row_instants import told_late
from .sentences import at_its_place, sentence
from .shown_in import by_recording, told
from .shown_units import channel_unit
from .telling import confirmations


def report_of(evidence: Evidence, following: dict[str, Any], warnings: list[str],
              timing: dict[str, float]) -> GapReport:
    """Put the evidence into a report."""
    located, squares = _where(evidence)
    named = {one.part.mechanism.key: named_in(evidence.found, evidence.halves, one)
             for one in (*evidence.findings, *evidence.doubtful)
             if one.part.mechanism.name != UNKNOWN}
    which = tuple(missing_effect(evidence, one) for one in evidence.named)
    balance = _place(evidence, located)
    gap = _gap(evidence) | {'equation_solved': closed(evidence, balance)}
    unknown = _unknown(evidence, located, balance)
    status = _status(evidence, which, gap, squares)
    late = told_late(evidence.found)
    rest = left_over(evidence) if status in ('unknown', 'partly_explained') else {}
    verdict = {'status': status, 'effects': [one.effect for one in which], 'balance': balance,
               'sentence': sentence(status, which, balance, gap, unknown, late, {
                   one.balance: one.gap_to_noise for one in located
                   if one.verdict != 'gap' and one.gap_to_noise > OPEN}, rest),
               'remains': _remains(evidence, gap, status), 'left_over': rest}
    split = evidence.split
    channels = _channels(evidence)
    return GapReport(
        servo=evidence.servo.name,
        recordings={p: [r.name for r in getattr(split, p)] for p in ('screen', 'accept',
                                                                       'report')},
        channels=channels, where=located, which=which, verdict=verdict, gap=gap,
        unknown=unknown if status in ('unknown', 'partly_explained') else {},
        next_experiment=following, warnings=tuple(dict.fromkeys(
            [*warnings, *([late] if late else []), *_doubts(evidence), *_worse(channels)])),
        moved=tuple(_moved(evidence)),
        stability={'splits': len(evidence.halves), 'named_in': {
            key[0]: round(share, 3) for key, share in named.items()}},
        equations=_equations(evidence), confirm=tuple(confirmations(which, evidence.servo)),
        timing=timing)


def _doubts(evidence: Evidence) -> Iterator[str]:
    """Say of each effect that is not told for its few halves how many name it."""
    for one in evidence.doubtful:
        share = named_in(evidence.found, evidence.halves, one)
        if share < EVEN:
            name = at_its_place(one.part.mechanism.name, one.part.mechanism.site)
            yield (f'{name.capitalize()} may act too: {round(100.0 * share)} % of the searches by '
                   'halves name it, too few to tell. More recordings would.')


def _where(evidence: Evidence) -> tuple[tuple[Located, ...], dict[str, float]]:
    """Return the equations with how far they are off, and their mean squares at the start."""
    search = evidence.found.search
    regression = search.regression
    errors, counts = search.nothing.held_out, regression.counts
    squares = {EQUATIONS[e]: float(errors[i].sum() / max(1, counts[i].sum()))
               for i, e in enumerate(regression.equations)}
    excess = {name: max(0.0, square - CALIBRATED) for name, square in squares.items()}
    total = sum(excess.values()) or 1.0
    shown = acting(evidence) if evidence.named or evidence.unnamed else set()
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
        gap = name in shown or squares[name] > search.open_from[i]
        located.append(Located(name, excess[name] / total if gap else 0.0,
                               float(np.sqrt(squares[name])), (float(low), float(high)),
                               'gap' if gap else 'at the noise floor', by_recording(search, i)))
    return tuple(located), squares


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
        if gap['solved'] >= SOLVED and not evidence.unnamed and closed_all(evidence):
            return 'explained'
        helps = max(gap['solved'], gap['refitted_solved'], *(
            one.shrink_realised for one in which)) > 0.0
        return 'partly_explained' if helps else 'unknown'
    limits = evidence.found.samples.open_from
    if evidence.unnamed or any(square > limits(name) for name, square in squares.items()):
        return 'unknown'
    return 'no_gap'


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
            'refitted_solved': shrink(given, gaps['refit']),
            'within_solved': shrink(given, gaps['within'])}


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
            given, value = servo.number(path), joint.values[path]
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
    if evidence.named and all(one.part.mechanism.outside for one in evidence.named):
        text = 'No simulation of the twin shows what is named; its equations do'
    return text + (f'; the equations of {", ".join(left)} are still off' if left else '') + '.'


def _unknown(evidence: Evidence, located: tuple[Located, ...], balance: str
             ) -> dict[str, Any]:
    """Return what is known of a pattern without a name, or of a gap that follows none."""
    nothing = {'depends_on': [], 'parity': 'even', 'orders': [], 'memory': False, 'drift': False,
               'nearest': _nearest(evidence), 'recordings': _shown(evidence, located, balance)}
    if not evidence.unnamed:
        return nothing
    one = evidence.unnamed[0].part
    variables, curve = list(one.mechanism.variables), one.curve
    detail = evidence.found.hypotheses[one.number].detail
    known = nothing | {
        'depends_on': variables, 'balance': str(detail.get('equation', '')),
        'parity': 'odd' if one.mechanism.symmetry == 'odd' else 'even',
        'held': any(each.part is one for each in evidence.handover.added) and not evidence.worse,
        'memory': 'travel since reversal' in variables,
        'drift': bool({'time', 'temperature'} & set(variables))}
    if curve is not None:
        drawn = drawn_curve(evidence, evidence.unnamed[0], curve)
        known |= {'size': f'{curve.size():.2g} {drawn["y_unit"]}', 'curve': drawn}
    return known


def _shown(evidence: Evidence, located: tuple[Located, ...], balance: str) -> str:
    """Return in which recordings the equation at fault is off, in words; '' where in all."""
    limit = np.sqrt(evidence.found.samples.open_from(balance)) if balance else np.inf
    return next((told(one.by_recording, limit) for one in located if one.balance == balance), '')


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
