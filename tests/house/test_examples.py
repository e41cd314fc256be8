"""What the pages have one type: every block runs, or says why it cannot."""

import os
from pathlib import Path
import subprocess

from page_blocks import blocks, program
import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob('*.md'), *ROOT.glob('docs/*.md')])
SHIPPED = ('config', 'docs', 'src', 'tests', 'tools', 'README.md')
SLOW = bool(os.environ.get('SERVO_DOCS_SLOW'))  # set by `make docs-check`


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_a_block_with_commands_says_its_language(page):
    wrong = [f'{page.name}:{one.line}' for one in blocks(page)
             if one.language not in ('sh', 'python', 'text') and one.looks_like_commands]
    assert not wrong, 'write ```sh, and a comment above where it cannot be run'


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_commands_stand_in_a_block(page):
    inside = {n for one in blocks(page)
              for n in range(one.line, one.line + len(one.text.splitlines()) + 2)}
    loose = [f'{page.name}:{n}' for n, line in enumerate(page.read_text().splitlines(), 1)
             if n not in inside and line.startswith(('    servo-', '    python ', '    make '))]
    assert not loose, 'an indented command is not run; write ```sh'


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.timeout(1600 if SLOW else 300)
@pytest.mark.parametrize('page', [one for one in PAGES if program(one, SLOW)],
                         ids=lambda page: page.name)
def test_what_a_page_has_one_type_runs(page, tmp_path):
    for name in SHIPPED:
        (tmp_path / name).symlink_to(ROOT / name)
    said = subprocess.run(['bash', '-c', program(page, SLOW)], cwd=tmp_path, capture_output=True,
                          text=True, timeout=1500 if SLOW else 280,
                          env={**os.environ, 'MPLBACKEND': 'Agg', 'COLUMNS': '100'})
    assert said.returncode == 0, f'{said.stdout[-2000:]}\n{said.stderr[-3000:]}'


def test_a_mark_is_read_from_the_line_above(tmp_path):
    page = tmp_path / 'page.md'
    page.write_text('```sh\na\n```\n\n<!-- slow -->\n```sh\nb\n```\n<!-- not run: hardware -->\n\n'
                    '```python\nc\n```\nText.\n\n```\nd\n```\n')
    assert [(one.runs, one.slow, one.text) for one in blocks(page)] == [
        (True, False, 'a\n'), (True, True, 'b\n'), (False, False, 'c\n'), (False, False, 'd\n')]
    assert 'b' not in program(page, slow=False) and 'b' in program(page, slow=True)
