"""
The code blocks of a page, and which of them can be run.

A block in ``sh`` or ``python`` is run as it stands, beside the shipped files. A comment on
a line above a block says what else holds:

    <!-- slow -->             it is run by `make docs-check` and not by `make test`
    <!-- not run: REASON -->  it is not run: hardware, published data, hours, or a form to fill in

A block without a language is output or a drawing.
"""

from dataclasses import dataclass
from pathlib import Path
import re

COMMANDS = ('make', 'python', 'pip', 'servo-twin', 'servo-identify', 'driver', 'recorder',
            'can_hub', 'emulated_rig', 'identify_node', 'twin_node', 'dask', 'ros2', 'sudo',
            '. ./env.sh')
_FENCE = re.compile(r'^ *(```|~~~)(.*)$')
_MARK = re.compile(r'<!-- (slow|not run: .+) -->')


@dataclass(frozen=True)
class Block:
    """One block: the line where it begins, its language, its text, and its mark ('' for none)."""

    line: int
    language: str
    text: str
    mark: str

    @property
    def runs(self) -> bool:
        """Whether it is a program that runs without anything that is not shipped."""
        return self.language in ('sh', 'python') and not self.mark.startswith('not run')

    @property
    def slow(self) -> bool:
        """Whether it is left to `make docs-check`."""
        return self.mark == 'slow'

    @property
    def looks_like_commands(self) -> bool:
        """Whether a line of it begins as a command of ours does."""
        return any(line.strip().startswith(tuple(f'{one} ' for one in COMMANDS))
                   for line in self.text.splitlines())


def blocks(page: Path) -> list[Block]:
    """Return the fenced blocks of a page, in their order."""
    found, mark, begun = [], '', None
    for number, line in enumerate(page.read_text().splitlines(), 1):
        fence = _FENCE.match(line)
        if begun is not None:
            if fence and not fence[2].strip():
                start, language, kept = begun
                found.append(Block(start, language, '\n'.join(kept) + '\n', mark))
                begun, mark = None, ''
            else:
                begun[2].append(line)
        elif fence:
            begun = (number, fence[2].strip(), [])
        elif line.strip():
            said = _MARK.fullmatch(line.strip())
            mark = said[1] if said else ''
    return found


def program(page: Path, slow: bool) -> str:
    """
    Return what a page has one run as one script for bash, '' for nothing.

    The commands run in their order, behind them the Python as one program. Unless `slow`, blocks
    that are marked so are left out. The environment is set already, so `. ./env.sh` is too.
    """
    runs = [one for one in blocks(page) if one.runs and (slow or not one.slow)]
    shell = [f'echo "{page.name}, line {one.line}"\n{one.text}' for one in runs
             if one.language == 'sh']
    python = ''.join(one.text for one in runs if one.language == 'python')
    script = '\n'.join(shell).replace('. ./env.sh\n', '')
    if python:
        script += f"\necho '{page.name}, Python'\npython - <<'END'\n{python}END\n"
    return f'set -euo pipefail\n{script}' if script.strip() else ''
