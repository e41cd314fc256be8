"""The pictures of a diagnosis as inline SVG: chain, scatter with its law, waterfall."""

from __future__ import annotations

from html import escape
from textwrap import wrap

import numpy as np

from servo_twin.pages.replay_page import CHAIN, times, WITHOUT_TORQUE
from servo_twin.pages.svg_charts import BOTTOM, LEFT, RIGHT, ticks, TOP

from .answer import Located
from .page_laws import Law

SITES = {
    'motor': 'motor', 'load': 'load', 'mesh': 'transmission', 'drive': 'drive',
    'command': 'drive', 'current': 'drive', 'controller': 'controller',
}
"""The balance at which a cause sits, by its site; what is left is a sensor."""
BLOCK, BETWEEN = 146, 26  # px of the chain


def chain(where: tuple[Located, ...], balance: str, causes: list[tuple[str, str]]) -> str:
    """
    Return the chain of the servo with the gap where it lies and the causes where they sit.

    ``causes`` are (effect, balance of the block).
    """
    located = {one.balance: one for one in where}
    torque = located.get('torque')
    merged = torque is not None and torque.verdict != 'not observable'
    blocks = [(block, {'torque_balance': 'torque'}.get(name, name))
              for block, name in (WITHOUT_TORQUE if merged else CHAIN)]
    seats = {'motor': 'torque', 'load': 'torque'} if merged else {}
    below: dict[str, list[str]] = {}
    for effect, seat in causes:
        lines = wrap(effect.replace('_', ' ').replace(':', ': '), 20)
        below.setdefault(seats.get(seat, seat), []).extend(lines)
    deepest = max((len(b) for b in below.values()), default=0)
    height, parts = (110 + 17 * deepest if deepest else 90), []
    for k, (block, name) in enumerate(blocks):
        x, one = k * (BLOCK + BETWEEN), located.get(name)
        parts.append(_block(x, block, one, name == balance))
        middle = x + BLOCK / 2
        for row, line in enumerate(below.get(name, [])):
            parts.append(f'<text class="cause" x="{middle}" '
                         f'y="{120 + 17 * row}" text-anchor="middle">{escape(line)}</text>')
        if name in below:
            parts.append(f'<path class="pin" d="M{middle} 90v14m-5 -5l5 -9l5 9"/>')
        if k < len(blocks) - 1:
            parts.append(f'<path class="arrow" d="M{x + BLOCK + 4} 50h{BETWEEN - 9}'
                         'm-6 -5l6 5l-6 5"/>')
    total = len(blocks) * (BLOCK + BETWEEN) - BETWEEN + 2
    return (f'<svg viewBox="-1 0 {total} {height}" style="max-width: {total}px" role="img" '
            f'aria-label="The chain from command to sensors with the gap where it lies">'
            f'{"".join(parts)}</svg>')


def _block(x: float, block: str, one: Located | None, here: bool) -> str:
    kind, said, share = 'unknown', 'not observable', ''
    if one is not None and one.verdict != 'not observable':
        kind = 'fine' if one.verdict != 'gap' else 'far' if here else 'off'
        said = f'{times(one.gap_to_noise)} × noise'
        share = f'{100.0 * one.share:.0f} % of the gap' if kind != 'fine' else 'no gap'
    filled = ' here' if here else ''
    middle = x + BLOCK / 2
    tag = (f'<text class="tag" x="{middle}" y="11" text-anchor="middle">the gap lies here</text>'
           if here else '')
    return (f'<g class="{kind}{filled}">{tag}<rect x="{x}" y="18" width="{BLOCK}" height="66" '
            f'rx="9"/><text class="block" x="{middle}" y="42" text-anchor="middle">{block}</text>'
            f'<text class="said" x="{middle}" y="60" text-anchor="middle">{said}</text>'
            f'<text class="share" x="{middle}" y="76" text-anchor="middle">{share}</text></g>')


