"""Writes docs/blind_check.md: the figures of a run, its misses, and what was learned from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date
import json
from math import isnan
from pathlib import Path
import re

from .case_outcome import Outcome, outcome_of
from .cases import Case
from .fault_tables import plans
from .scoring import Figure, figures, of_baseline

KINDS_OF_MISS = {
    'false alarm': 'a cause named where nothing is missing',
    'wrong cause': 'something named that is not there, first or beside the right one',
    'wrong side': 'the right effect on the wrong shaft',
    'incomplete': 'some of several causes named, nothing wrong',
    'called unknown': 'seen, but not named, though the catalogue has it',
    'unseen': 'no gap reported, from the smallest detectable severity up',
    'unknown passed over': 'an unknown cause explained away by known ones, or not seen',
    'misplaced': 'the right cause, blamed on another balance',
    'no answer': 'the diagnosis failed',
}
_METHOD = (
    '- **Cases.** *null*: nothing is withheld, the values of the rig lie anywhere within 90 % of '
    'the tolerances of the servo file. *single*: one fault at 0.5, 1, 2 or 4 times its smallest '
    'detectable severity. *removed*: the true cause is taken out of the catalogue. *foreign*: a '
    'fault that the catalogue never had. *pair*, *triple*: several at 2 or 4 times. In all but '
    'null cases the other values lie within 25 % of the tolerances. Each case has five families '
    'of excitation, their settings redrawn: two replicates to select, one to accept, one of '
    'other settings (a chirp for the multisine) to report.',
    '- **Smallest detectable severity**: found on the rig alone, without twin or diagnosis. In '
    'one signal of one family the rms of what the fault changes, less what tolerances could make '
    'up for, reaches three noise floors and 5 % of the signal. For an error of a value that has '
    'a tolerance: at least one and a half tolerances; for a delay, one and a half times what any '
    'recording leaves open, since a row has one time for all its channels '
    '(`blind_check/severity.py`, `severities.yaml`).',
    '- **Right** is a name of the fault in `blind_check/faults.yaml`, on its side; aliases stand '
    'there with their reason. *Unknown* is the status `unknown` or `partly_explained`. A failed '
    "diagnosis is a miss. Located: the balance of the verdict is one of the fault's.",
    '- **Baselines** (`blind_check/baselines.py`) work on the balances of the same bags, '
    'tolerances fitted inside their bounds first.', '')
_SPAN = re.compile(r'<!-- learned: (.+?) -->\n(.*?)<!-- end -->', re.DOTALL)


def miss_of(one: Outcome) -> str:
    """Return what kind of miss an outcome is, '' for none."""
    kind = one.case.kind
    if one.status == 'failed':
        return 'no answer'
    if kind == 'null':
        return 'false alarm' if one.named or one.says_unknown else ''
    if kind in ('removed', 'foreign'):
        return 'unknown passed over' if one.named or not one.says_unknown else ''
    faint = one.case.multiple < 1.0
    if one.false:
        truths = one.case.faults
        sides = all(any(n.effect in t.accepted for t in truths) for n in one.false)
        return 'wrong side' if sides else 'wrong cause'
    if not one.named:
        return '' if faint else 'called unknown' if one.says_unknown else 'unseen'
    if not one.exact:
        return 'incomplete'
    return '' if one.located else 'misplaced'


def write_page(path: Path, outcomes: Sequence[Outcome], folder: Path, plan: str, command: str,
               planned: int) -> None:
    """Write the page and its pictures; what was written on it about misses stays."""
    from .blind_check_plots import draw_confusion, draw_risk, draw_shrink

    learned = dict(_SPAN.findall(path.read_text('utf8'))) if path.is_file() else {}
    others = baselines_of([o.case for o in outcomes], folder)
    pictures = path.parent / 'pictures'
    draw_confusion(outcomes, pictures / 'blind_check_confusion.png')
    draw_risk(outcomes, others, pictures / 'blind_check_risk.png')
    draw_shrink(outcomes, pictures / 'blind_check_shrink.png')
    path.write_text('\n'.join([
        *_head(outcomes, plan, command, planned), *_written('run', learned),
        *_table(figures(outcomes)), *_comparison(outcomes, others), *_pictures(),
        *_misses(outcomes, learned)]) + '\n', 'utf8')


def baselines_of(cases: Sequence[Case], folder: Path) -> dict[str, list[Outcome]]:
    """Return the answers of the baselines to cases, by baseline."""
    found: dict[str, list[Outcome]] = {}
    for case in cases:
        answers = folder / case.name / 'baselines.json'
        if answers.is_file():
            for name, answer in json.loads(answers.read_text()).items():
                found.setdefault(name, []).append(of_baseline(case, answer))
    return found


def outcomes_in(cases: Sequence[Case], folder: Path) -> list[Outcome]:
    """Return the outcomes of the cases that have an answer."""
    return [one for case in cases if (one := outcome_of(case, folder / case.name))]


def _head(outcomes, plan, command, planned) -> list[str]:
    told = plans()[plan]
    seconds = [o.seconds for o in outcomes if o.seconds]
    counts = ', '.join(f'{sum(o.case.kind == kind for o in outcomes)} {kind}'
                       for kind in dict.fromkeys(o.case.kind for o in outcomes))
    part = '' if len(outcomes) == planned else (
        f' These are {len(outcomes)} of the {planned} cases of the plan, whose every beginning is '
        'a fair mix.')
    return [
        '# The blind check', '',
        'The emulated rig records with effects that the servo file lacks; the diagnosis is asked '
        'what is missing. The rig shares no law with the twin (docs/emulated_rig.md).', '',
        f'`{command}`, {date.today()}, seed {told["seed"]}, machines '
        f'{" and ".join(told["machines"])}; {counts}.{part}'
        + (f' A diagnosis took {sorted(seconds)[len(seconds) // 2]:.0f} s (median), on a machine '
           'that did other work as well.' if seconds else ''), '',
        *_METHOD]


def _table(found: Sequence[Figure]) -> list[str]:
    lines = ['## Figures', '', '| cases | figure | value | 90 % interval | n | goal | |',
             '|---|---|---|---|---|---|---|']
    for one in found:
        met = {None: '', True: 'met', False: '**missed**'}[one.met]
        interval = '' if isnan(one.low) else f'{100 * one.low:.0f} to {100 * one.high:.0f} %'
        lines.append(f'| {one.kind} | {one.name} | {_text(one)} | {interval} | {one.of} | '
                     f'{one.goal} | {met} |')
    return [*lines, '']


def _comparison(outcomes: Sequence[Outcome], others: Mapping[str, Sequence[Outcome]]) -> list[str]:
    if not others:
        return []
    wanted = ('false attributions', 'first choice right, from 1x up', 'names a wrong cause',
              'something wrong named beside or instead', 'exact set')
    columns = {'diagnosis': figures(outcomes)} | {n: figures(o) for n, o in others.items()}
    lines = ['## Beside it, on the same cases', '',
             '| cases | figure | ' + ' | '.join(columns) + ' |', '|---' * (len(columns) + 2) + '|']
    for at, one in enumerate(columns['diagnosis']):
        if one.name in wanted:
            lines.append(f'| {one.kind} | {one.name} | '
                         + ' | '.join(_text(found[at]) for found in columns.values()) + ' |')
    shrink = [_median([o.confidence for o in known if o.case.kind == 'single'
                       and o.case.multiple >= 1.0]) for known in others.values()]
    mine = _median([n.realised for o in outcomes if o.case.kind == 'single'
                    and o.case.multiple >= 1.0 for n in o.named[:1] if n.realised is not None])
    lines.append('| one effect | median shrink on report recordings | '
                 + ' | '.join([mine, *shrink]) + ' |')
    return [*lines, '',
            'The residual network names nothing, so that its attributions are never wrong and '
            'never right. The shrink of the diagnosis is of the re-simulated gap, that of the '
            'others of a balance: they are not the same measure.', '']


def _pictures() -> list[str]:
    return ['![what was named over what is true](pictures/blind_check_confusion.png)', '',
            '![risk over coverage](pictures/blind_check_risk.png)', '',
            '![realised over predicted shrink](pictures/blind_check_shrink.png)', '']


def _misses(outcomes: Sequence[Outcome], learned: Mapping[str, str]) -> list[str]:
    lines = ['## Misses', '']
    for kind, meaning in KINDS_OF_MISS.items():
        missed = [o for o in outcomes if miss_of(o) == kind]
        if not missed and kind not in learned:
            continue
        lines += [f'### {kind.capitalize()}: {meaning} ({len(missed)})', '',
                  *_written(kind, learned)]
        if missed:
            lines += ['| case | true | said | balance |', '|---|---|---|---|']
        for one in missed:
            truth = ', '.join(f'{t.fault} {t.multiple:g}x' for t in one.case.truths) or 'nothing'
            said = ', '.join(n.effect + (f' ({n.site})' if n.site else '')
                             for n in one.named) or one.sentence.replace('|', '/')[:120]
            lines.append(f'| {one.case.name} | {truth} | {one.status}: {said} | {one.balance} |')
        lines.append('')
    return lines


def _written(key: str, learned: Mapping[str, str]) -> list[str]:
    """Return the part of the page that people write: of the run, and of each kind of miss."""
    return [f'<!-- learned: {key} -->', learned.get(key, '').strip(), '<!-- end -->', '']


def _text(one: Figure) -> str:
    if isnan(one.value):
        return '-'
    return f'{100 * one.value:.0f} %' if one.share else f'{one.value:.2f}'


def _median(values: Sequence[float]) -> str:
    known = sorted(values)
    return f'{100 * known[len(known) // 2]:.0f} %' if known else '-'
