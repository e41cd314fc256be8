"""
Make the recordings of this folder: an emulated geared motor with a fan, in three kinds of motion.

    python docs/example/make.py [FOLDER]

The emulated rig shares no law with the twin. Each kind of motion is recorded three times, with
other sensor noise. The same command gives the same files to the last digit.
"""

from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory

import numpy as np
import yaml

HERE = Path(__file__).resolve().parent
DURATION, RATE = 4.0, 500.0  # s, samples a second
FAMILIES = {
    'speed_ladder': ('lowest=0.5', 'highest=12', 'steps=4', 'dwell=0.5', 'acceleration=80'),
    'multisine': ('amplitude=8',),
    'slow_reversals': ('amplitude=2', 'period=2'),
}
# Column of the emulator, its unit, and the decimals that are kept.
COLUMNS = (('t', 's', '%.3f'), ('voltage', 'V', '%.4f'), ('current', 'A', '%.4f'),
           ('motor_position', 'rad', '%.4f'), ('load_position', 'rad', '%.5f'))


def record(family: str, replicate: int, folder: Path) -> Path:
    """Record one motion of the rig; keep the columns that a small logger has."""
    with TemporaryDirectory() as scratch:
        raw = Path(scratch) / 'raw.csv'
        settings = [part for one in FAMILIES[family] for part in ('--setting', one)]
        subprocess.run([sys.executable, '-m', 'servo_rig_driver.emulated.make_recording', family,
                        '--rig', str(HERE / 'rig.yaml'), *settings, '--seed', str(replicate),
                        '--duration', str(DURATION), '--rate', str(RATE), '-o', str(raw)],
                       check=True, stdout=subprocess.DEVNULL)
        table = np.genfromtxt(raw, delimiter=',', names=True)
    path = folder / f'{family}_{replicate}.csv'
    np.savetxt(path, np.column_stack([table[name] for name, *_ in COLUMNS]),
               fmt=[form for *_, form in COLUMNS], delimiter=',', comments='',
               header=','.join(f'{name} [{unit}]' for name, unit, _ in COLUMNS))
    return path


def main(folder: Path) -> None:
    """Record every motion three times into a folder, and list them in recordings.yaml."""
    folder.mkdir(parents=True, exist_ok=True)
    listed = {record(family, replicate, folder).name: {'family': family, 'replicate': replicate}
              for family in FAMILIES for replicate in (1, 2, 3)}
    (folder / 'recordings.yaml').write_text(yaml.safe_dump(listed))


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / 'runs')
