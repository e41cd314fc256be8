"""What the page says of each missing effect: how surely it is known, and with which values."""

from __future__ import annotations

from typing import Any

from ..answer.sizes import named
from .words import between, known, number, percent, shortened, spoken, unit

RUNGS = {
    'place': 'which part of the servo is off',
    'mechanism': 'on which variables it depends, with which symmetry and memory',
    'curve': 'its size over the variable, with a band',
    'law': 'a formula of the catalogue lies within the band',
}
"""How far an effect can be known, each rung with what it answers."""

NORMAL_95 = 1.96  # standard deviations to either side that hold 95 % of a normal deviate


def causes(which: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return one card for each effect in ``report.which``, in the order of accepting."""
    return [_cause(one) for one in which]


def _cause(one: dict[str, Any]) -> dict[str, Any]:
    mechanism, curve = one.get('mechanism') or {}, one.get('curve') or {}
    return {
        'effect': spoken(one.get('effect')), 'site': spoken(one.get('site')),
        'change': one.get('change') or '', 'rungs': _rungs(one),
        'mechanism': _mechanism(mechanism), 'law': _law(one),
        'curve': bool(curve.get('x') and curve.get('y')),
        **_axes(curve), 'points': bool((one.get('points') or {}).get('x')),
        'parameters': [_parameter(name, entry)
                       for name, entry in (one.get('parameters') or {}).items()],
        'predicted': _share(one.get('shrink_predicted')),
        'realised': _share(one.get('shrink_realised')),
        'of': 'the gap' if one.get('simulated', True) else 'the gap of its equation',
        'interval': between(one.get('interval')),
        'alternatives': _alternatives(one),
        'alone': {'alternatives', 'ambiguous_with'} <= set(one),
    }


def _rungs(one: dict[str, Any]) -> list[dict[str, Any]]:
    reached, confidence = one.get('rung'), one.get('confidence') or {}
    names = list(RUNGS)
    last = names.index(reached) if reached in names else -1
    return [{'name': name, 'meaning': meaning, 'reached': k <= last, 'last': k == last,
             'confidence': _share(confidence.get(name))}
            for k, (name, meaning) in enumerate(RUNGS.items())] if last >= 0 or confidence else []


def _share(value: object) -> str:
    return percent(value) if known(value) else ''


def _mechanism(mechanism: dict[str, Any]) -> str:
    said = []
    if mechanism.get('port'):
        said.append(spoken(mechanism['port']))
    if mechanism.get('variables'):
        said.append('depends on ' + ', '.join(spoken(v) for v in mechanism['variables']))
    if mechanism.get('symmetry') in ('odd', 'even'):
        said.append(f'{mechanism["symmetry"]} in the direction of motion')
    memory = mechanism.get('memory')
    if memory is not None:
        said.append(f'memory: {spoken(memory)}' if isinstance(memory, str) and memory
                    else 'with memory' if memory else 'without memory')
    return ('Mechanism: ' + '; '.join(said) + '.') if said else ''


def _law(one: dict[str, Any]) -> str:
    if one.get('law') is None or not one.get('curve'):
        return ''
    return ('The formula of the catalogue lies within the band.' if one['law'] else
            'The formula of the catalogue leaves the band: take the curve, not the formula.')


def _axes(curve: dict[str, Any]) -> dict[str, str]:
    """Return the words above a curve; the page puts the unit that its axis has for the height."""
    return {'height': unit(curve.get('y_unit')) or 'residual',
            'over': f'over {spoken(curve.get("variable")) or "the variable"}'}


def _parameter(name: str, entry: object) -> dict[str, Any]:
    entry = entry if isinstance(entry, dict) else {'value': entry}
    value, std = entry.get('value'), entry.get('std')
    factor, shown = shortened(entry.get('unit'), abs(value) if known(value) else 0.0)
    spread = ''
    if known(value) and known(std):
        half = NORMAL_95 * std
        spread = between(((value - half) / factor, (value + half) / factor), number)
    return {'name': named(name), 'value': number(value / factor if known(value) else value),
            'unit': shown, 'interval': spread or 'given'}


def _alternatives(one: dict[str, Any]) -> list[dict[str, Any]]:
    listed = [{'effect': spoken(other.get('effect')), 'site': spoken(other.get('site')),
               'confidence': _share(other.get('confidence')), 'tell': other.get('tell') or ''}
              for other in one.get('alternatives') or []]
    said = {other.get('effect') for other in one.get('alternatives') or []}
    return listed + [{'effect': spoken(name), 'site': '', 'confidence': '', 'tell': ''}
                     for name in one.get('ambiguous_with') or [] if name not in said]
