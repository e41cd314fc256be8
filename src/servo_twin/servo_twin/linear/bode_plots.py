"""Bode and step plots of a linear form, beside what was measured."""

from __future__ import annotations

from io import BytesIO

import matplotlib
from matplotlib.figure import Figure
import numpy as np

from .frequency_response import CLEAR, Measured
from .state_space import LinearForm

_STYLE = {'font.size': 9, 'axes.grid': True, 'grid.alpha': 0.3, 'axes.spines.top': False,
          'axes.spines.right': False, 'lines.linewidth': 1.6}
_MODEL, _DATA = '#1f5fa8', '#c8551b'
_WIDTH = 8.0  # in
_DPI = 110


def bode(form: LinearForm, output: str, frequency: np.ndarray,
         measured: Measured | None = None) -> bytes:
    """
    Return a PNG of size and phase over frequency (Hz), with coherence where it was measured.

    The model is sampled as the recording is; measured points that are not coherent are faint.
    """
    rows = 3 if measured else 2
    unit = f'{form.units[output]} / {form.units[form.input]}'
    with matplotlib.rc_context(_STYLE):
        figure = Figure((_WIDTH, 1.2 + 2.1 * rows), _DPI, layout='constrained')
        axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
        model = form.response(output, frequency, measured.period if measured else 0.0)
        turned = np.degrees(np.unwrap(np.angle(model)))
        turned -= 360.0 * np.round(turned[0] / 360.0)
        if measured:
            points = 20.0 * np.log10(np.abs(measured.response))
            phase = np.interp(np.log(measured.frequency), np.log(frequency), turned)
            off = np.degrees(np.angle(measured.response)) - phase
            phase += (off + 180.0) % 360.0 - 180.0
            for clear, alpha in ((~measured.clear, 0.25), (measured.clear, 0.9)):
                for axis, values in zip(axes, (points, phase, measured.coherence), strict=True):
                    axis.plot(measured.frequency[clear], values[clear], '.', color=_DATA,
                              markersize=4, alpha=alpha)
            axes[2].axhline(CLEAR, color='grey', linewidth=0.8, linestyle=':')
            axes[2].set(ylabel='coherence', ylim=(-0.03, 1.05))
            axes[0].plot([], [], '.', color=_DATA, label='recording')
        axes[0].plot(frequency, 20.0 * np.log10(np.abs(model)), color=_MODEL, label='servo file')
        axes[1].plot(frequency, turned, color=_MODEL)
        for root, style in ((form.poles(output), '--'), (form.zeros(output), ':')):
            for place in root:
                if place.resonant and frequency[0] < place.frequency < frequency[-1]:
                    for axis in axes[:2]:
                        axis.axvline(place.frequency, color='grey', linewidth=0.8, linestyle=style)
        axes[0].set(ylabel=f'size, dB re {unit}', xscale='log',
                    title=f'{form.servo}: {spoken(form.input)} to {spoken(output)}')
        axes[1].set(ylabel='phase, deg')
        axes[-1].set(xlabel='frequency, Hz', xlim=(frequency[0], frequency[-1]))
        if measured:
            axes[0].legend(frameon=False)
        return _png(figure)


def step(form: LinearForm, output: str, duration: float | None = None) -> bytes:
    """Return a PNG of the answer to a step of one unit of the input."""
    time, answer = form.step_response(output, duration)
    with matplotlib.rc_context(_STYLE):
        figure = Figure((_WIDTH, 3.2), _DPI, layout='constrained')
        axis = figure.subplots()
        axis.plot(time, answer, color=_MODEL, drawstyle='steps-post'
                  if form.system.isdtime(strict=True) else 'default')
        axis.set(xlabel='time, s', ylabel=f'{spoken(output)}, {form.units[output]}',
                 title=f'{form.servo}: a step of 1 {form.units[form.input]} of '
                       f'{spoken(form.input)}', xlim=(0.0, time[-1]))
        return _png(figure)


def spoken(name: str) -> str:
    """Return a column's name as words."""
    return name.replace('_', ' ')


def _png(figure: Figure) -> bytes:
    written = BytesIO()
    figure.savefig(written, format='png', metadata={'Software': None})
    return written.getvalue()