def scatter(law: Law, width: int = 520, height: int = 300) -> str:
    """Return the dots of a residual before and after, with the curves of the law."""
    every = np.concatenate([y for _, y in law.dots.values()])
    low, high = np.percentile(every, (0.3, 99.7))
    for _, y in law.curves.values():
        low, high = min(low, y.min()), max(high, y.max())
    room = 0.06 * (high - low) or 1e-12
    low, high = float(low - room), float(high + room)
    xs = next(iter(law.dots.values()))[0]
    left, right = float(xs.min()), float(xs.max())
    right = right if right > left else left + 1e-12
    bottom = height - BOTTOM - 14

    def across(x):
        return LEFT + (x - left) / (right - left) * (width - LEFT - RIGHT)

    def down(y):
        return TOP + (high - y) / (high - low) * (bottom - TOP)

    parts = [f'<svg viewBox="0 0 {width} {height}" style="max-width: {1.2 * width:.0f}px" '
             f'role="img" aria-label="{escape(law.title)} over {escape(law.variable)}">']
    for tick in ticks(low, high, 6):
        parts.append(f'<line class="{"zero" if tick == 0 else "grid"}" x1="{LEFT}" '
                     f'x2="{width - RIGHT}" y1="{down(tick):.1f}" y2="{down(tick):.1f}"/>'
                     f'<text x="{LEFT - 6}" y="{down(tick) + 4:.1f}" text-anchor="end">'
                     f'{number(tick)}</text>')
    for tick in ticks(left, right, 6):
        parts.append(f'<text x="{across(tick):.1f}" y="{bottom + 16}" text-anchor="middle">'
                     f'{number(tick)}</text>')
    unit = f', {law.variable_unit}' if law.variable_unit else ''
    parts.append(f'<text x="{(LEFT + width - RIGHT) / 2}" y="{height - 6}" '
                 f'text-anchor="middle">{escape(law.variable + unit)}</text>')
    parts.append(f'<text transform="translate(13 {(TOP + bottom) / 2:.0f}) rotate(-90)" '
                 f'text-anchor="middle">residual, {escape(law.unit)}</text>')
    for name, (x, y) in law.dots.items():
        seen = (y >= low) & (y <= high)
        marks = ''.join(f'M{px:.1f} {py:.1f}h0' for px, py in
                        zip(across(x[seen]), down(y[seen]), strict=True))
        parts.append(f'<path class="dots {name}" d="{marks}"/>')
    for x, y in law.curves.values():
        points = ' '.join(f'{px:.1f},{py:.1f}' for px, py in
                          zip(across(x), down(y), strict=True))
        parts.append(f'<polyline class="law" points="{points}"/>')
    return ''.join(parts) + '</svg>'


def waterfall(bars: list[dict], floor: float) -> str:
    """Return the gap after each step, with its interval and what the step took away."""
    wide, row, name_wide, value_wide = 960, 34, 250, 150
    most = max([b['interval'][1] for b in bars] + [b['gap'] for b in bars] + [floor, 1e-12])
    height = row * len(bars) + 26

    def across(value):
        return name_wide + value / most * (wide - name_wide - value_wide)

    parts = [f'<svg viewBox="0 0 {wide} {height}" role="img" aria-label="Gap after each step">']
    before = None
    for k, bar in enumerate(bars):
        y, now = k * row + 6, bar['gap']
        low, high = (across(v) for v in bar['interval'])
        parts.append(f'<text class="step" x="{name_wide - 12}" y="{y + 16}" text-anchor="end">'
                     f'{escape(bar["step"].replace("_", " "))}</text>')
        parts.append(f'<rect class="left" x="{name_wide}" y="{y}" height="22" rx="3" '
                     f'width="{max(0.5, across(now) - name_wide):.1f}"/>')
        said = f'{percent(now)} of the signal'
        if before is not None:
            kind = 'gain' if now <= before else 'loss'
            first, last = sorted((across(now), across(before)))
            parts.append(f'<rect class="{kind}" x="{first:.1f}" y="{y}" height="22" rx="3" '
                         f'width="{max(0.5, last - first):.1f}"/>')
            if before > 0.0:
                said = f'{percent(now)}  ({100.0 * (now / before - 1.0):+.0f} %)'.replace('-', '−')
        parts.append(f'<path class="whisker" d="M{low:.1f} {y + 11}H{high:.1f}'
                     f'M{low:.1f} {y + 6}v10M{high:.1f} {y + 6}v10"/>')
        edge = max(across(before if before is not None else now), across(now), high)
        parts.append(f'<text class="value" x="{edge + 8:.1f}" y="{y + 16}">{said}</text>')
        before = now
    parts.append(f'<path class="floor" d="M{across(floor):.1f} 0V{height - 20}"/>'
                 f'<text x="{across(floor):.1f}" y="{height - 4}" text-anchor="middle">noise '
                 f'{percent(floor)}</text></svg>')
    return ''.join(parts)


def percent(share: float) -> str:
    """Return a share as per cent in two or three digits."""
    return f'{100.0 * share:.3g} %'


def number(value: float) -> str:
    """Return a number of an axis, short."""
    text = f'{value:.4g}'
    return '0' if text in ('-0', '0') else text.replace('e-0', 'e-').replace('e+0', 'e')
