"""The pictures of the EMA bench, as figures 5.1 to 5.11 of paper 002."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from servo_identify.learn.transmission.two_way_backlash import Play
from servo_twin.physics.servo import Servo

from .ema_errors import Judged, SIGNALS


def play(drawing: Servo, plays: Mapping[float, Play], path: Path) -> None:
    """Draw the backlash over the setting of the slide, measured and as drawn (figure 5.1)."""
    figure, axes = _figure(1, 1, (6.4, 4.2))
    axes = axes[0, 0]
    settings = np.array(sorted(plays))
    at = np.linspace(settings[0], settings[-1], 200)
    drawn = np.interp(at, drawing.values['effects.play.settings'],
                      drawing.values['effects.play.widths'])
    axes.plot(1e3 * at, 1e3 * drawn, 'k--', lw=1.0, label='drawing')
    axes.errorbar(1e3 * settings, [1e3 * plays[s].width for s in settings],
                  [1e3 * plays[s].varies for s in settings], fmt='o-', ms=4, lw=1.0,
                  color='tab:red', capsize=3, label='measured; bars: from cell to cell')
    axes.set(xlabel='setting of the slide, mm', ylabel='play, mrad at the encoder')
    axes.legend(fontsize=9)
    figure.savefig(path)


def heat(found: Sequence[Judged], path: Path) -> None:
    """Draw MSE, standard error, RMSE and its floor over brake and slide (5.4 to 5.11)."""
    settings = sorted({f.case.setting for f in found})
    brakes = sorted({f.case.brake for f in found})
    figure, axes = _figure(3, 4, (15.0, 9.0))
    for row, (name, unit) in enumerate(SIGNALS.items()):
        kinds = {f'MSE of {name}, ({unit})²': lambda a: a.mse,
                 f'standard error of {name}, %': lambda a: a.se,
                 f'RMS error of {name}, %': lambda a: a.rmse,
                 'floor of it: bench twice, %': lambda a: a.floor}
        values = [np.array([[kind(_at(found, s, b).signals[name]) for b in brakes]
                            for s in settings]) for kind in kinds.values()]
        top = max(values[2].max(), values[3].max())
        for column, (title, table) in enumerate(zip(kinds, values, strict=True)):
            one = axes[row, column]
            shown = one.imshow(table, cmap='viridis', aspect='auto', origin='lower', vmin=0.0,
                               vmax=top if column > 1 else None)
            figure.colorbar(shown, ax=one, fraction=0.05)
            for i in range(len(settings)):
                for j in range(len(brakes)):
                    bright = table[i, j] > 0.6 * (top if column > 1 else table.max())
                    one.text(j, i, f'{table[i, j]:.2g}', ha='center', va='center', fontsize=7,
                             color='black' if bright else 'white')
            one.set_xticks(range(len(brakes)), [f'{b:g}' for b in brakes])
            one.set_yticks(range(len(settings)), [f'{1e3 * s:g}' for s in settings])
            one.set_title(title, fontsize=10)
            if row == 2:
                one.set_xlabel('brake, N m')
            if column == 0:
                one.set_ylabel('slide, mm')
    figure.savefig(path)


def traces(found: Sequence[Judged], settings: Sequence[float], brake: float, path: Path) -> None:
    """Draw the three signals at one brake over time, model on bench (5.2, 5.6, 5.9)."""
    figure, axes = _figure(3, len(settings), (5.2 * len(settings), 8.0))
    for column, setting in enumerate(settings):
        one = _at(found, setting, brake)
        for row, (name, unit) in enumerate(SIGNALS.items()):
            axes[row, column].plot(one.time, one.bench[name], color='black', lw=1.4,
                                   label='bench')
            axes[row, column].plot(one.time, one.model[name], color='tab:red', lw=0.8,
                                   label='model')
            if column == 0:
                axes[row, column].set_ylabel(f'{name}, {unit}')
        axes[0, column].set_title(f'slide {1e3 * setting:g} mm, brake {brake:g} N m', fontsize=10)
        axes[2, column].set_xlabel('time, s')
    axes[0, 0].legend(fontsize=9)
    figure.savefig(path)


def _at(found: Sequence[Judged], setting: float, brake: float) -> Judged:
    return next(f for f in found if f.case.setting == setting and f.case.brake == brake)


def _figure(rows: int, columns: int, size: tuple[float, float]):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(size, dpi=80, layout='constrained')
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False)
