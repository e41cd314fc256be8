"""What one sees while a rig and its twin run: rates, losses, latency, residual per balance."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from ..pages.fit_table import bar
from ..recording.recording import BALANCES

_NODES = ('driver', 'twin', 'recorder')
_MARKS = {0: '[green]●[/]', 1: '[yellow]●[/]', 2: '[red]●[/]', 3: '[dim]○[/]'}


def view(title: str, seconds: float, duration: float, facts: dict[str, dict[str, str]],
         sentences: dict[str, str], levels: dict[str, int]) -> RenderableType:
    """Return the live view; arguments as of session_node.Session, times in s."""
    nodes = Table.grid(padding=(0, 1))
    for name in _NODES:
        mark = _MARKS.get(levels.get(name, 3), _MARKS[3])
        nodes.add_row(mark, f'[bold]{name}[/]', Text(sentences.get(name, 'starting')))
    twin = facts.get('twin', {})
    balances = Table.grid(padding=(0, 1))
    for name in BALANCES:
        level = twin.get(f'{name}, noise floors')
        if level is not None:
            balances.add_row(name.replace('_', ' '), f'{float(level):8.2f} × noise',
                             bar(float(level)))
    return Panel(Group(nodes, Text(''), Text(numbers(seconds, facts)), Text(''), balances),
                 title=f'{title}   {seconds:.0f} s of {duration:.0f} s   Ctrl-C ends it early')


def numbers(seconds: float, facts: dict[str, dict[str, str]]) -> str:
    """Return what was counted, in one line."""
    twin, recorder = facts.get('twin', {}), facts.get('recorder', {})
    lost = sum(int(text.split()[0]) for key, text in recorder.items() if key.startswith('lost '))
    said = [f'{seconds:.0f} s', f'{twin.get("samples in", "0")} samples', f'{lost} lost',
            f'{twin.get("bridged", "0")} bridged', f'{twin.get("restarts", "0")} restarts']
    for kind in ('prediction', 'residual'):
        latency = twin.get(f'latency of {kind}, ms')
        if latency:
            said.append(f'{kind} after {latency} ms')
    return ', '.join(said)
