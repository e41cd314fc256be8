"""One browser that looks: what it shows, and what of it has been sent."""

from __future__ import annotations

from collections.abc import Mapping
import json
from math import ceil, log2
from typing import Any

import numpy as np

from .spectrum import spectrum
from .traces import NAMES, Traces

SPANS = (1.0, 60.0)  # s that a plot may show
PIXELS = (50, 4000)  # that a plot may be wide
_MOST = 1e300
_SPECTRUM_OF = 8.0  # s


class Looker:
    """
    Makes the messages for one browser.

    `show` is what the browser asks for; `traces` returns what is new since the last call, as few
    bytes as the plot has pixels. Facts are sent when they changed.
    """

    def __init__(self) -> None:
        self._names: tuple[str, ...] = ()
        self._span, self._pixels = 10.0, 600
        self._spectrum = ''
        self._generation, self._bucket, self._next = -1, 0, 0
        self._told: dict[str, str] = {}

    def show(self, wanted: Mapping[str, Any]) -> None:
        """Take what the plots are of; what is unknown or out of range is passed over."""
        names = wanted.get('names')
        if isinstance(names, list):
            self._names = tuple(name for name in NAMES if name in names)
        self._span = _within(wanted.get('span'), *SPANS, self._span)
        self._pixels = round(_within(wanted.get('pixels'), *PIXELS, self._pixels))
        chosen = wanted.get('spectrum')
        self._spectrum = chosen if chosen in NAMES else ''
        self._generation = -1

    def traces(self, traces: Traces) -> bytes | None:
        """Return the new buckets as a message, or nothing where there are none."""
        period, generation = traces.period, traces.generation
        if not period or not self._names:
            return None
        whole = generation != self._generation
        if whole:
            self._generation = generation
            self._bucket = 1 << max(0, ceil(log2(self._span / (period * self._pixels))))
        room = ceil(self._span / (period * self._bucket)) + 2
        last = traces.settled() // self._bucket
        first = max(last - room if whole else max(self._next, last - room), 0)
        if last <= first and not whole:
            return None
        self._next = max(first, last)
        values = traces.extremes(self._names, self._bucket, first, self._next - first)
        head = json.dumps({
            'generation': generation, 'whole': whole, 'first': first, 'bucket': self._bucket,
            'period': period, 'names': self._names, 'count': self._next - first}).encode()
        head += b' ' * (-len(head) % 4)
        return len(head).to_bytes(4, 'little') + head + values.tobytes()

    def facts(self, facts: Mapping[str, Any]) -> str | None:
        """Return those facts that changed as a message, or nothing."""
        new = {}
        for name, fact in facts.items():
            text = json.dumps(fact)
            if self._told.get(name) != text:
                self._told[name] = text
                new[name] = fact
        return json.dumps({'facts': new}) if new else None

    def density(self, traces: Traces) -> str | None:
        """Return the spectrum that is shown, or nothing where none is."""
        if not self._spectrum or not traces.period:
            return None
        end = traces.settled()
        (values,) = traces.read([self._spectrum], end - round(_SPECTRUM_OF / traces.period), end)
        frequency, density = spectrum(values, traces.period)
        return json.dumps({'spectrum': {
            'name': self._spectrum, 'frequency': _rounded(frequency),
            'density': _rounded(density)}})


def is_number(value: Any) -> bool:
    """Tell whether what a browser sent is a number that a float can hold."""
    return not isinstance(value, bool) and isinstance(value, int | float) and abs(value) <= _MOST


def _within(value: Any, low: float, high: float, otherwise: float) -> float:
    if not is_number(value):
        return otherwise
    return min(max(low, value), high)


def _rounded(values: np.ndarray) -> list[float]:
    return [float(f'{value:.4g}') for value in values]
