"""
The tree of the packages with one line for each module, from its docstring.

    python tools/module_tree.py            prints it; `make docs` makes a page of it
"""

from __future__ import annotations

import ast
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[1] / 'src'
HEAD = """# Tree

Every module with the first sentence of its docstring, in folders.
"""


def purpose(path: Path) -> str:
    """Return the first paragraph of a module's docstring in one line, empty where it has none."""
    text = ast.get_docstring(ast.parse(path.read_text('utf8'))) or ''
    return ' '.join(text.partition('\n\n')[0].split())


def tree_page() -> str:
    """Return the page in Markdown: a heading and a table for each folder."""
    parts = [HEAD]
    for package in sorted(path.parent for path in SOURCES.glob('*/setup.py')):
        for folder in sorted({path.parent for path in (package / package.name).rglob('*.py')}):
            name = str(folder.relative_to(package))
            about = purpose(folder / '__init__.py') if (folder / '__init__.py').exists() else ''
            rows = [f'| `{path.name}` | {purpose(path).replace("|", chr(92) + "|")} |'
                    for path in sorted(folder.glob('*.py')) if path.name != '__init__.py']
            parts.append(f'## {name}\n\n{about}\n')
            if rows:
                parts.append('\n'.join(['| module | purpose |', '|---|---|', *rows]) + '\n')
    return '\n'.join(parts)


if __name__ == '__main__':
    print(tree_page())
