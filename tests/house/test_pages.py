"""Pages point at what is there: links between pages, and the files that the guides name."""

from pathlib import Path
import re

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob('*.md'), *ROOT.glob('docs/*.md')])
OF_THE_TREE = re.compile(r'`((?:src|tests|docs|config|tools|requirements)/[\w./-]+)`')


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_no_link_is_dead(page):
    text = re.sub(r'(?s)```.*?```', '', page.read_text())
    links = [link.partition('#')[0] for link in re.findall(r'\]\(([^)\s]+)\)', text)]
    local = {link for link in links if link and '://' not in link and 'mailto:' not in link}
    assert [link for link in sorted(local) if not (page.parent / link).exists()] == []


def test_the_speed_that_the_readme_promises_is_that_of_its_page():
    promised = re.findall(r'(\d+) times real time', (ROOT / 'README.md').read_text())
    assert promised
    measured = re.findall(r'\| replay of a bag, ten effects, \d.*?\| (\d+) times real time',
                          (ROOT / 'docs/speed.md').read_text())
    assert set(promised) <= set(measured)


@pytest.mark.parametrize('name', ['CONTRIBUTING.md', 'docs/stability.md', 'docs/security.md',
                                  'docs/dependencies.md'])
def test_the_files_that_a_guide_names_are_there(name):
    named = OF_THE_TREE.findall((ROOT / name).read_text())
    assert [one for one in named if not (ROOT / one).exists()] == []
