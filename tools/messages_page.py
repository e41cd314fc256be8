"""Write docs/messages.md from the comments of the interface files: ``python tools/messages_page.py``."""

from __future__ import annotations

from pathlib import Path
import re
import sys

ROOT = Path(__file__).resolve().parents[1]
INTERFACES = ROOT / 'src' / 'servo_twin_msgs'
PARTS = {'msg': ('',), 'srv': ('Request', 'Response'), 'action': ('Goal', 'Result', 'Feedback')}
HEAD = """# Messages, services, actions

The interfaces of `servo_twin_msgs`, made from their own comments by `python tools/messages_page.py`.
[wire.md](wire.md) has the frames on the bus, [recordings.md](recordings.md) the topics of a bag.
Every unit is SI. What is not measured is NaN, never zero. Samples travel in blocks; join them by
`sequence`, never by arrival.
"""


def page() -> str:
    """Return the page as Markdown."""
    sections = [HEAD]
    for kind, title in (('msg', 'Messages'), ('srv', 'Services'), ('action', 'Actions')):
        sections.append(f'## {title}\n')
        sections += [_entry(path, PARTS[kind])
                     for path in sorted((INTERFACES / kind).glob(f'*.{kind}'))]
    return '\n'.join(sections)


def _entry(path: Path, parts: tuple[str, ...]) -> str:
    about, _, rest = path.read_text().partition('\n\n')
    lines = [f'### {path.stem}\n', *(line.removeprefix('#').strip() for line in about.splitlines()), '']
    for name, part in zip(parts, re.split(r'(?m)^---$', rest), strict=True):
        rows = _rows(part)
        lines += [f'{name}:\n'] if name else []
        lines += ['| field | type | meaning |', '|---|---|---|', *rows, ''] if rows else []
    return '\n'.join(lines)


def _rows(part: str) -> list[str]:
    fields: list[list[str]] = []
    for line in part.splitlines():
        said = re.match(r'([\w/\[\]<>=]+)\s+(\w+)\s*(=\s*[^#\s]+)?\s*(?:#\s*(.*))?$', line)
        if said:
            kind, name, value, meaning = said.groups()
            fields.append([f'{name} {value}' if value else name, kind, meaning or ''])
        elif line.strip().startswith('#') and fields:
            fields[-1][2] = f'{fields[-1][2]} {line.strip().lstrip("# ")}'.strip()
    return [f'| `{name}` | `{kind}` | {meaning.replace("|", "or")} |' for name, kind, meaning in fields]


if __name__ == '__main__':
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / 'docs' / 'messages.md'
    target.write_text(page())
