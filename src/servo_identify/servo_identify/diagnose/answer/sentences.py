"""The verdict as a person is told it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import floor, hypot, isfinite, log10, pi
from typing import Any

from ..decisions import EVEN, SOLVED, WORTH
from ..mechanisms.hypothesis import BY_RECORDING, EXTERNAL
from .report import Alternative, MissingEffect

PLACES = {
    'drive': 'drive', 'motor': 'motor-side torque balance', 'transmission': 'transmission',
    'load': 'load-side torque balance', 'torque': 'torque balance of motor and load',
    'controller': 'controller'}
SITES = {'motor': 'motor shaft', 'load': 'load shaft', 'mesh': 'transmission',
         'command': 'command', 'drive': 'drive', 'controller': 'controller',
         'torque': 'torque sensor'}
SHOWS = {'motor': ('motor', 'torque'), 'load': ('load', 'torque'), 'mesh': ('transmission',),
         'command': ('drive',), 'drive': ('drive',), 'current': ('drive',),
         'controller': ('controller',)}
"""In which balances an effect at a site shows of itself."""

UNHELD = ('friction', 'sensor')
"""Ports at which what differs by recording is no matter of one value of the file for each."""

WORDS = {'load': 'torque of the load', 'angle': 'angle of the shaft'}
"""Variables of a pattern that a reader may take for something else."""

SURE = 1.645
"""Standard deviations of a 90 % interval."""

TOLD = 3  # values of one effect in a sentence
STRAIGHT = 'straight'  # a shaft that does not turn

VALUES = {'stiffness_error': 'stiffness', 'torque_constant_error': 'torque constant',
          'controller_mismatch': 'setting of the controller'}
"""Effects that are another value of the servo file, with the value."""


def sentence(status: str, which: Sequence[MissingEffect], balance: str, gap: dict[str, Any],
             unknown: dict[str, Any], late: str = '') -> str:
    """
    Return the verdict in a few sentences: place, effect, size, confidence, what remains.

    ``late`` says that the command acts after its row; without any gap that is part of the answer.
    """
    place = PLACES.get(balance, balance)
    if status == 'no_gap':
        text = ('No gap: within its tolerances the twin matches the rig, down to the noise floor '
                'and the practical margin.')
        return f'{text} But {late}.' if late else text
    if not which:
        text = f'The {place} does not match the rig, and no effect of the list explains it.'
        if unknown.get('depends_on'):
            over = ' and '.join(WORDS.get(one, one) for one in unknown['depends_on'])
            text += (f' What is missing depends on the {over} and is {unknown["parity"]} in the '
                     'direction of motion.')
            if unknown.get('size'):
                text += f' Its size is {unknown["size"]}.'
        text += unknown.get('recordings', '')
        if unknown.get('nearest'):
            several = [spoken(one['effect']) for one in unknown['nearest']]
            text += (f' {_listed(several).capitalize()} would come nearest, but no nearer than '
                     'chance does on so few data.')
        return text
    # what shows most in a balance may act at another place
    if not all(balance in SHOWS.get(one.site, (balance,)) for one in which):
        place = 'twin'
    several = [f'{_named(one)} ({one.change})' if one.change else _named(one) for one in which]
    first = which[0]
    several_at = Counter(one.effect for one in first.alternatives)
    others = [f'the same at the {SITES.get(one.site, one.site)}' if one.effect == first.effect
              else _named(one) if several_at[one.effect] > 1 else spoken(one.effect)
              for one in first.alternatives]
    unsure = first.rung == 'place' and others
    if unsure:  # the place is known, the recordings do not tell what acts there
        several[0] += ', or perhaps ' + _listed(others, 'or')
    lacks, differs = ([text for one, text in zip(which, several, strict=True)
                       if _is_value(one.effect) == value] for value in (False, True))
    said = [f'is missing {_listed(lacks)}'] if lacks else []
    said += [f'has {_listed(differs)} than the servo file'] if differs else []
    text = f'The {place} {_listed(said)}.'
    gone = round(100.0 * gap['shrink'])
    it = 'it' if len(which) == 1 else 'them'
    it = f'Adding {it}' if lacks else f'Taking {it} over'
    apart = [one for one in which if _remedy(one)]
    if len(apart) == len(which):
        if all(one.effect == EXTERNAL or one.mechanism['port'] in UNHELD for one in which):
            text += f' No effect of a twin can hold {"it" if len(which) == 1 else "them"}.'
    elif gone > 0:
        text += f' {it} removes {gone} % of the error on unseen recordings.'
    else:
        text += (f' {it} alone does not reduce the error of the simulation on unseen recordings: '
                 'the servo file stays as given.')
    text += ''.join(f' {remedy}' for remedy in dict.fromkeys(map(_remedy, apart)))
    least = min(which, key=lambda one: one.confidence['mechanism'])
    text += f' Confidence: {round(100.0 * least.confidence["mechanism"])} %.'
    if least.named_in < EVEN:  # what else could stand there is said below
        whose = '' if len(which) == 1 else f' {spoken(least.effect)}'
        text += (f' Searched by halves, {round(100.0 * least.named_in)} % of them name'
                 f'{whose or " it"}: more recordings would make it surer.')
    if unsure:
        text += ' These recordings do not tell which.'
    elif others:
        text += f' These recordings do not exclude {_listed(others, "or")}.'
    if status != 'explained' and len(apart) < len(which):
        refitted = gap.get('refitted_solved', 0.0)
        left = f'{round(100.0 * (1.0 - gap["solved"]))} %'
        if gone <= 0 and refitted - gap['solved'] > WORTH:
            text += (' With other values moved within their tolerances as well, '
                     f'{round(100.0 * refitted)} % is removed (--refit).')
        elif refitted >= SOLVED > gap['solved']:
            text += (f' The other {left} is within the tolerances of the servo file: where its '
                     f'values move too, {round(100.0 * refitted)} % is removed (--refit).')
        else:
            text += f' {left} of the error remains.'
            if refitted - gap['solved'] > WORTH:
                text += (f' Moving other values within their tolerances as well would remove '
                         f'{round(100.0 * refitted)} % (--refit).')
    within = gap.get('within_solved', 0.0)
    if len(apart) < len(which) and within > WORTH + max(
            gap['solved'], gap.get('refitted_solved', 0.0)):
        text += (f' Values of the file moved within their tolerances remove more without '
                 f'{"it" if len(which) == 1 else "them"}: {round(100.0 * within)} %.')
    return text


def _remedy(one: MissingEffect) -> str:
    """Return what to do about what no effect of a twin can hold; '' of others."""
    if one.effect == EXTERNAL:
        return f'Measured or computed, it comes in as the column {EXTERNAL}.'
    if one.site == 'controller':
        return ('Set the controller of the servo file so. The comparison by simulation runs under '
                'the recorded command and does not show it.')
    if one.mechanism['driving']:
        return (f'The {one.site} drives the twin: take the filter off it, or log it without, '
                'before it is simulated.')
    if BY_RECORDING not in one.mechanism['variables']:
        return ''
    if one.mechanism['port'] == 'sensor':
        return f'Take the zero of the {one.site} before each recording.'
    if one.mechanism['port'] in ('torque', 'inertia'):
        return ('One servo file has one load: diagnose the recordings with another on their own, '
                'each with its file.')
    return 'Let the machine warm up before it is recorded, or record its temperature.'


def _is_value(effect: str) -> bool:
    """Tell whether an effect is another value of the servo file, and nothing is missing."""
    return effect.startswith('parameter:') or effect in VALUES


def spoken(effect: str) -> str:
    """Return the name of an effect in words."""
    if effect in VALUES:
        return f'another {VALUES[effect]}'
    if effect.startswith('parameter:'):
        instance, _, value = effect.removeprefix('parameter:').rpartition('.')
        value = f'another value of {value.replace("_", " ")}'
        return f'{value} of {instance.replace("_", " ")}' if instance else value
    return effect.replace('_', ' ')


def _named(one: MissingEffect | Alternative) -> str:
    if _is_value(one.effect):
        text = spoken(one.effect)
        if isinstance(one, MissingEffect) and '.' not in one.effect and (
                'angle' in one.mechanism['variables'][1:]):
            where = 'place' if (one.curve or {}).get('unit') == 'm' else 'angle'
            text += f' at each {where} of the {"motor" if one.site == "motor" else "load"}'
        return text
    return f'{spoken(one.effect)} at the {SITES.get(one.site, one.site.replace("_", " "))}'


def _listed(words: Sequence[str], last: str = 'and') -> str:
    return words[0] if len(words) == 1 else f'{", ".join(words[:-1])} {last} {words[-1]}'


def size_of(parameters: dict[str, dict[str, Any]], curve: dict[str, Any] | None,
            turn: str = '') -> str:
    """
    Return the size of an effect with its unit: its values, or the span of its curve.

    Waves are told by their amplitudes; ``turn`` is the shaft whose turn they are counted in,
    STRAIGHT what moves without turning.
    """
    waves = _waves(parameters) if turn else []
    first = [(name, p) for name, p in parameters.items()
             if '[' not in name and _last(name) != 'order']
    if first and waves and SURE * waves[0][2] > waves[0][1]:
        waves = []  # of a value that may vary, the value is what is sure
    if waves:
        order, size, std, unit = waves[0]
        often = _repeated(order, turn)
        often = f'a period of {often}' if turn == STRAIGHT else f'{often} per turn of the {turn}'
        told = f'amplitude {_measured(size, std)} {unit}, {often}'
        more = [f'{size:.2g} {unit} at {_repeated(order, turn)}'
                for order, size, _, unit in waves[1:]]
        return f'{told}, and {_listed(more)}' if more else told
    if curve and first and SURE * (first[0][1]['std'] or 0.0) > abs(first[0][1]['value']):
        first = []  # recordings that do not tell a value may tell the curve that it stands for
    if {'cosine', 'sine'} <= set(parameters):
        a, b = parameters['cosine'], parameters['sine']
        std = max(one['std'] or 0.0 for one in (a, b))
        return f'amplitude {_measured(hypot(a["value"], b["value"]), std)} {a["unit"]}'
    if first and not (curve and len(first) < len(parameters) and not turn):  # waves: as a curve
        each = [f'{_last(name).replace("_", " ")} {_measured(p["value"], p["std"])} {p["unit"]}'
                for name, p in (first[:1] if curve and len(first) > TOLD else first[:TOLD])]
        return _listed([one.strip() for one in each])
    if curve:
        y, least, most = curve['y'], min(curve['y']), max(curve['y'])
        unit, x = curve['y_unit'], curve['x']
        span = f'{_beside(x[0], x)} to {_beside(x[-1], x)} {curve["unit"]}'
        if {y[0], y[-1]} == {least, most}:
            return f'{_beside(y[0], y)} to {_beside(y[-1], y)} {unit} from {span}'
        orders = sorted(p['value'] for name, p in parameters.items() if _last(name) == 'order')
        turn = f', order{"s"[:len(orders) - 1]} {_listed([f"{one:.4g}" for one in orders])}' if (
            orders) else ''
        return f'between {_beside(least, y)} and {_beside(most, y)} {unit} over {span}{turn}'
    return ''


def _repeated(order: float, turn: str) -> str:
    """Return how often a wave repeats in a turn; where nothing turns, over which way."""
    return f'{2e3 * pi / order:.3g} mm' if turn == STRAIGHT else f'{order:.4g}'


def _waves(parameters: dict[str, dict[str, Any]]) -> list[tuple[float, float, float, str]]:
    """Return (order, amplitude, standard deviation, unit) of waves worth naming, largest first."""
    base: dict[str, float] = {}
    found: list[tuple[str, int, float, float, str]] = []
    for path, one in parameters.items():
        name, _, index = path.partition('[')
        if _last(name) == 'order':
            base[name.rpartition('.')[0]] = one['value']
        elif _last(name) == 'cosine' and index:
            sine = parameters.get(f'{name.removesuffix("cosine")}sine[{index}')
            if sine:
                std = max(both['std'] or 0.0 for both in (one, sine))
                found.append((name.rpartition('.')[0], 1 + int(index.rstrip(']')),
                              hypot(one['value'], sine['value']), std, one['unit']))
    largest = max((a for *_, a, _, _ in found), default=0.0)
    return sorted(((base[of] * k, a, std, unit) for of, k, a, std, unit in found
                   if of in base and a > WORTH * largest), key=lambda wave: -wave[1])


def _last(path: str) -> str:
    return path.rpartition('.')[2]


def _measured(value: float, std: float | None) -> str:
    """Return a value to three digits, or as many as its standard deviation leaves, with it."""
    if not std or not isfinite(std):
        return f'{value:.3g}'
    digits = 1 + floor(log10(abs(value))) - floor(log10(std)) if value else 3
    return f'{value:.{min(max(3, digits), 9)}g} +- {float(f"{std:.1g}"):g}'


def _beside(value: float, others: Sequence[float]) -> str:
    """Return a value to three digits; what is rounding beside the others is zero."""
    largest = max(abs(other) for other in others)
    return f'{value if abs(value) > 1e-6 * largest else 0.0:.3g}'
