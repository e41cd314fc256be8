"""A table of a gear motor, and `init` of it, for the tests of both."""

from functools import cache
from pathlib import Path

import numpy as np

from servo_identify.cli import main

GIVEN = ['--drive', 'voltage', '--resistance', '2100 mohm', '--back-emf', '212 rpm/V',
         '--torque-constant', '45 mN m/A', '--rotor-inertia', '320 g cm2', '--load-inertia',
         '120 kg cm2', '--ratio', '50', '--no-questions']
COUNT = 2.0 * np.pi / 4096


@cache
def gear_motor() -> dict[str, np.ndarray]:
    """Return time, u, i, theta, q of a motor under a position loop, 4 s at 500 Hz, in SI units."""
    period, ratio, inertia = 1e-4, 50.0, 3.2e-5 + 0.012 / 2500
    time = np.arange(0.0, 4.0, period)
    angle = speed = command = 0.0
    rows = []
    for k, t in enumerate(time):
        if k % 20 == 0:
            target = 0.6 * np.sin(2.5 * t) + 0.3 * np.sin(8.0 * t)
            command = float(np.clip(60.0 * (target - angle / ratio), -24.0, 24.0))
        current = (command - 0.045 * speed) / 2.1
        if k % 20 == 0:
            rows.append((t, command, current, round(angle / COUNT) * COUNT, angle / ratio))
        friction = 0.004 * np.tanh(2.0 * speed) + 2e-5 * speed
        speed += period * (0.045 * current - friction) / inertia
        angle += period * speed
    return dict(zip(('time', 'u', 'i', 'theta', 'q'), np.array(rows).T, strict=True))


def write(path: Path, columns: dict[str, np.ndarray], delimiter: str = ',', decimal: str = '.',
          names: bool = True) -> Path:
    """Write columns as text; without ``names`` the numbers alone."""
    lines = [delimiter.join(columns)] if names else []
    lines += [delimiter.join(f'{v:.9g}'.replace('.', decimal) for v in row)
              for row in zip(*columns.values(), strict=True)]
    path.write_text('\n'.join(lines) + '\n')
    return path


def init(data: Path, folder: Path, *more: str) -> int:
    """Run `init` with the values of the motor; the files are new/s.yaml and new/m.yaml."""
    return main(['init', str(data), '-o', str(folder / 'new' / 's.yaml'), '--mapping-out',
                 str(folder / 'new' / 'm.yaml'), *GIVEN, *more])
