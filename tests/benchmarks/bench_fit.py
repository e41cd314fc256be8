"""Eight parameters from 60 s at 1 kHz: how long, how far off. Run with `python`, from anywhere."""

from pathlib import Path
import sys
import time

import numpy as np
from speed_table import row

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / 'tests' / 'support'))

from synthetic_recordings import sampled  # noqa: E402

from servo_identify.fit.output_error import fit  # noqa: E402
from servo_twin.description import servo_file  # noqa: E402

TRUTH = {'drive.gain': 0.485, 'drive.torque_constant': 0.48, 'mechanism.rotor_inertia': 1.2e-4,
         'mechanism.load_inertia': 6.0, 'mechanism.stiffness': 4.6e5, 'mechanism.damping': 120.0,
         'effects.coulomb.level': 24.0, 'effects.viscous.slope': 44.0}
GOAL = 10.0  # s on two cores


def command(t: np.ndarray) -> np.ndarray:
    """Return sines, then squares, then a chirp on an offset, V."""
    late = t - 40.0
    return (1.6 * np.sin(2 * np.pi * t) * (t < 20.0)
            + 1.7 * np.sign(np.sin(np.pi * t)) * ((t >= 20.0) & (t < 40.0))
            + (1.2 * np.sin(2 * np.pi * (0.2 + 0.3 * late) * late) + 0.6) * (t >= 40.0))


def main() -> int:
    """Print seconds and errors; 1 when it took longer than the goal."""
    bench = servo_file.load(ROOT / 'config/servos/rv_bench.yaml')
    recording = sampled(bench.with_values(TRUTH), command(np.arange(60_000) * 1e-3))
    begun, worked = time.perf_counter(), time.process_time()
    estimate = fit(bench, [recording], list(TRUTH))
    seconds, worked = time.perf_counter() - begun, time.process_time() - worked
    print(estimate)
    for name, truth in TRUTH.items():
        off = estimate.values[name] / truth - 1.0
        print(f'{name:26} {1e6 * off:9.1f} ppm off the truth')
    print(f'{estimate.iterations} steps, {seconds:.1f} s (goal {GOAL:g} s), '
          f'{worked:.1f} s of processor time')
    row('fit of eight parameters to 60 s at 1 kHz', f'{seconds:.1f} s', f'goal {GOAL:g} s',
        GOAL / seconds)
    return int(seconds > GOAL)


if __name__ == '__main__':
    sys.exit(main())
