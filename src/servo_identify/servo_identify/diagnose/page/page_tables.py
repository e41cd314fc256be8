"""The tables of the page, ready to be laid out: how far, which values, by which recordings."""

from __future__ import annotations

from typing import Any

from .words import between, known, number, percent, ratio, shortened, spoken, unit

GIVEN = (('twin as given', 'as_given', 'twin'),
         ('values within tolerance', 'within_tolerance', 'left'))
ADDED = (*GIVEN, ('augmented twin', 'after', 'augmented'),
         ('augmented, refitted', 'refitted', 'left'))
REFITTED = (*GIVEN, ('values refitted', 'refitted', 'left'))
"""Stages of a twin to which something is added, and of one to which nothing is: their fields of
``report.gap``, and the colours of their bars."""

COLUMNS = {'given': 'as given', 'within': 'within tolerance', 'after': 'augmented',
           'noise': 'noise', 'fit': 'fit as given'}
PURPOSES = {'screen': 'selected the effects', 'accept': 'had to confirm them',
            'report': 'measured what is gone'}
SEVERITY = ('red', 'amber', 'green')
WRITTEN = 12  # values up to which a number fits into each cell of the heat map
FEW = 7  # values whose correlations can be read on a phone, and beside another table


def gap_bars(gap: dict[str, Any], added: bool) -> list[dict[str, Any]]:
    """Return the gap of each stage as {step, said, width [%], tone}, the noise floor last."""
    values = {'as_given': gap.get('before'), **{k: v for k, v in gap.items() if v is not None}}
    if 'within_tolerance' not in gap:
        values['within_tolerance'] = gap.get('before')
    wanted = (*(ADDED if added else REFITTED), ('noise floor', 'floor', 'fine'))
    steps = [(step, value, tone) for step, key, tone in wanted
             if known(value := values.get(key))]
    most = max((abs(value) for _, value, _ in steps), default=0.0) or 1.0
    return [{'step': step, 'said': percent(value, 3), 'tone': tone,
             'width': f'{max(0.4, 100.0 * abs(value) / most):.1f}'}
            for step, value, tone in steps]


def channel_table(channels: dict[str, Any], added: bool) -> dict[str, Any] | None:
    """Return {columns, rows}: the error of each channel (RMS) by stage of the twin."""
    errors = {name: _errors(one, added) for name, one in channels.items()}
    kept = [key for key in COLUMNS
            if any(known(one.get(key)) for one in (*errors.values(), *_fits(channels)))]
    if not kept:
        return None
    rows = []
    for name, one in errors.items():
        factor, shown = shortened(channels[name].get('unit'),
                                  max((v for v in one.values() if known(v)), default=0.0))
        cells = {key: number(value / factor if known(value) else None, 3)
                 for key, value in one.items()}
        cells['fit'] = percent(channels[name].get('fit'), 3)
        rows.append({'name': spoken(name), 'unit': shown, 'gone': _gone(one),
                     'cells': [(key, cells[key]) for key in kept]})
    return {'columns': [(key, COLUMNS[key]) for key in kept], 'rows': rows}


def _fits(channels: dict[str, Any]) -> list[dict[str, Any]]:
    return [{'fit': one.get('fit')} for one in channels.values()]


def _errors(one: dict[str, Any], added: bool) -> dict[str, Any]:
    return {'given': one.get('as_given', one.get('rms_gap')),
            'within': one.get('within_tolerance'),
            'after': one.get('augmented', one.get('rms_after')) if added else None,
            'noise': one.get('noise_floor')}


def _gone(errors: dict[str, Any]) -> str:
    given, after = errors['given'], errors['after']
    if known(given) and known(after) and 0.0 < after < 0.95 * given:
        return f'{number(given / after, 2)} times less'
    return ''


