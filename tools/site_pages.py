"""
What the site has beside the pages of docs/: a hook of mkdocs.

README, CONTRIBUTING and CHANGELOG become pages, notebooks become pages with their output, and the
Python API a page of mkdocstrings. Formulas become MathML, which browsers show without a script.
"""

from __future__ import annotations

from pathlib import Path
import re
import sys
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter

sys.path.insert(0, str(Path(__file__).parent))

from module_tree import tree_page

ROOT = Path(__file__).resolve().parents[1]
API = """# Python API

`import servo_identify as si` offers these names. [python.md](../python.md) shows them at work.

## Calls

::: servo_identify.api.calls

## Servo files

::: servo_identify.api.servo_text.ServoFile

## Recordings

::: servo_identify.api.recordings.Recordings

::: servo_twin.recording.recording.Recording

## Results

::: servo_identify.api.answers
"""
ROOT_PAGES = {'index.md': 'README.md', 'CONTRIBUTING.md': 'CONTRIBUTING.md',
              'CHANGELOG.md': 'CHANGELOG.md'}


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that lie elsewhere or are made."""
    pages = {target: (ROOT / source).read_text() for target, source in ROOT_PAGES.items()}
    pages |= {'reference/api.md': API, 'reference/tree.md': tree_page()}
    for target, text in pages.items():
        files.append(File.generated(config, target, content=text))
    for path in sorted((ROOT / 'docs' / 'notebooks').glob('*.ipynb')):
        text, more = MarkdownExporter().from_filename(str(path))
        for name, data in more['outputs'].items():
            picture = f'notebooks/{path.stem}_{name}'
            text = text.replace(f'({name})', f'({path.stem}_{name})')
            files.append(File.generated(config, picture, content=data))
        files.append(File.generated(config, f'notebooks/{path.stem}.md', content=text))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Point links at pages of the site, and turn formulas into MathML."""
    if page.file.src_uri in ROOT_PAGES:
        markdown = markdown.replace('](docs/', '](')
    markdown = re.sub(r'\]\(\.\./(CONTRIBUTING|CHANGELOG)\.md', r'](\1.md', markdown)
    markdown = markdown.replace('](../README.md', '](index.md')
    markdown = re.sub(r'(\]\(notebooks/\w+)\.ipynb\)', r'\1.md)', markdown)
    parts = re.split(r'(?ms)(^```(?!math).*?^```$|`[^`\n]+`)', markdown)
    return ''.join(part if k % 2 else _with_formulas(part) for k, part in enumerate(parts))


def on_page_content(html: str, **_: Any) -> str:
    """Show the roles of docstrings, as in :func:`name`, as code alone."""
    return re.sub(r':(?:func|class|meth|mod|data|attr):(?=<code>)', '', html)


def _with_formulas(text: str) -> str:
    text = re.sub(r'(?ms)^```math\n(.*?)^```$', lambda m: f'\n{_formula(m[1], "block")}\n', text)
    text = re.sub(r'(?s)\$\$(.+?)\$\$', lambda m: _formula(m[1], 'block'), text)
    return re.sub(r'\$([^$\n]+)\$', lambda m: _formula(m[1], 'inline'), text)


def _formula(latex: str, display: str) -> str:
    shown = convert(' '.join(latex.split()), display=display).replace('\n', ' ')
    # Markdown takes a line that begins with <math> for a block.
    return f'<span>{shown}</span>' if display == 'inline' else shown
