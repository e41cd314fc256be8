"""Curves over time as inline SVG, drawn in the colours of the page that holds them."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from math import ceil, floor, isfinite, log10

import numpy as np

WIDTH, LEFT, RIGHT, TOP, BOTTOM = 960, 74, 12, 10, 26  # px
BUCKETS = 440  # along the time axis: the lowest and the highest sample of each is drawn


def line_chart(time: np.ndarray, curves: Mapping[str, np.ndarray], unit: str, height: int = 190,
               band: float | None = None, time_axis: bool = True) -> str:
    """
    Return a chart of curves over time (s), each of shape (samples,), with NaN where unknown.

    The key of a curve is its CSS class. ``band`` shades from its negative to itself, which is what
    noise alone does. Of the thousands of samples in a pixel the
    extremes stay.
    """
    known = [c[np.isfinite(c)] for c in curves.values()]
    known = [c for c in known if len(c)]
    if not known or len(time) < 2:
        return '<p class="none">nothing was measured</p>'
    low, high = min(c.min() for c in known), max(c.max() for c in known)
    if band is not None and isfinite(band):
        low, high = min(low, -band), max(high, band)
    low, high = _widened(float(low), float(high))
    bottom = height - (BOTTOM if time_axis else 8)

    def across(t):
        return LEFT + (t - time[0]) / (time[-1] - time[0]) * (WIDTH - LEFT - RIGHT)

    def down(y):
        return TOP + (high - y) / (high - low) * (bottom - TOP)

    parts = [f'<svg viewBox="0 0 {WIDTH} {height}" role="img" '
             f'aria-label="{escape(", ".join(curves))} in {escape(unit)} over time">']
    if band is not None and isfinite(band):
        parts.append(f'<rect class="band" x="{LEFT}" y="{down(band):.1f}" '
                     f'width="{WIDTH - LEFT - RIGHT}" '
                     f'height="{max(1.0, down(-band) - down(band)):.1f}"/>')
    for tick in ticks(low, high, max(3, height // 40)):
        parts.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{down(tick):.1f}" '
                     f'y2="{down(tick):.1f}"/><text class="tick" x="{LEFT - 6}" '
                     f'y="{down(tick) + 4:.1f}" text-anchor="end">{_number(tick)}</text>')
    if time_axis:
        for tick in ticks(float(time[0]), float(time[-1]), 8):
            parts.append(f'<text class="tick" x="{across(tick):.1f}" y="{height - 8}" '
                         f'text-anchor="middle">{_number(tick)} s</text>')
    parts.append(f'<text class="unit" transform="translate(13 {(TOP + bottom) / 2:.0f}) '
                 f'rotate(-90)" text-anchor="middle">{escape(unit)}</text>')
    for name, curve in curves.items():
        for piece in _pieces(across(time), down(curve)):
            parts.append(f'<polyline class="{escape(name)}" points="{piece}"/>')
    return ''.join(parts) + '</svg>'


def ticks(low: float, high: float, most: int) -> list[float]:
    """Return round numbers from low to high, at most ``most`` + 1 of them."""
    rough = (high - low) / most
    power = 10.0 ** floor(log10(rough))
    step = next(s * power for s in (1.0, 2.0, 5.0, 10.0) if s * power >= rough * (1.0 - 1e-9))
    return [k * step for k in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1)]


def _widened(low: float, high: float) -> tuple[float, float]:
    room = 0.06 * (high - low)
    if room <= 1e-12 * max(abs(low), abs(high)):
        room = max(1e-12, 0.1 * abs(high))
    return low - room, high + room


def _number(value: float) -> str:
    text = f'{value:.6g}'
    return '0' if text == '-0' else text.replace('e-0', 'e-').replace('e+0', 'e')


def _pieces(x: np.ndarray, y: np.ndarray) -> list[str]:
    """Return the points of each stretch without gaps, thinned to the extremes of each bucket."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], np.isfinite(y).astype(int), [0]))))
    pieces = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        kept = _extremes(y[begin:end], max(2, BUCKETS * (end - begin) // len(y))) + begin
        pieces.append(' '.join(f'{px:.1f},{py:.1f}' for px, py in zip(x[kept], y[kept],
                                                                      strict=True)))
    return pieces


def _extremes(y: np.ndarray, buckets: int) -> np.ndarray:
    if len(y) <= 2 * buckets:
        return np.arange(len(y))
    size = -(-len(y) // buckets)
    padded = np.pad(y, (0, -len(y) % size), mode='edge').reshape(-1, size)
    starts = np.arange(len(padded)) * size
    both = np.concatenate((starts + padded.argmin(1), starts + padded.argmax(1)))
    return np.unique(np.minimum(both, len(y) - 1))
