"""The notebooks run from top to bottom and say what they promise."""

import json
from pathlib import Path

from notebook_cells import run_cells
import pytest

NOTEBOOKS = Path(__file__).resolve().parents[2] / 'docs' / 'notebooks'


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(('name', 'said'), [
    ('own_csv', 'missing quadratic drag at the load shaft (rise 0.0003'),
    ('emulated_bench', 'gravity: 4.0'),
    ('servo_to_mujoco', 'Error that this leaves'),
])
def test_it_runs_and_says(name, said, capsys, monkeypatch):
    monkeypatch.setenv('MPLBACKEND', 'Agg')
    run_cells(NOTEBOOKS / f'{name}.ipynb')
    assert said in ' '.join(capsys.readouterr().out.split())


@pytest.mark.parametrize('path', sorted(NOTEBOOKS.glob('*.ipynb')), ids=lambda path: path.name)
def test_it_is_shipped_with_its_output_and_small(path):
    cells = [one for one in json.loads(path.read_text())['cells'] if one['cell_type'] == 'code']
    assert [one['execution_count'] for one in cells] == list(range(1, len(cells) + 1))
    assert path.stat().st_size < 200_000
