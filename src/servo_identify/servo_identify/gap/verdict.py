"""From the evidence to a report: where, which, how far, and one sentence."""

from __future__ import annotations

import numpy as np

from .acceptance import leftover
from .answer import Cause, GapReport, Located
from .augmented import is_spring, spring_of
from .balance import BALANCES, UNITS
from .candidates import ALIASES, Candidate
from .completeness import Remainder
from .evidence import Evidence
from .resimulation import bootstrap, drawn, Gap, shrink
from .sentence import sentence
from .spring import NAME as SPRING_NAME
from .status import judged, squares_of


def report_of(evidence: Evidence, following: dict, warnings: list[str], clock: dict) -> GapReport:
    """Put the evidence of a diagnosis into a report."""
    found = judged(evidence)
    status, gaps = found.status, found.gaps
    which = _which(evidence)
    taken = [b for choice in evidence.choices for b in choice.balances]
    # a cause may show in one family alone, where no balance as a whole has a gap
    gaps = gaps or set(taken[:1])
    where = _where(evidence, gaps)
    balance = max(gaps, key=lambda name: found.squares[name], default='')
    gap = _gap(evidence)
    verdict = {'status': status, 'effects': [cause.name for cause in found.named],
               'balance': balance,
               'sentence': sentence(found, evidence, taken[0] if taken else balance,
                                    gap['shrink'])}
    explanation = evidence.best.explanation
    if explanation.at_bound:
        warnings = [*warnings, 'at the edge of its bounds, so not identified: '
                    + ', '.join(sorted(set(explanation.at_bound)))]
    if status == 'no_gap' and gaps:
        warnings = [*warnings, 'more than the noise of the sensors, but following no law: '
                    + ', '.join(sorted(gaps))]
    parts = evidence.split
    return GapReport(
        servo=evidence.servo.name,
        recordings={p: [r.name for r in getattr(parts, p)]
                    for p in ('screen', 'accept', 'report')},
        channels=_channels(evidence), where=tuple(where), which=tuple(which), verdict=verdict,
        gap=gap, unknown=_unknown(found.worst),
        next_experiment=following, warnings=tuple(dict.fromkeys(warnings)),
        by_family=_by_family(evidence), waterfall=_waterfall(evidence), timing=clock)


def _where(evidence: Evidence, gaps: set[str]) -> list[Located]:
    stack = evidence.stacks['report']
    residual = leftover(stack, evidence.base.explanation)
    shown = stack.showing(residual) if gaps else {}
    squares_of_shown = {b: float(np.mean(residual[rows]**2)) for b, rows in shown.items()}
    excess = {b: max(0.0, square - 1.0)
              for b, square in (squares_of(stack, residual) | squares_of_shown).items()}
    total = sum(excess.values()) or 1.0
    chance = np.random.default_rng(0)
    located = []
    for name in (*BALANCES, 'sensor'):
        rows = stack.balance == (BALANCES.index(name) if name in BALANCES else -1)
        if not rows.any():
            located.append(Located(name, 0.0, 0.0, (0.0, 0.0), 'not observable'))
            continue
        noise = np.array([stack.noise[n, name] for n in range(len(stack.balances))
                          if (n, name) in stack.noise])
        floor = float(np.sqrt(np.mean(noise**2))) or 1.0
        squares = (residual[rows] * stack.scale[rows] / np.hypot(floor, stack.doubt[rows]))**2
        blocks, inverse = np.unique(stack.block[rows], return_inverse=True)
        sums, counts = np.bincount(inverse, squares), np.bincount(inverse)
        draws = chance.integers(0, len(blocks), (300, len(blocks)))
        ratios = np.sqrt(sums[draws].sum(axis=1) / counts[draws].sum(axis=1))
        located.append(Located(
            name, excess[name] / total, float(np.sqrt(squares.mean())),
            (float(np.percentile(ratios, 5)), float(np.percentile(ratios, 95))),
            'gap' if name in gaps else 'at the noise floor'))
    return located


def _which(evidence: Evidence) -> list[Cause]:
    first = {p: evidence.base.gap if p == 'accept' else evidence.reported['base']
             for p in ('accept', 'report')}
    last = {p: evidence.best.gap if p == 'accept' else evidence.reported['best']
            for p in ('accept', 'report')}
    causes = []
    for choice, step in zip(evidence.choices, evidence.reported['steps'], strict=True):
        share = {}
        for purpose in ('accept', 'report'):
            alone = shrink(first[purpose], step[purpose]['alone'])
            without = shrink(first[purpose], step[purpose]['rest'])
            share[purpose] = 0.5 * (alone + shrink(first[purpose], last[purpose]) - without)
        # what was predicted hangs on the recordings that happened to be, and what came of it too
        scatter = (drawn(first['report'], step['report']['alone'], seed=0)
                   - drawn(first['accept'], step['accept']['alone'], seed=1))
        low, high = share['report'] + np.percentile(scatter, (5, 95))
        candidate = choice.candidate
        alike = [other.name for other in choice.ambiguous]
        if candidate.name in ALIASES and not is_spring(candidate):
            alike.append(ALIASES[candidate.name])
        if candidate.name == 'payload_resonance' and _may_hide_a_spring(evidence):
            alike.append(SPRING_NAME)
        causes.append(Cause(candidate.name, candidate.site or _site(candidate),
                            _parameters(evidence, candidate), share['accept'], share['report'],
                            (float(low), float(min(high, 1.0))), tuple(dict.fromkeys(alike))))
    return causes


