"""The fit of a twin as tables in the terminal."""

from __future__ import annotations

from math import isfinite, log10

from rich.table import Table

from ..balances.goodness_of_fit import Fit

BAR = 24


def channel_table(fit: Fit) -> Table:
    """Return a table of the channels."""
    table = Table(title='rig against twin', title_justify='left', title_style='bold')
    table.add_column('channel')
    for column in ('R (eq. 13)', 'RMS gap', 'largest', 'noise'):
        table.add_column(column, justify='right')
    table.add_column('unit')
    for row in fit.channels:
        table.add_row(row.channel, f'{row.goodness:.4f}', f'{row.rms:.3g}', f'{row.largest:.3g}',
                      f'{row.noise:.2g}' if isfinite(row.noise) else '', row.unit)
    return table


def balance_table(fit: Fit) -> Table:
    """Return a table of the balances, with a bar for the residual over its noise floor."""
    table = Table(title='residual per balance', title_justify='left', title_style='bold')
    table.add_column('balance')
    table.add_column('RMS over noise', justify='right')
    table.add_column('1        10       100')
    table.add_column('noise floor', justify='right')
    for row in fit.balances:
        table.add_row(row.balance, f'{row.over_noise:.2f}', bar(row.over_noise),
                      f'{row.floor:.3g} {row.unit}')
    return table


def bar(over_noise: float) -> str:
    """Return a bar on a logarithmic scale: empty at the noise floor, full at a thousand."""
    if not isfinite(over_noise) or over_noise <= 1.0:
        return '[green]·[/]'
    filled = min(BAR, max(1, round(BAR * log10(over_noise) / 3.0)))
    colour = 'green' if over_noise < 2.0 else 'yellow' if over_noise < 10.0 else 'red'
    return f'[{colour}]{"█" * filled}[/]'
