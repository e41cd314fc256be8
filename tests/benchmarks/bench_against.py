"""
Time to the same held-out error on the XL330: this fit, BAM's search, MuJoCo's sysid.

All three get the same windows of one second (start angle, start speed, voltage, angle) of three
recordings, and are judged, each in its own simulator, on the windows of three others. BAM searches
as its own fit does: its models and simulator, CMA-ES with restarts over thousands of trials.

    python tests/benchmarks/bench_against.py [--python OTHER/bin/python] [--trials N] [--data DIR]

BAM needs Python 3.12, and neither tool belongs to this workspace. An environment for both:

    python3.12 -m venv OTHER
    OTHER/bin/pip install better-actuator-models optuna cmaes 'mujoco[sysid]==3.17.0'
"""

import argparse
import json
from pathlib import Path
import subprocess
import sys
import tempfile
import time

import numpy as np

from servo_identify.fit.output_error import fit
from servo_identify.fit.segments import smoothed
from servo_studies.real_machines.xl330 import HELD_OUT, recording_of, servos, TRAINED
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import Recording

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[2] / 'shared' / 'data'
PERIOD, WINDOW = 0.005, 1.0  # s; 5 ms is what BAM resamples its recordings to
BEGINNING = {'drive.torque_constant': 0.36, 'mechanism.rotor_inertia': 0.005,
             'effects.coulomb.level': 0.05, 'effects.viscous.slope': 0.1}
"""Friction and inertia as BAM's parameters begin; the torque constant by the data sheet."""
MODELS = {'m1': 'coulomb_viscous', 'm3': 'load_dependent'}
TOOLS = {'bam': ('against_bam.py', 'better-actuator-models optuna cmaes'),
         'mujoco.sysid': ('against_mujoco.py', "'mujoco[sysid]==3.17.0'")}


def gridded(data: Path, name: str) -> Recording:
    """Return a recording of the shared data at BAM's period."""
    recording = recording_of(data, name)
    known = np.flatnonzero(np.isfinite(recording['voltage'])
                           & np.isfinite(recording['motor_position']))
    t = np.arange(len(recording)) * recording.period
    grid = np.arange(t[known[0]], t[known[-1]], PERIOD)
    columns = {c: np.interp(grid, t[known], recording[c][known]) if recording.has(c)
               else np.full(len(grid), np.nan) for c in recording.columns}
    return Recording(name, PERIOD, columns, digest=recording.digest)


def windows(recording: Recording) -> list[dict]:
    """Return the whole windows of a recording: start angle and speed, voltage, angle."""
    angle = smoothed(recording['motor_position'], PERIOD)
    speed, size = np.gradient(angle, PERIOD), round(WINDOW / PERIOD)
    return [{'angle': angle[a], 'speed': speed[a],
             'voltage': recording['voltage'][a:a + size].tolist(),
             'position': recording['motor_position'][a:a + size].tolist()}
            for a in range(0, len(recording) - size + 1, size)]


def error(servo: Servo, parts: list[dict]) -> float:
    """Return the root mean square error of simulated positions over windows, rad."""
    squares = []
    for part in parts:
        u = np.full(len(part['voltage']), np.nan)
        columns = {c: u for c in ('external_torque', 'reference_velocity', 'reference_position',
                                  'temperature', 'load_position', 'motor_position', 'current',
                                  'torque', 'current_reference')}
        x = initial_state(servo, part['angle'], part['angle'], load_speed=part['speed'])
        y = simulate(servo, inputs_of({**columns, 'voltage': np.array(part['voltage'])}), PERIOD,
                     x)
        squares.append(np.mean((y[:, 0] - part['position']) ** 2))
    return float(np.sqrt(np.mean(squares)))


def ours(recordings: list[Recording], held: list[dict], model: str) -> list[tuple[float, float]]:
    """Return seconds and held-out error of a fit, begun where the others begin."""
    servo, free = servos()[MODELS[model]]
    servo = servo.with_values(BEGINNING)
    begun = time.perf_counter()
    estimate = fit(servo, recordings, free, tolerance=False, horizon=WINDOW)
    return [(time.perf_counter() - begun, error(estimate.servo, held))]


def theirs(tool: str, python: str, problem: dict) -> list[tuple[float, float]] | str:
    """Return the course of another tool, run by another interpreter; or why there is none."""
    script, needs = TOOLS[tool]
    with tempfile.TemporaryDirectory() as folder:
        asked = Path(folder, 'problem.json')
        asked.write_text(json.dumps(problem))
        done = subprocess.run([python, str(HERE / script), str(asked)], capture_output=True,
                              text=True, env={'OMP_NUM_THREADS': '1', 'PATH': '/usr/bin:/bin'})
    if done.returncode == 3:
        return f'not installed for {python}: pip install {needs} there, see --help'
    if done.returncode:
        return f'failed: {done.stderr.strip().splitlines()[-1]}'
    return [tuple(point) for point in json.loads(done.stdout.splitlines()[-1])]


def main() -> int:
    """Print the table; 1 when another tool was faster to the same error."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--python', default=sys.executable, help='interpreter of the other tools')
    parser.add_argument('--trials', type=int, default=3000, help='of BAM (its default: 100000)')
    parser.add_argument('--data', type=Path, default=DATA, help='folder with xl330/*.json')
    arguments = parser.parse_args()
    if not (arguments.data / 'xl330').is_dir():
        print(f'skipped: there are no recordings in {arguments.data}/xl330')
        return 0
    recordings = [gridded(arguments.data, name) for name in TRAINED]
    train = [w for r in recordings for w in windows(r)]
    held = [w for name in HELD_OUT for w in windows(gridded(arguments.data, name))]
    slower = False
    print(f'{len(train)} windows of {WINDOW:g} s to train, {len(held)} held out')
    for model, friction in MODELS.items():
        fit(*_warm(model, recordings), tolerance=False, horizon=WINDOW, iterations=1)
        courses = {'servo-identify': ours(recordings, held, model)}
        for tool in TOOLS:
            if tool == 'mujoco.sysid' and model != 'm1':
                continue  # its joints know Coulomb and viscous friction only
            courses[tool] = theirs(tool, arguments.python, {
                'model': model, 'period': PERIOD, 'train': train, 'held': held,
                'begin': BEGINNING, 'trials': arguments.trials})
        slower |= show(f'{friction.replace("_", "-")} friction (BAM: {model})', courses)
    return int(slower)


def _warm(model: str, recordings: list[Recording]) -> tuple:
    """Compile before the clock runs, as on every call but the first of a machine."""
    servo, free = servos()[MODELS[model]]
    return servo, recordings[:1], free


def show(title: str, courses: dict) -> bool:
    """Print one table; return whether another tool reached the common error sooner."""
    ran = {tool: course for tool, course in courses.items() if not isinstance(course, str)}
    common = 1.01 * max(course[-1][1] for course in ran.values())
    print(f'\n{title}; all reach {common:.4f} rad (within 1 %)')
    print(f'{"":16}{"final, rad":>12}{"final, s":>10}{"to common, s":>14}')
    sooner = {}
    for tool, course in courses.items():
        if tool not in ran:
            print(f'{tool:16}{course}')
            continue
        sooner[tool] = next(at for at, left in course if left <= common)
        print(f'{tool:16}{course[-1][1]:12.4f}{course[-1][0]:10.2f}{sooner[tool]:14.2f}')
    return min(sooner.values()) < sooner['servo-identify']


if __name__ == '__main__':
    sys.exit(main())
