"""
The diagnosis on recordings of real machines, over random splits of each.

    python tests/benchmarks/bench_real_splits.py FOLDER [--splits 10] [--machine xl330 ...]

FOLDER holds the recordings as their authors published them. Recordings of a machine are drawn into
those that select, accept and report; a machine with one recording is cut into six pieces first.
Prints what each split named, and in how many the published effect came first or in a set of two.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from servo_identify.data.table_import import import_table
from servo_twin.description import servo_file
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

CONFIG = Path(__file__).resolve().parents[2] / 'config'
PIECES = 6
UR10E = """
servo: ur10e_joint
drive: {{type: current, gain: 1.0, torque_constant: {constant}}}
mechanism: {{type: rigid, rotor_inertia: {inertia}, load_inertia: 0.0, ratio: 1.0}}
sensors:
  motor_encoder: {{noise: 5.0e-5}}
  current_sensor: {{noise: 0.05}}
effects:
  viscous: {{effect: viscous_friction, at: motor, slope: {viscous}}}
  {more}
tolerance: {{mechanism.rotor_inertia: 50 %, effects.viscous.slope: [0.0, 200.0]}}
"""

VACUUM_AXIS = """
servo: vacuum_axis
step: 0.0005
drive: {type: current, gain: 1.0, torque_constant: 1.0}
mechanism: {type: rigid, ratio: 1.0, rotor_inertia: 0.01, load_inertia: 10.0}
controller: {type: none}
sensors: {motor_encoder: {noise: 1.4e-6}, load_encoder: {noise: 7.8e-7}}
"""


@dataclass(frozen=True)
class Machine:
    """Recordings of one machine, a servo file that is short of something, and what that is."""

    name: str
    published: str
    servo: Servo
    recordings: tuple[Recording, ...]


def pieces(recording: Recording) -> tuple[Recording, ...]:
    """Cut one recording into pieces of equal length."""
    edges = np.linspace(0, len(recording), PIECES + 1).astype(int)
    return tuple(replace(
        recording, name=f'{recording.name}[{k}]', replicate=k, start=first * recording.period,
        digest=f'{k}{recording.digest}'[:64],
        columns={n: np.ascontiguousarray(c[first:last]) for n, c in recording.columns.items()})
        for k, (first, last) in enumerate(zip(edges[:-1], edges[1:], strict=True)))


def ur10e(folder: Path, joint: int) -> Machine:
    """
    Return a joint of the robot arm whose twin has inertia, weight and viscous friction alone.

    Their values are those of least squares of the torque over the recording, as somebody has them
    who fitted this twin: inertia (kg m2), slope (N m s/rad), weight (N m).
    """
    table = np.loadtxt(folder / 'ur10e' / f'joint_{joint}.csv', delimiter=',')
    period = float(np.median(np.diff(table[:, 0])))
    grid = np.arange(table[0, 0], table[-1, 0], period)
    at = {'motor_position': joint, 'current': 12 + joint}
    columns = {n: np.interp(grid, table[:, 0], table[:, c]) for n, c in at.items()}
    constant, inertia, viscous, more = {
        1: (14.87, 8.4, 59.5, ''),
        3: (12.0, 6.7, 22.2, '{effect: gravity, at: load, cosine: -1.1, sine: 53.0}'),
        6: (10.0, 0.44, 9.6, '')}[joint]
    servo = servo_file.loads(UR10E.format(
        constant=constant, inertia=inertia, viscous=viscous,
        more=f'weight: {more}' if more else ''))
    one = Recording(f'joint_{joint}', period, columns, family='joint', servo=servo.name,
                    digest=f'{joint:064x}')
    return Machine(f'ur10e joint {joint}', 'coulomb_friction', servo, pieces(one))


def vacuum_axis(folder: Path) -> Machine:
    """Return the axis of a vacuum tank: two encoders, 24 to 28 mdeg lost at each reversal."""
    servo, runs = servo_file.loads(VACUUM_AXIS), []
    for number, name in enumerate(('n10', 'n20', 'p10', 'p20')):
        table = np.loadtxt(folder / 'bifrost' / f'{name}.csv', delimiter=',', skiprows=1)
        motor, load = np.radians(table[:, 1:]).T
        runs.append(Recording(
            name, 0.01, {'motor_position': motor, 'load_position': load}, family='move',
            replicate=number, servo=servo.name, digest=f'{number:064x}'))
    return Machine('vacuum axis, two encoders alone', 'backlash', servo, tuple(runs))


@cache
def machines(folder: Path) -> tuple[Machine, ...]:
    """Return the machines of the folder of recordings."""
    several: list[Machine] = []
    emps = CONFIG / 'servos' / 'emps.yaml'
    viscous = servo_file.load(emps).without_effects(lambda placed: placed.name == 'coulomb')
    for name in ('DATA_EMPS', 'DATA_EMPS_PULSES'):
        one = import_table(folder / 'emps' / f'{name}.mat', emps,
                           mapping=CONFIG / 'imports' / 'emps.yaml')
        several.append(Machine(name, 'coulomb_friction', viscous, pieces(replace(one, name=name))))
    xl330 = CONFIG / 'servos' / 'xl330.yaml'
    runs = [replace(import_table(path, xl330, mapping=CONFIG / 'imports' / 'xl330.yaml'),
                    name=path.stem, family=path.stem.partition('_')[2])
            for path in sorted(folder.glob('xl330*/*.json'))]
    servo = servo_file.load(xl330)
    for gain in ('kp100', 'kp200', 'kp400', 'kp'):
        several.append(Machine(f'xl330 {gain if gain != "kp" else "all gains"}',
                               'load_dependent_friction', servo,
                               tuple(one for one in runs if one.name.startswith(gain))))
    two_mass = CONFIG / 'servos' / 'two_mass.yaml'
    one = import_table(folder / 'two_mass' / 'MultisineTypeA.mat', two_mass,
                       mapping=CONFIG / 'imports' / 'two_mass.yaml')
    several.append(Machine('two masses', 'stiffness_error', servo_file.load(two_mass),
                           pieces(one)))
    several += [ur10e(folder, joint) for joint in (1, 3, 6)]
    several.append(vacuum_axis(folder))
    return tuple(several)


def splits(machine: Machine, count: int) -> Iterator[tuple[list[Recording], ...]]:
    """Yield (select, accept, report), drawn at random: a quarter each for the last two."""
    chance = np.random.default_rng(0)
    for _ in range(count):
        order = [machine.recordings[k] for k in chance.permutation(len(machine.recordings))]
        held = max(1, len(order) // 4)
        yield order[2 * held:], order[:held], order[held:2 * held]


def answered(folder: Path, number: int, turn: int, count: int) -> tuple[str, str]:
    """Return (first, in a set of two, listed, missed or refused; what was said) of one split."""
    from servo_identify.diagnose.checks import CannotDiagnose
    from servo_identify.diagnose.diagnose import diagnose

    machine = machines(folder)[number]
    select, accept, report = list(splits(machine, count))[turn]
    try:
        found = diagnose(select, machine.servo, accept, report).report
    except CannotDiagnose as problem:
        return 'refused', str(problem)
    said = '; '.join(
        f'{one.effect}/{one.site} {one.shrink_realised:.0%}'
        + (f' (or {", ".join(one.ambiguous_with)})' if one.ambiguous_with else '')
        for one in found.which)
    said = f'{found.verdict["status"]}, {found.gap["shrink"]:.0%} gone: {said or "nothing"}'
    return word_for(machine.published, found.which), said


def word_for(published: str, which) -> str:
    """Return where the published effect stands in an answer."""
    if not which:
        return 'missed'
    if which[0].effect == published:
        return 'first'
    if list(which[0].ambiguous_with) == [published]:
        return 'in a set of two'
    listed = {one.effect for one in which} | {n for one in which for n in one.ambiguous_with}
    return 'listed' if published in listed else 'missed'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('folder', type=Path)
    parser.add_argument('--splits', type=int, default=10)
    parser.add_argument('--machine', nargs='+', default=[''], help='parts of their names')
    parser.add_argument('--processes', type=int, default=2)
    told = parser.parse_args()
    words = ('first', 'in a set of two', 'listed', 'missed', 'refused')
    table = []
    with ProcessPoolExecutor(told.processes) as pool:
        for number, machine in enumerate(machines(told.folder)):
            if not any(part in machine.name for part in told.machine):
                continue
            waiting = [pool.submit(answered, told.folder, number, turn, told.splits)
                       for turn in range(told.splits)]
            answers = [one.result() for one in waiting]
            for word, said in answers:
                print(f'{machine.name:<18}{word:<17}{said}', flush=True)
            counts = [sum(word == kind for word, _ in answers) for kind in words]
            table.append(f'| {machine.name} | {machine.published} | '
                         + ' | '.join(map(str, counts)) + ' |')
    print(f'\n| machine | published | {" | ".join(words)} |')
    print('|---|---|' + '---|' * len(words), *table, sep='\n')


if __name__ == '__main__':
    main()
