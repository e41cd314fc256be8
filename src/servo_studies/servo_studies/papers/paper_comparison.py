"""
The comparison: every system of the five papers, what of it runs, the paper's figure and ours.

Each part of the results turns its measured figures into rows, which are kept as JSON beside the
pages, so that a part that is not made this time keeps its rows. A system without a row has not
been run, and the table says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import json
from pathlib import Path

from .markdown_tables import table
from .paper_systems import System, SYSTEMS

KEYS = ('system', 'runs', 'paper', 'ours', 'command')
"""
What a row has, all of it text: ``system`` the name in systems.SYSTEMS, or another one, which is
added below those of its part; ``runs`` what of it runs here; ``paper`` the paper's figure ('' for
that of systems.SYSTEMS); ``ours`` the figure measured here; ``command`` that shows it ('' for the
command that makes the part).
"""

_HEAD = """# The systems of the five papers

Made by `make results`; the column *here* is not written by hand. Its figures are of emulated rigs,
which share no law with the models, and of times of the machine that ran them. Only the FMU is
compared with our own mechanism. The papers' figures are of their own rigs; they are typed from the
papers, whose titles and DOIs are in [papers.md](papers.md).

The command of a row makes its figures again, after `make training`. It writes them over these
pages; with `-o new/results.md`, in a folder that is there, it writes beside them. *Not run* is a
system whose figures have not been measured yet.

"""


def keep(folder: Path, part: str, rows: Sequence[Mapping[str, str]]) -> None:
    """
    Write the rows of a part to ``folder``.

    Raises ValueError where a row lacks one of :data:`KEYS` or gives other than text.
    """
    for row in rows:
        wrong = [key for key in KEYS if not isinstance(row.get(key), str)]
        if wrong or set(row) - set(KEYS):
            raise ValueError(f'a row of {part} has {sorted(row)}; it needs {list(KEYS)}, each '
                             'of them text')
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f'{part}.json').write_text(json.dumps(list(rows), indent=1) + '\n')


def kept(folder: Path) -> dict[str, list[dict[str, str]]]:
    """Return the rows of each part that ``folder`` holds."""
    return {path.stem: json.loads(path.read_text()) for path in sorted(folder.glob('*.json'))}


def comparison(rows: Mapping[str, Sequence[Mapping[str, str]]], pages: Mapping[str, str]) -> str:
    """Return the page from the rows of each part; ``pages`` says where a part's page is."""
    lines = []
    for paper in dict.fromkeys(system.paper for system in SYSTEMS):
        known = [system for system in SYSTEMS if system.paper == paper]
        for part in dict.fromkeys(system.part for system in known):
            given = {row['system']: row for row in rows.get(part, ())}
            for system in [s for s in known if s.part == part]:
                lines.append(_line(system, given.pop(system.name, None), pages))
            lines += [_line(System(paper, part, name, ''), row, pages)
                      for name, row in given.items()]
    return _HEAD + table(['paper', 'system', 'what runs here', 'paper', 'here', 'command'], lines)


def _line(system: System, row: Mapping[str, str] | None, pages: Mapping[str, str]) -> list[str]:
    figure = system.figure or 'no number'
    if row is None:
        return [system.paper, system.name, 'not run', figure, 'not run', '']
    page = pages.get(system.part)
    name = f'[{system.name}]({page})' if page else system.name
    command = row['command'] or f'servo-identify results --parts {system.part} --force'
    return [system.paper, name, row['runs'], row['paper'] or figure, row['ours'], f'`{command}`']
