"""The figures of the blind check as pictures: confusion, risk over coverage, shrink."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from .case_outcome import Outcome
from .fault_tables import faults
from .scoring import confusion, risk_coverage, shrinks

INK, GOOD, BAD, PALE = '#1f2933', '#2f6f4f', '#b3392f', '#8a94a0'
_BASELINES = ('#c9822b', '#7a5195', '#4f81bd', '#8a94a0')
LOWEST = -0.5  # realised shrink that is still drawn in its place


def draw_confusion(outcomes: Sequence[Outcome], path: Path) -> None:
    """Draw what was named over what is true; right ones green, wrong ones red."""
    rows, columns, table = confusion(outcomes)
    figure = Figure((3.0 + 0.27 * len(columns), 2.2 + 0.22 * len(rows)), layout='constrained')
    axes = figure.add_subplot()
    for i, row in enumerate(rows):
        for j, column in enumerate(columns):
            if not table[i, j]:
                continue
            unknown = row.endswith(' (removed)') or row in faults() and not faults()[row].known
            right = (column == '(unknown)') if unknown else column == row
            mild = column.startswith('(')
            colour = GOOD if right else PALE if mild else BAD
            axes.text(j, i, str(table[i, j]), ha='center', va='center', color='white', fontsize=7,
                      bbox={'boxstyle': 'square,pad=0.35', 'facecolor': colour, 'linewidth': 0})
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    axes.set_yticks(range(len(rows)), rows, fontsize=7)
    axes.set_xlim(-0.6, len(columns) - 0.4)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlabel('named first', fontsize=8)
    axes.set_ylabel('true', fontsize=8)
    axes.grid(color='#e6e9ed', linewidth=0.6)
    axes.set_axisbelow(True)
    _plain(axes)
    _save(figure, path)


def draw_risk(outcomes: Sequence[Outcome], baselines: Mapping[str, Sequence[Outcome]],
              path: Path) -> None:
    """Draw the share of wrong first choices over the share of cases in which one is made."""
    figure = Figure((5.6, 3.6), layout='constrained')
    axes = figure.add_subplot()
    axes.plot(*risk_coverage(outcomes), color=INK, linewidth=2.0, label='diagnosis')
    for (name, known), colour in zip(baselines.items(), _BASELINES, strict=False):
        if any(o.named for o in known):
            axes.plot(*risk_coverage(known), color=colour, linewidth=1.2, label=name)
    axes.set_xlabel('coverage: share of all cases in which a cause is named', fontsize=8)
    axes.set_ylabel('risk: share of wrong first choices', fontsize=8)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    axes.legend(frameon=False, fontsize=8)
    _plain(axes)
    _save(figure, path)


def draw_shrink(outcomes: Sequence[Outcome], path: Path) -> None:
    """Draw realised over predicted shrink with intervals; right causes green, wrong ones red."""
    figure = Figure((4.4, 4.2), layout='constrained')
    axes = figure.add_subplot()
    axes.plot([-0.1, 1.0], [-0.1, 1.0], color=PALE, linewidth=0.8)
    for right, colour, label in ((True, GOOD, 'right cause'), (False, BAD, 'wrong cause')):
        part = [o for o in outcomes if o.first_right is right]
        for number, (predicted, realised, interval) in enumerate(shrinks(part)):
            if interval:
                axes.plot([predicted] * 2, interval, color=colour, linewidth=0.6, alpha=0.5)
            axes.plot(predicted, realised, '.', color=colour, label='' if number else label)
            if realised < LOWEST:
                axes.plot(predicted, LOWEST + 0.02, 'v', color=colour)
                axes.annotate(f' {100 * realised:.0f} %', (predicted, LOWEST + 0.02), fontsize=7)
    axes.set_ylim(LOWEST, 1.05)
    axes.set_xlabel('predicted shrink, on accepting recordings', fontsize=8)
    axes.set_ylabel('realised shrink, on reporting recordings', fontsize=8)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(frameon=False, fontsize=8)
    _plain(axes)
    _save(figure, path)


def _plain(axes) -> None:
    for side in ('top', 'right'):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=7)


def _save(figure: Figure, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=140)
