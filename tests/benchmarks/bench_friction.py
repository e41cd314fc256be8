"""
Network friction trained to its plateau: how long, and how flat. Run with `python`, from anywhere.

The network of paper 000 (2-30-1) on 10 000 samples of a friction over angle and speed, by
Levenberg-Marquardt, and with --learners those of paper 003 (they take torch) on a ladder of
speeds. The plateau of a course is where the validation loss has fallen to within 5 % of the best
that it reaches.
"""

import argparse
from pathlib import Path
import sys
import time

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / 'tests' / 'support'))

from servo_identify.learn.error_scores import scores_of  # noqa: E402
from servo_identify.learn.friction.friction_dataset import dataset_of  # noqa: E402
from servo_identify.learn.friction.friction_network import trained  # noqa: E402
from servo_identify.learn.friction.friction_samples import friction_of  # noqa: E402
from servo_identify.learn.friction.learners import learner, names  # noqa: E402

GOAL = 60.0  # s
NOISE = 0.1  # N m


class Course:
    """Validation losses and when they were told."""

    def __init__(self) -> None:
        self.begun, self.worked = time.perf_counter(), time.process_time()
        self.points: list[tuple[float, float]] = []

    def __call__(self, step: int, loss: float, held: float) -> None:
        self.points.append((time.perf_counter() - self.begun, held))

    def ended(self) -> tuple[float, float]:
        """Return the seconds and the processor seconds since it began."""
        return time.perf_counter() - self.begun, time.process_time() - self.worked

    def plateau(self) -> float:
        """Return the seconds until the loss was within 5 % of the best one reached."""
        best = min(held for _, held in self.points)
        return next(at for at, held in self.points if held <= 1.05 * best)


def told(name: str, course: Course, rmse: float) -> float:
    """Print one line and return the seconds to the plateau."""
    ended, worked = course.ended()
    print(f'{name:20} plateau after {course.plateau():6.1f} s, ended after {ended:6.1f} s '
          f'({worked:.1f} s of processor time), {len(course.points):4} steps, '
          f'RMSE on rows kept back {rmse:.4f} N m', flush=True)
    return course.plateau()


def paper_network() -> float:
    """Train the network of paper 000; return its seconds to the plateau."""
    rng = np.random.default_rng(0)
    angle, speed = rng.uniform(0.0, 2.0 * np.pi, 10_000), rng.uniform(0.02, 0.6, 10_000)
    level = (22.0 + 30.0 * speed + 5.0 * np.exp(-speed / 0.05) + 2.0 * np.cos(angle)
             + 0.5 * np.sin(3.0 * angle))
    target = level + NOISE * rng.standard_normal(len(level))
    held = rng.random(len(level)) < 0.2
    course = Course()
    network = trained(angle, speed, target, held=held, told=course)
    return told('paper 000, 2-30-1', course,
                float(np.sqrt(np.mean((network(angle, speed) - level)[held] ** 2))))


def learners(chosen: list[str]) -> float:
    """Train learners of paper 003 on a ladder of speeds; return the longest plateau, s."""
    from test_friction import BENCH, turns

    data = dataset_of(friction_of(BENCH, [turns(v) for v in (0.15, 0.25, 0.35, 0.5)], 'load'))
    longest = 0.0
    for name in chosen:
        course = Course()
        model = learner(name)(data, 0, GOAL, course)
        error = scores_of(data.target[data.test], model.predict(data, data.test)).rmse
        if course.points:  # the others are solved in one go
            longest = max(longest, told(name, course, error))
    return longest


def main() -> int:
    """Print seconds to the plateau; 1 when one took longer than the goal."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--learners', nargs='*', choices=names(), help='all where none is named')
    chosen = parser.parse_args().learners
    longest = paper_network()
    if chosen is not None:
        longest = max(longest, learners(chosen or list(names())))
    print(f'longest {longest:.1f} s (goal {GOAL:g} s)')
    return int(longest > GOAL)


if __name__ == '__main__':
    sys.exit(main())
