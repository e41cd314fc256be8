"""What the bags of a soak hold: readable, in order, and every lost sample told."""

from __future__ import annotations

from pathlib import Path
import subprocess
import sys

from answers import Answers
import numpy as np

from servo_twin.bag import read_recording
from servo_twin.bag.bag_writing import BagError

PERIOD = 1e-3  # s between samples of the bench


def judged(bags: list[Path], faults: list[tuple[float, float]], answers: Answers) -> dict:
    """
    Return what the bags hold: ``samples``, ``holes``, those outside any fault, and the untold.

    ``faults`` are the stretches (s of the machine's clock) in which samples may be missing. A lost
    sample is told where the running number jumps as far as the clock does; ``answers`` tell
    whether a number is that of the SYNC.
    """
    told = {'bags': len(bags), 'read': 0, 'samples': 0, 'holes': 0, 'missing': 0,
            'elsewhere': [], 'untold': [], 'unreadable': [], 'empty': 0}
    for path in bags:
        if not any(path.glob('*.mcap')) if path.exists() else True:
            told['empty'] += 1
            continue
        try:
            places = _stretches(path)
        except (BagError, ValueError, OSError) as error:
            if 'no samples' in str(error) or 'no message' in str(error):
                told['empty'] += 1
            else:
                told['unreadable'].append(f'{path.name}: {error}')
            continue
        told['read'] += 1
        for sequence, stamps, angle in places:
            told['samples'] += len(sequence)
            told['untold'] += [f'{path.name}: {said}'
                               for said in untold(sequence, stamps, angle, answers)]
            jumps = np.flatnonzero(np.diff(sequence) != 1)
            for k in jumps:
                missing = int(sequence[k + 1] - sequence[k] - 1)
                told['holes'] += 1
                told['missing'] += max(0, missing)  # a new driver begins its numbers again
                if not any(a <= stamps[k + 1] and stamps[k] <= b for a, b in faults):
                    told['elsewhere'].append(
                        f'{path.name}: {missing} samples at {stamps[k]:.2f} s, outside any fault')
    return told


def untold(sequence: np.ndarray, stamps: np.ndarray, angle: np.ndarray,
           answers: Answers) -> list[str]:
    """
    Return where samples are missing that the running number does not tell.

    Within one life of a driver, number and stamp go on together, and a sample has the number of
    the SYNC that it answers.
    """
    found = []
    for life in np.split(np.arange(len(sequence)), np.flatnonzero(np.diff(sequence) < 0) + 1):
        jumps = np.diff(stamps[life]) / PERIOD - np.diff(sequence[life])
        found += [f'{step:.1f} samples at {stamps[life][k]:.2f} s, by its stamp'
                  for k, step in enumerate(jumps) if abs(step) > 0.5]
    return found + answers.misnumbered(sequence, stamps, angle)


def _stretches(path: Path) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return (running numbers, instants in s, load angles in rad) of the encoder of a bag."""
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader
    from rosbags.typesys import get_types_from_msg, get_typestore, Stores
    store = get_typestore(Stores.ROS2_JAZZY)
    numbers, stamps, angles, known = [], [], [], False
    read_recording(path)  # ours reads it too
    with next(path.glob('*.mcap')).open('rb') as file:
        try:
            # in the order of the file: sorted, nothing of a bag that was cut would come
            for schema, channel, message in NonSeekingReader(file).iter_messages(
                    log_time_order=False):
                if not channel.topic.endswith('/encoder'):
                    continue
                if not known:
                    definition = schema.data.decode()
                    store.register(get_types_from_msg(definition, schema.name))
                    known = True
                block = store.deserialize_cdr(message.data, schema.name)
                count = len(block.motor_position)
                begin = block.header.stamp.sec + 1e-9 * block.header.stamp.nanosec
                numbers.append(block.sequence + np.arange(count))
                stamps.append(begin + block.period * np.arange(count))
                angles.append(np.asarray(block.load_position))
        except (McapError, EOFError):
            pass  # cut by a kill: what stands before the cut counts
    if not numbers:
        return []
    return [(np.concatenate(numbers).astype(np.int64), np.concatenate(stamps),
             np.concatenate(angles))]


def replayed(bags: list[Path]) -> list[tuple[str, bool, str]]:
    """
    Return (bag, whether a replay gives the bits of the live run, what it said) of each bag.

    A replay begins where the bag does. It can say the same only where the twin began there too.
    """
    found = []
    for path in bags:
        ran = subprocess.run([sys.executable, '-m', 'servo_twin.cli', 'replay', str(path),
                              '--compare'], capture_output=True, text=True, timeout=300.0,
                             check=False)
        last = ([*ran.stderr.strip().splitlines(), *ran.stdout.strip().splitlines()[-1:]]
                or [''])[0]
        found.append((path.name, 'identical' in last, last))
    return found
