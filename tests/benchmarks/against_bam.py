"""
Runs BAM's search for bench_against.py, under an interpreter that has it.

Its models, bounds, simulator and mean absolute error, over windows that begin in measured states
and get the recorded voltage; CMA-ES with restarts as in bam.fit. Prints as its last line, in JSON,
seconds of search and held-out error, rad, at each trial that was better on the training windows.
"""

import json
from pathlib import Path
import sys
import time

try:
    from bam.actuators import actuators
    from bam.model import models
    from bam.simulate import Simulator
    import numpy as np
    import optuna
except ImportError:
    sys.exit(3)

PENDULUM = {'mass': 0.49, 'arm_mass': 0.0, 'length': 0.1, 'kp': 400, 'vin': 7.3}


class Windows:
    """Windows side by side, as a batch of BAM's logs."""

    def __init__(self, rows: list[dict], period: float) -> None:
        self.period = period
        self.angle = np.array([row['angle'] for row in rows])
        self.speed = np.array([row['speed'] for row in rows])
        self.voltage = np.array([row['voltage'] for row in rows]).T
        self.position = np.array([row['position'] for row in rows]).T

    def errors(self, model) -> np.ndarray:
        """Return simulated minus measured positions, (samples, windows)."""
        simulator = Simulator(model)
        model.actuator.load_log(PENDULUM)
        simulator.reset(self.angle, self.speed)
        positions = np.empty_like(self.position)
        for k, voltage in enumerate(self.voltage):
            positions[k] = simulator.q
            simulator.step(voltage, True, self.period)
        return positions - self.position


def main() -> None:
    """Search and print the course."""
    problem = json.loads(Path(sys.argv[1]).read_text())
    train, held = (Windows(problem[part], problem['period']) for part in ('train', 'held'))
    course, best, aside = [], np.inf, 0.0
    begun = time.perf_counter()

    def objective(trial) -> float:
        nonlocal best, aside
        model = models[problem['model']]()
        model.set_actuator(actuators['xl330']())
        for name, parameter in model.get_parameters().items():
            if parameter.optimize:
                parameter.value = trial.suggest_float(name, parameter.min, parameter.max)
        score = float(np.mean(np.abs(train.errors(model))))
        if score < best:
            best, at = score, time.perf_counter()
            course.append((at - begun - aside, float(np.sqrt(np.mean(held.errors(model) ** 2)))))
            aside += time.perf_counter() - at
        return score

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    try:
        sampler = optuna.samplers.CmaEsSampler(seed=1, restart_strategy='bipop')
    except (TypeError, ValueError):  # later versions leave restarts to others
        sampler = optuna.samplers.CmaEsSampler(seed=1)
    optuna.create_study(sampler=sampler).optimize(objective, n_trials=problem['trials'])
    course.append((time.perf_counter() - begun - aside, course[-1][1]))
    print(json.dumps(course))


if __name__ == '__main__':
    main()