def moved_rows(moved: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return old and new value, bounds and sigma; ``marks`` are places between the bounds in %."""
    rows = []
    for one in moved:
        given, found, low, high = (one.get(k) for k in ('given', 'found', 'low', 'high'))
        marks = None
        if (known(given) and known(found) and known(low) and known(high)) and high > low:
            marks = {name: f'{min(100.0, max(0.0, 100.0 * (v - low) / (high - low))):.1f}'
                     for name, v in (('given', given), ('found', found))}
        change = (f'{100.0 * (found / given - 1.0):+.1f} %'.replace('-', '−')
                  if known(given) and known(found) and given else '')
        rows.append({'path': one.get('path', ''), 'given': number(given), 'found': number(found),
                     'change': change, 'bounds': between((low, high), number),
                     'sigma': number(one.get('sigma'), 2), 'unit': unit(one.get('unit')),
                     'marks': marks,
                     'at_bound': marks is not None and marks['found'] in ('0.0', '100.0')})
    return rows


def heat_map(correlations: dict[str, Any]) -> dict[str, Any] | None:
    """Return rows of cells {said, share [%], sign, title}, or nothing for less than two values."""
    names, matrix = correlations.get('names') or [], correlations.get('matrix') or []
    if len(names) < 2:
        return None
    rows = []
    for k, (name, values) in enumerate(zip(names, matrix, strict=False), 1):
        cells = [{'said': _share(v),
                  'share': f'{min(80.0, 80.0 * abs(v)):.0f}' if known(v) else '0',
                  'sign': 'rig' if known(v) and v >= 0 else 'twin',
                  'title': f'{name} and {other}'}
                 for other, v in zip(names, values, strict=False)]
        rows.append({'index': k, 'name': name, 'cells': cells})
    return {'rows': rows, 'written': len(names) <= WRITTEN, 'many': len(names) > FEW,
            'strongest': _strongest(names, matrix)}


def _share(value: object) -> str:
    if not known(value):
        return ''
    return f'{round(value, 2) + 0.0:.2f}'.replace('-', '−')


def _strongest(names: list[str], matrix: list[list[Any]]) -> str:
    pairs = [(abs(row[j]), row[j], names[i], names[j]) for i, row in enumerate(matrix)
             for j in range(min(i, len(row))) if known(row[j])]
    if not pairs:
        return ''
    _, value, one, other = max(pairs)
    return f'{other} and {one}: {_share(value)}'


def equation_rows(equations: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the residual of each equation (RMS, over its noise) before and after."""
    return [{'name': spoken(name), 'before': ratio(one.get('before')),
             'after': ratio(one.get('after'))} for name, one in equations.items()]


def recording_rows(recordings: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the names of the recordings by what they were used for."""
    return [{'purpose': purpose, 'use': PURPOSES.get(purpose, ''), 'names': names}
            for purpose, names in recordings.items() if names]


def timing_rows(timing: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the stages of the diagnosis with seconds and the share of the longest in %."""
    rows = {stage: seconds for stage, seconds in timing.items() if known(seconds)}
    most = max(rows.values(), default=0.0) or 1.0
    return [{'stage': spoken(stage), 'said': f'{number(seconds, 3)} s',
             'width': f'{100.0 * seconds / most:.1f}'} for stage, seconds in rows.items()]


def default_rows(defaults: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the values that the servo file did not give."""
    return [{'path': one.get('path', ''), 'unit': unit(one.get('unit')),
             'value': number(one['value']) if known(one.get('value'))
             else spoken(one.get('value'))} for one in defaults]


def sorted_findings(findings: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the findings of the check, the gravest first."""
    said = [{'level': one.get('level') if one.get('level') in SEVERITY else 'amber',
             'sentence': one.get('sentence') or '', 'action': one.get('action') or ''}
            for one in findings]
    return sorted(said, key=lambda one: SEVERITY.index(one['level']))


def made_by(facts: dict[str, Any]) -> dict[str, Any] | None:
    """Return command, version, date and the hashes of the inputs, each empty where not said."""
    said = {key: facts.get(key) or '' for key in ('command', 'version', 'date')}
    said['inputs'] = facts.get('inputs') or {}
    return said if any(said.values()) else None


def experiment(chosen: dict[str, Any]) -> dict[str, Any] | None:
    """Return what the next recording separates, how to make it, and what it will show."""
    if not any(chosen.get(key) for key in ('separates', 'family', 'command', 'measure')):
        return None
    measure = chosen.get('measure') or {}
    if not isinstance(measure, dict):
        measure = {'parameter': measure}
    values = measure.get('values') or {}
    return {
        'separates': [spoken(name) for name in chosen.get('separates') or []],
        'family': spoken(chosen.get('family')), 'command': chosen.get('command') or '',
        'settings': [(spoken(name), number(value) if known(value) else spoken(value))
                     for name, value in (chosen.get('settings') or {}).items()],
        'expected': [(spoken(name), sentence)
                     for name, sentence in (chosen.get('expected') or {}).items()],
        'measure': measure.get('parameter') or '',
        'values': [(spoken(cause), f'{number(value)} {unit(measure.get("unit"))}'.strip())
                   for cause, value in values.items()],
    }


def unknown_lines(unknown: dict[str, Any]) -> list[str]:
    """Say on what the part that stays open depends."""
    lines = []
    if unknown.get('balance'):
        lines.append(f'It lies in the {spoken(unknown["balance"])} equation.')
    if unknown.get('depends_on'):
        lines.append('It follows ' + ', '.join(spoken(v) for v in unknown['depends_on']) + '.')
    if unknown.get('parity'):
        lines.append(f'It is {spoken(unknown["parity"])} in the direction of motion.')
    if unknown.get('orders'):
        lines.append('It repeats ' + ', '.join(number(order) for order in unknown['orders'])
                     + ' times a revolution.')
    lines += [said for key, said in (('memory', 'It remembers the last reversal.'),
                                     ('drift', 'It drifts with time or temperature.'))
              if unknown.get(key)]
    return lines
