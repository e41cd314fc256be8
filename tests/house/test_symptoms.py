"""docs/symptoms.md is what its generator writes, and has every effect that a diagnosis names."""

from pathlib import Path
import re
import subprocess
import sys

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / 'docs' / 'symptoms.md'


def test_the_page_and_its_sketches_are_what_the_generator_writes(tmp_path):
    subprocess.run([sys.executable, str(ROOT / 'tools' / 'signatures'), str(tmp_path)], check=True)
    assert (tmp_path / 'symptoms.md').read_text() == PAGE.read_text(), 'python tools/signatures'
    made = {one.name for one in (tmp_path / 'pictures' / 'signatures').iterdir()}
    assert made == {one.name for one in (ROOT / 'docs/pictures/signatures').iterdir()}


def test_each_link_of_a_symptom_has_its_row():
    text = PAGE.read_text()
    links, rows = (set(re.findall(one, text)) for one in (r'\]\(#([\w-]+)\)', r'<a id="([\w-]+)"'))
    assert len(rows) == 49 and links <= rows


def test_each_sketch_of_the_page_is_there():
    pictures = re.findall(r'\]\((pictures/signatures/[\w.]+)\)', PAGE.read_text())
    assert len(pictures) == 49
    assert [one for one in pictures if not (PAGE.parent / one).is_file()] == []