def _may_hide_a_spring(evidence: Evidence) -> bool:
    """Tell whether a spring of a rigid twin would show as a payload only: one encoder."""
    seen = {name for one in evidence.stacks['screen'].balances for name in one.names}
    return not evidence.servo.mechanism.compliant and 'transmission' not in seen


def _site(candidate: Candidate) -> str:
    path = candidate.paths[0]
    if path == 'drive.torque_constant':
        return 'motor'  # the drive balance does not know it
    if path.startswith(('drive.', 'controller.')):
        return path.partition('.')[0]
    return 'motor' if 'rotor' in path else 'load' if 'load' in path else 'mesh'


def _parameters(evidence: Evidence, candidate: Candidate) -> dict[str, dict]:
    extended = evidence.stacks['screen'].extended
    explanation = evidence.best.explanation
    if is_spring(candidate):
        return {path.rpartition('.')[2]: value
                for path, value in spring_of(evidence.servo, explanation).items()}
    found = {}
    for path, element in zip(candidate.paths, candidate.elements, strict=True):
        leaf = path.rpartition('.')[2]
        if candidate.switch is not None and path in evidence.servo.values:
            leaf = path.removeprefix('effects.')
        row = extended.declaration(path).row
        found[f'{leaf}[{element}]' if row else leaf] = {
            'value': float(explanation.theta[extended.slot(path, element)]),
            'std': explanation.spread(path, element), 'unit': extended.servo.unit(path)}
    for path, _ in candidate.shapes:
        found[path.rpartition('.')[2]] = {
            'value': float(explanation.theta[extended.slot(path)]),
            'std': explanation.spread(path), 'unit': extended.servo.unit(path)}
    return found


def _gap(evidence: Evidence) -> dict:
    before, after = evidence.reported['base'], evidence.reported['best']
    low, high = bootstrap(before, after)
    given = evidence.reported['given']
    floor = float(np.sqrt(np.mean([(before.floor[c] / before.signal[c])**2
                                   for c in before.squares])))
    return {'before': before.total(before, excess=False), 'floor': floor,
            'after': after.total(before, excess=False), 'shrink': shrink(before, after),
            'interval': (low, high), 'as_given': given.total(before, excess=False),
            'unit': 'share of the signal, root mean square over channels'}


def _channels(evidence: Evidence) -> dict[str, dict]:
    given = evidence.reported['given']
    linear = evidence.servo.linear
    units = {'motor_position': 'm' if linear else 'rad', 'load_position': 'm' if linear else 'rad',
             'torque': 'N' if linear else 'N m', 'current': 'A',
             'wind_up': 'm' if linear else 'rad', 'command': 'V'}
    return {channel: {
        'unit': units[channel], 'rms_gap': given.rms(channel), 'noise_floor': given.floor[channel],
        'fit': 1.0 - given.rms(channel) / given.signal[channel],
        'rms_after': evidence.reported['best'].rms(channel)} for channel in given.squares}


def _by_family(evidence: Evidence) -> dict:
    """Shrink by excitation family and channel on the report recordings."""
    from .acceptance import run_over
    answer: dict[str, dict] = {}
    balances = evidence.stacks['report'].balances
    for one in balances:
        before = run_over(evidence.base.explanation, [one])
        after = run_over(evidence.best.explanation, [one])
        family = one.seen.recording.family or one.seen.recording.name
        low, high = bootstrap(before, after, draws=150)
        channels = {c: 1.0 - after.excess(c) / before.excess(c) if before.excess(c) > 0 else 0.0
                    for c in before.squares}
        answer[family] = {'shrink': shrink(before, after), 'interval': (low, high),
                          'channels': channels}
    return answer


def _waterfall(evidence: Evidence) -> list[dict]:
    given, base = evidence.reported['given'], evidence.reported['base']
    bars = [{'step': 'as given', 'gap': given.total(base, excess=False)},
            {'step': 'values within tolerance', 'gap': base.total(base, excess=False)}]
    for choice, step in zip(evidence.choices, evidence.reported['steps'], strict=True):
        gap: Gap = step['report']['upto']
        bars.append({'step': choice.candidate.label, 'gap': gap.total(base, excess=False)})
    return bars


def _unknown(left: Remainder | None) -> dict:
    if left is None:
        return {'depends_on': [], 'parity': 'even', 'orders': [], 'memory': False, 'drift': False}
    return {'depends_on': list(left.depends_on), 'parity': left.parity,
            'orders': list(left.orders), 'memory': left.memory, 'drift': left.drift,
            'balance': left.balance, 'unit': UNITS[left.balance]}
