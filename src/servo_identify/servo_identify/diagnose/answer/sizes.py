"""The size of a missing effect in words: its values with their deviations, or its curve."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, hypot, isfinite, log10, pi
from typing import Any

from ..decisions import WORTH

SURE = 1.645
"""Standard deviations of a 90 % interval."""

TOLD = 3  # values of one effect in a sentence
STRAIGHT = 'straight'  # a shaft that does not turn


def listed(words: Sequence[str], last: str = 'and') -> str:
    """Return words with commas between and ``last`` before the last."""
    return words[0] if len(words) == 1 else f'{", ".join(words[:-1])} {last} {words[-1]}'


def size_of(parameters: dict[str, dict[str, Any]], curve: dict[str, Any] | None,
            turn: str = '', at_most: int = TOLD) -> str:
    """
    Return the size of an effect with its unit: its values, or the span of its curve.

    Of its values ``at_most`` are told. Waves are told by their amplitudes; ``turn`` is the shaft
    whose turn they are counted in, STRAIGHT what moves without turning.
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
        return f'{told}, and {listed(more)}' if more else told
    if curve and first and SURE * (first[0][1]['std'] or 0.0) > abs(first[0][1]['value']):
        first = []  # recordings that do not tell a value may tell the curve that it stands for
    if {'cosine', 'sine'} <= set(parameters):
        a, b = parameters['cosine'], parameters['sine']
        std = max(one['std'] or 0.0 for one in (a, b))
        return f'amplitude {_measured(hypot(a["value"], b["value"]), std)} {a["unit"]}'
    if first and not (curve and len(first) < len(parameters) and not turn):  # waves: as a curve
        shown = {_last(name): p for name, p in reversed(first)}  # one of each name
        some = [(name, shown[name]) for name in dict.fromkeys(_last(name) for name, _ in first)]
        some = [some[0], *(one for one in some[1:]  # the rest as far as it is told from nothing
                           if SURE * (one[1]['std'] or 0.0) <= abs(one[1]['value']))]
        each = [f'{name.replace("_", " ")} {_measured(p["value"], p["std"])} {p["unit"]}'
                for name, p in (
                    some[:1] if curve and len(some) > at_most else some[:at_most])]
        return listed([one.strip() for one in each])
    if curve:
        y, least, most = curve['y'], min(curve['y']), max(curve['y'])
        unit, x = curve['y_unit'], curve['x']
        span = f'{_beside(x[0], x)} to {_beside(x[-1], x)} {curve["unit"]}'
        if {y[0], y[-1]} == {least, most}:
            return f'{_beside(y[0], y)} to {_beside(y[-1], y)} {unit} from {span}'
        orders = sorted(p['value'] for name, p in parameters.items() if _last(name) == 'order')
        turn = f', order{"s"[:len(orders) - 1]} {listed([f"{one:.4g}" for one in orders])}' if (
            orders) else ''
        return f'between {_beside(least, y)} and {_beside(most, y)} {unit} over {span}{turn}'
    return ''


def values_of(parameters: dict[str, dict[str, Any]]) -> list[str]:
    """Return each value of an effect with name, deviation and unit; the points of curves aside."""
    return [f'{named(path)} {_measured(one["value"], one["std"])} {one["unit"]}'.rstrip()
            for path, one in parameters.items()
            if '[' not in path and not (_last(path) == 'order' and one['value'] == 1.0)]


def named(path: str) -> str:
    """Return the name of a value in words, with the effect that it is of where a path has it."""
    *of, name = path.removeprefix('effects.').replace('_', ' ').split('.')
    return f'{name} of {" ".join(of)}' if of else name


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
    digits = 1 + floor(log10(abs(value))) - floor(log10(std)) if value else 0
    told = f'{value:#.{min(digits, 9)}g}'.rstrip('.') if digits >= 3 else f'{value:.3g}'
    return f'{told} +- {float(f"{std:.1g}"):g}'


def _beside(value: float, others: Sequence[float]) -> str:
    """Return a value to three digits; what is rounding beside the others is zero."""
    largest = max(abs(other) for other in others)
    return f'{value if abs(value) > 1e-6 * largest else 0.0:.3g}'
