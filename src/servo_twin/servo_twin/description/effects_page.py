"""
The page `docs/effects.md`, written from what the effects declare.

    python -m servo_twin.description.effects_page docs/effects.md
"""

from __future__ import annotations

import inspect
from pathlib import Path
import re
import sys
import textwrap

from ..physics.catalogue import find, names
from ..physics.effect import Declared, Effect, Parameter
from ..physics.ports import PORTS

_HEAD = """# The catalogue of effects

Everything that an ideal servo does not do, one file each in `servo_twin/physics/effects/`. This
page is made from their declarations:
`python -m servo_twin.description.effects_page docs/effects.md`.

*Off* is the value at which what a parameter stands for vanishes; a parameter without one is a
shape. A row takes as many numbers as the servo file gives it. Angles count as a unit of their own
(an order is in 1/rad); what moves straight on a linear axis is in m and N
([signs.md](signs.md#a-linear-axis)).
"""


def page() -> str:
    """Return the page as Markdown: one section a port, one entry an effect."""
    effects = [find(name) for name in names()]
    sections = [_HEAD]
    for port in PORTS.values():
        sections.append(f'## {port.__name__}\n\n{as_markdown(inspect.getdoc(port))}\n')
        sections += [_entry(effect) for effect in effects if effect.port == port.port]
    return '\n'.join(sections)


def _entry(effect: type[Effect]) -> str:
    about = inspect.getdoc(inspect.getmodule(effect)).strip()
    sites = ', '.join(f'`{site}`' for site in effect.sites)
    return '\n'.join([
        f'### {effect.name}\n', f'{about} Acts at {sites}.\n',
        as_markdown(inspect.getdoc(effect)), f'\nSource: {with_links(effect.source)}.\n',
        *parameter_rows(effect), ''])


def parameter_rows(declared: type[Declared]) -> list[str]:
    """Return the lines of a Markdown table of declared parameters."""
    return ['| parameter | default | unit | bounds | off | meaning |', '|---|---|---|---|---|---|',
            *(_row(name, parameter) for name, parameter in declared.parameters.items())]


def _row(name: str, parameter: Parameter) -> str:
    default = parameter.default
    shown = ', '.join(f'{v:g}' for v in default) + ' (row)' if parameter.row else f'{default:g}'
    low, high = parameter.bounds
    off = '' if parameter.off is None else f'{parameter.off:g}'
    return (f'| `{name}` | {shown} | {parameter.unit} | {low:g} to {high:g} | {off} | '
            f'{parameter.meaning} |')


def with_links(source: str) -> str:
    """Return a source whose papers, as ``paper 000``, are links to docs/papers.md."""
    return re.sub(r'paper (\d{3})', r'[paper \1](papers.md#paper-\1)', source)


def as_markdown(docstring: str) -> str:
    """Turn the equations of a docstring into fenced ones and its code marks into single ones."""
    blocks, lines = [], docstring.splitlines()
    while lines:
        line = lines.pop(0)
        if not line.startswith('.. math::'):
            blocks.append(line.replace('``', '`'))
            continue
        equation = [line.removeprefix('.. math::')]
        while lines and (lines[0].startswith(' ') or (equation == [''] and not lines[0])):
            equation.append(lines.pop(0))
        text = '\n'.join(textwrap.dedent(e).strip() for e in equation if e.strip())
        blocks.append(f'```math\n{text}\n```')
    return '\n'.join(blocks)


def write_out(text: str) -> None:
    """Write a page to the file that the command line names, or to the terminal."""
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(text)
    else:
        print(text, end='')


if __name__ == '__main__':
    write_out(page())
