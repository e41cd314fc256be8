"""Diagnoses of many machines side by side: a folder and a line of one table for each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
import sys

from rich.console import Console
from rich.table import Table
import yaml

from servo_twin.commands.terminal import new_folder

from .cluster import Finished, scattered


def run_all(jobs: Path, folder: Path, address: str = '', workers: int = 0, force: bool = False,
            quiet: bool = False) -> list[Finished]:
    """
    Diagnose the machines that a YAML file names; write a folder for each as it ends.

    The file maps a name to ``servo`` (a servo file), ``bags`` (a list) and, of tables with other
    names, ``mapping`` (a mapping file), all relative to it.
    Returns how each ended; a worker that dies costs its own machine only. Raises ValueError that
    names what is wrong in the file, and where a report is there already without ``force``.
    """
    rigs = read_rigs(jobs)
    new_folder(folder, force, *(f'{name}/report.json' for name in rigs))
    console, ended = Console(stderr=True), {}
    tasks = {name: (str(rig.servo), [*map(str, rig.bags)], str((folder / name).resolve()),
                    str(rig.mapping) if rig.mapping else None) for name, rig in rigs.items()}
    for done in scattered(diagnosed, tasks, address=address, workers=workers):
        ended[done.name] = done
        if done.problem or not quiet:
            console.print(f'{done.name}: {done.problem or done.answer}', markup=False,
                          highlight=False, style='red' if done.problem else '')
    table = Table('machine', 's', 'answer', title=f'{len(ended)} diagnoses', title_justify='left')
    for name in rigs:
        done = ended[name]
        table.add_row(name, f'{done.seconds:.1f}', done.problem or done.answer)
    if not quiet:
        Console(width=None if sys.stdout.isatty() else 140).print(table)
    return [ended[name] for name in rigs]


@dataclass(frozen=True)
class Rig:
    """A machine of a file of jobs."""

    servo: Path
    bags: list[Path]
    mapping: Path | None = None


def read_rigs(path: Path) -> dict[str, Rig]:
    """Return what a file of jobs says of each machine, by its name; raises ValueError."""
    try:
        tree = yaml.safe_load(path.read_text('utf8'))
    except (OSError, yaml.YAMLError) as problem:
        raise ValueError(f'{path}: cannot be read: {problem}') from None
    if not isinstance(tree, dict) or not tree:
        raise ValueError(f'{path}: must map names of machines to servo and bags')
    rigs = {}
    for name, entry in tree.items():
        if not isinstance(entry, dict) or set(entry) - {'mapping'} != {'servo', 'bags'} or (
                not isinstance(entry['bags'], list)):
            raise ValueError(f"{path}: {name} must have 'servo' and a list of 'bags', "
                             f"and may have 'mapping', not {entry!r}")
        mapping = entry.get('mapping')
        rigs[str(name)] = Rig(path.parent / str(entry['servo']),
                              [path.parent / str(bag) for bag in entry['bags']],
                              path.parent / str(mapping) if mapping else None)
    return rigs


def diagnosed(servo: str, bags: list[str], folder: str, mapping: str | None = None) -> str:
    """Diagnose one machine into a folder and return the sentence."""
    from servo_twin.description import servo_file

    from ..data.reading import read_looked_at
    from ..diagnose.diagnose import diagnose
    from ..diagnose.diagnosis_files import write_diagnosis

    given, text = servo_file.load(servo), Path(servo).read_text()
    found = diagnose(read_looked_at(bags, servo, mapping), given)
    output = Path(folder)
    output.mkdir(parents=True, exist_ok=True)
    write_diagnosis(found, text, given, output)
    return str(found.report)
