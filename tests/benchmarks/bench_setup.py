"""
The set-up from nothing: seconds and size of `make setup` in a copy of the tracked files.

Run with `python`; it needs the network, as the set-up does. The copy is removed.
"""

from pathlib import Path
import subprocess
import tempfile
from time import perf_counter

from speed_table import row

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    """Print how long it took and what it brought."""
    names = subprocess.run(['git', 'ls-files', '-z'], cwd=ROOT, capture_output=True,
                           check=True).stdout
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(['xargs', '-0', 'cp', '--parents', '-t', folder], cwd=ROOT, input=names,
                       check=True)
        begun = perf_counter()
        subprocess.run(['sh', 'tools/setup.sh'], cwd=folder, check=True)
        seconds = perf_counter() - begun
        size = int(subprocess.run(['du', '-sm', '.venv'], cwd=folder, capture_output=True,
                                  text=True, check=True).stdout.split()[0])
    row('set-up from nothing, download included', f'{seconds:.0f} s, {size} MB in `.venv`',
        '`make training` brings 0.75 GB more')


if __name__ == '__main__':
    main()
