"""The page of a diagnosis: where, which, how far and what stayed open, to be read in a minute."""

from __future__ import annotations

from importlib.resources import files
from math import isfinite
from pathlib import Path

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
import numpy as np

from servo_twin.pages.svg_charts import line_chart

from . import page_charts as charts
from .answer import GapReport
from .balance import BALANCES
from .diagnose import Diagnosis
from .evidence import Evidence
from .page_laws import laws, unexplained
from .page_seconds import Seconds, steps, telling_seconds
from .resimulation import HORIZON
from .sentence import next_step

STATUS = {'no_gap': 'no gap', 'explained': 'gap explained',
          'partly_explained': 'gap explained in part', 'unknown': 'gap of unknown cause'}
PURPOSES = {'screen': 'selected the causes', 'accept': 'had to confirm them',
            'report': 'measured the shrink'}
_CURVES = {'flexible': 'The curve is that of a flexible regressor.',
           'median': 'The curve is the median of what is left.',
           '': 'It follows none of the variables that were measured.'}


def write_page(diagnosis: Diagnosis, path: Path | str) -> Path:
    """Write the page of a diagnosis and return its path."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page_of(diagnosis), 'utf8')
    return path


def page_of(diagnosis: Diagnosis) -> str:
    """Return the page as HTML that refers to nothing outside itself."""
    report, evidence = diagnosis.report, diagnosis.evidence
    status = report.verdict['status']
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    template = environment.from_string(files(__package__).joinpath('page.html').read_text('utf8'))
    return template.render(
        report=report, status=STATUS[status], style=Markup(_style()), facts=_facts(report),
        chain=Markup(charts.chain(report.where, report.verdict['balance'],
                                  _seats(report, evidence))),
        causes=report.which, seconds=_seconds(telling_seconds(evidence), bool(report.which)),
        better='augmented twin' if report.which else 'twin within its tolerances',
        horizon=f'{HORIZON:g}', pictures=_pictures(report, evidence),
        waterfall=Markup(charts.waterfall(steps(evidence, report.waterfall),
                                          report.gap['floor'])),
        shrink=_shrink(report), heat=_heat(report), nothing=_nothing(status),
        ambiguous=_ambiguous(report, evidence.servo.linear),
        unknown=_unknown(report, evidence), remainders=_remainders(evidence),
        purposes=[(f'{name}: {PURPOSES[name]}', names)
                  for name, names in report.recordings.items()],
        telling=_telling, value=_value, per_cent=_per_cent, between=_between, short=_short)


def _style() -> str:
    """Return the style sheet of the page of a recording, so that the two look alike."""
    page = files('servo_twin.pages').joinpath('replay_page.html').read_text('utf8')
    return page.partition('<style>')[2].partition('</style>')[0]


def _facts(report: GapReport) -> dict[str, str]:
    gap = report.gap
    facts = {'servo': report.servo}
    if gap['as_given'] > 0.0:
        facts['gap as given'] = f'{charts.percent(gap["as_given"])} of the signal'
        facts['within tolerances'] = charts.percent(gap['before'])
        if report.which:
            facts['augmented'] = charts.percent(gap['after'])
        facts['noise'] = charts.percent(gap['floor'])
    if report.which:
        facts['shrink'] = _shrink(report)
    return facts


def _shrink(report: GapReport) -> str:
    return f'{_per_cent(report.gap["shrink"])} ({_between(report.gap["interval"])})'


def _seats(report: GapReport, evidence: Evidence) -> list[tuple[str, str]]:
    seats = []
    for cause, choice in zip(report.which, evidence.choices, strict=True):
        effect = choice.candidate.effect
        port = effect.port if effect is not None else ''
        seat = port if port in ('drive', 'sensor') else charts.SITES.get(cause.site, 'sensor')
        seats.append((cause.effect, seat))
    return seats


def _seconds(shown: Seconds | None, augmented: bool) -> dict | None:
    if shown is None:
        return None
    names = ('twin', 'augmented')
    channel = shown.channel.replace('_', ' ')
    speed = channel.replace('position', 'speed')
    curves = {n: shown.curves[n] for n in ('rig', *names)}
    errors = {n: shown.errors[n] for n in names}
    rms = {n: float(np.sqrt(np.nanmean(e**2))) for n, e in errors.items()}
    said = ' → '.join(f'{r:.3g}' for r in rms.values())
    return {
        'shown': speed, 'wrong': f'error of the {channel}', 'recording': shown.recording,
        'family': shown.family.replace('_', ' '), 'rms': f'{said} {shown.error_unit}',
        'why': 'where the augmented twin gains most' if augmented else 'where it departs most',
        'curves': Markup(line_chart(shown.time, curves, shown.unit, 250)),
        'errors': Markup(line_chart(shown.time, errors, shown.error_unit, 170, shown.noise))}


def _pictures(report: GapReport, evidence: Evidence) -> list[dict]:
    shown, found = [], laws(evidence)
    for law in found:
        note = 'Two curves: forward and backward. ' if len(law.curves) > 1 else ''
        note += ('Most of this effect lies within what tolerances could explain as well; shown '
                 'is what they cannot.' if law.bounded else '')
        shown.append({'title': law.title, 'balance': law.balance, 'note': note,
                      'chart': Markup(charts.scatter(law, 520 if len(found) > 1 else 900))})
    if not shown:
        worst = max(report.where, key=lambda one: one.gap_to_noise)
        law = unexplained(evidence, report.verdict['balance'] or worst.balance)
        if law is not None:
            note = _CURVES[next(iter(law.curves), '')]
            shown.append({'title': law.title, 'balance': law.balance, 'note': note,
                          'chart': Markup(charts.scatter(law, 900))})
    return shown


def _heat(report: GapReport) -> dict:
    shrinks = [one['channels'] for one in report.by_family.values()]
    channels = [c for c in dict.fromkeys(c for one in shrinks for c in one)
                if any(_has_gap(one.get(c, 0.0)) for one in shrinks)]
    rows = []
    for family, one in report.by_family.items():
        cells = [_cell(one['channels'].get(c, 0.0)) for c in channels]
        cells.append({**_cell(one['shrink']), 'interval': _between(one['interval'])
                      if one['shrink'] else ''})
        rows.append({'family': family.replace('_', ' '), 'cells': cells})
    return {'channels': channels, 'rows': rows}


def _has_gap(shrink: float) -> bool:
    return isfinite(shrink) and abs(shrink) >= 1e-6


def _cell(shrink: float) -> dict:
    if not _has_gap(shrink):
        return {'said': '–', 'style': '', 'interval': ''}
    strength = min(70.0, 70.0 * abs(shrink))
    tone = 'augmented' if shrink > 0.0 else 'far'
    return {'said': _per_cent(shrink), 'interval': '',
            'style': f'background: color-mix(in srgb, var(--{tone}) {strength:.0f}%, transparent)'}


def _ambiguous(report: GapReport, linear: bool) -> list[str]:
    lines = [f'{c.effect} at {c.site}: these recordings cannot tell it from '
             f'{", ".join(c.ambiguous_with)}.' for c in report.which if c.ambiguous_with]
    if report.next_experiment:
        lines.append(next_step(report.next_experiment, linear))
    if report.which and not lines:
        lines.append('Every accepted effect stands alone: no other one does as well on these '
                     'recordings.')
    return [line.replace('_', ' ') for line in lines]


def _unknown(report: GapReport, evidence: Evidence) -> dict:
    unknown = report.unknown
    balance = unknown.get('balance', '')
    if not balance:
        return {'lines': [], 'chart': '', 'title': ''}
    lines = []
    if unknown['depends_on']:
        lines.append(f'in the {balance} balance, over {", ".join(unknown["depends_on"])}')
        lines.append(f'{unknown["parity"]} in the direction of motion')
    else:
        lines.append(f'in the {balance} balance, over nothing that was measured')
    if unknown['orders']:
        lines.append('periodic, orders ' + ', '.join(f'{o:g}' for o in unknown['orders'])
                     + ' of the turn')
    lines += [said for name, said in (
        ('memory', 'with memory of the last reversal'),
        ('drift', 'drifting with time or temperature')) if unknown[name]]
    law = unexplained(evidence, balance) if evidence.choices else None
    chart = Markup(charts.scatter(law)) if law is not None else ''
    return {'lines': lines, 'chart': chart, 'title': law.title if law is not None else ''}


def _remainders(evidence: Evidence) -> list[dict]:
    stack, rows = evidence.stacks['screen'], []
    described = {left.balance: left for left in evidence.remainders}
    for index in np.unique(stack.balance):
        mine, name = stack.balance == index, BALANCES[index]
        before, after = (float(np.mean(r[mine]**2)) for r in (evidence.start, evidence.left))
        left, share = described.get(name), 0.0
        if left is not None and after > 1.0:
            share = min(1.0, left.predictable / after)
        rows.append({
            'balance': name, 'before': np.sqrt(before), 'left': np.sqrt(after),
            'predictable': f'{100.0 * share:.0f} %' if left is not None and after > 1.0
            else 'at the floor',
            'by': ', '.join(left.depends_on[:2]) if share > 0.1 else ''})
    return rows


def _nothing(status: str) -> str:
    return ('Nothing: no effect is needed within the tolerances of the servo file.'
            if status == 'no_gap' else
            'No effect of the catalogue stood on recordings that had not selected it.')


def _telling(parameters: dict[str, dict]) -> dict[str, dict]:
    """Leave out the numbers of a row that do not differ from zero, unless none does."""
    kept = {name: entry for name, entry in parameters.items()
            if '[' not in name or not abs(entry['value']) < 2.0 * entry['std']}
    return kept or parameters


def _value(entry: dict) -> str:
    std = entry['std']
    if std is None or not isfinite(std):
        return f'{entry["value"]:.4g} (given)'
    if std > 10.0 * abs(entry['value']):
        return 'not identified'
    return f'{entry["value"]:.4g} ± {std:.2g}'


def _per_cent(share: float) -> str:
    return f'{round(100.0 * share):d} %'


def _between(interval: tuple[float, float]) -> str:
    return f'{round(100.0 * interval[0]):d} to {round(100.0 * interval[1]):d} %'


def _short(value: float) -> str:
    return f'{value:.3g}' if value is not None and isfinite(value) else '–'
