"""Run the notebooks of docs/notebooks and keep their output in them: ``python tools/run_notebooks.py``."""

from __future__ import annotations

from pathlib import Path
import sys

from nbclient import NotebookClient
import nbformat

FOLDER = Path(__file__).resolve().parents[1] / 'docs' / 'notebooks'


def run(path: Path) -> None:
    """Run a notebook in its folder and write it back; whole pages in frames are left out."""
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=600, resources={'metadata': {'path': str(path.parent)}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop('execution', None)
        for output in cell.get('outputs', ()):
            if '<iframe' in output.get('data', {}).get('text/html', ''):
                output['data'].pop('text/html')
    notebook.metadata['language_info'] = {'name': 'python'}
    nbformat.write(notebook, path)


if __name__ == '__main__':
    for one in map(Path, sys.argv[1:]) if sys.argv[1:] else sorted(FOLDER.glob('*.ipynb')):
        run(one)
        print(one.name)
