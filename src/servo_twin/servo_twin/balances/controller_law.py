"""A servo's control law over what a rig measured: the command that the rig should have given."""

from __future__ import annotations

import hashlib
import importlib
import os
import sys
from types import FunctionType

import numpy as np

from ..physics.kernel import cache_folder, kernel_of
from ..physics.servo import Servo
from ..physics.state import CONTROLLER_SIZE
from ..recording.joined_samples import CHANNELS, control_values, reference_of

FOLLOW = 1.0  # s, within which the law's integral follows the rig's, whose beginning is unknown
_FORGOTTEN = 12.0  # time constants of the speed filter until 6e-6 is left of how it began

_TEMPLATE = '''"""Generated from the structure of a servo; do not edit."""
from math import isfinite, nan

from numba import njit

from {kernel} import control_law, controller_of


@njit(nogil=True, cache=True)
def run(theta, samples, s, columns, by_position, integral, ratio, period, follow, unknown, out):
    """Fill `out` with command minus law; `s` is the law's memory and a count."""
    p = controller_of(theta)
    memory = s[:-1]
    voltage, motor, load, position, velocity, added = columns
    for k in range(samples.shape[0]):
        r, w = samples[k, position], samples[k, velocity]
        if by_position and not isfinite(w):
            w = 0.0
        if not by_position and not isfinite(r):
            r = 0.0
        more = samples[k, added] if isfinite(samples[k, added]) else 0.0
        said = control_law(p, memory, r, w, more, samples[k, motor], samples[k, load], ratio,
                           period)
        off = samples[k, voltage] - said
        if not isfinite(off):
            s[:] = 0.0
        else:
            s[-1] += 1.0
            known = s[-1] - unknown
            if integral >= 0:
                s[integral] += max(follow, 1.0 / max(1.0, known)) * off
            if known <= 0.0:
                off = nan
            elif integral >= 0 and known == 1.0:
                off = 0.0
        out[k] = off
'''


class ControllerLaw:
    """
    The control law of a servo, run over blocks of samples.

    The speed and the integral of the rig's controller at the first sample are not known, for the
    rig may move. The law says nothing until its speed filter has forgotten how it began. The
    integral is taken such that the law agrees in the mean of what was seen from then on, of the
    last FOLLOW seconds when that is longer. So rounding cannot pile up either. Raises ValueError
    for a servo without a controller.
    """

    def __init__(self, servo: Servo, period: float) -> None:
        reference = reference_of(servo)
        if reference is None:
            raise ValueError(f'{servo.name} has no controller')
        self._run = _compiled(servo)
        self._theta = servo.theta
        self._ratio = servo.values['mechanism.ratio']
        self._period = period
        self._by_position = reference == 'reference_position'
        integrates = getattr(control_values(servo), 'ki', 0.0) > 0.0
        self._integral = CONTROLLER_SIZE - 1 if integrates else -1
        lag = servo.values.get('controller.filter', 0.0)
        self._unknown = 1.0 + np.ceil(_FORGOTTEN * lag / period)
        self._memory = np.zeros(CONTROLLER_SIZE + 1)

    def step(self, samples: np.ndarray) -> np.ndarray:
        """
        Return command minus law in V, shape (n,), of samples of shape (n, len(CHANNELS)).

        NaN where the loop is open (no reference), what it needs is not measured, or as it begins.
        """
        out = np.empty(len(samples))
        self._run(self._theta, samples, self._memory, _COLUMNS, self._by_position, self._integral,
                  self._ratio, self._period, self._period / FOLLOW, self._unknown, out)
        return out

    def remember(self, other: ControllerLaw) -> None:
        """Go on from where another law stands."""
        self._memory[:] = other._memory

    def forget(self) -> None:
        """Begin again at the next sample."""
        self._memory[:] = 0.0


_COLUMNS = tuple(CHANNELS.index(name) for name in (
    'voltage', 'motor_position', 'load_position', 'reference_position', 'reference_velocity',
    'added_command'))


def impulse_responses(servo: Servo, period: float, size: int) -> tuple[np.ndarray, np.ndarray]:
    """
    Return how the law's command answers one unit of a reading of the motor and the load encoder.

    Each of shape (size,), V/rad, without limits: the law is asked close to zero, begins at rest,
    and the integral is left out, for it does not pile up. Used for the noise floor.
    """
    answers = []
    for column in _COLUMNS[1:3]:
        samples = np.zeros((size + 1, len(CHANNELS)))
        small = 1e-9
        samples[1, column] = small
        law = ControllerLaw(servo, period)
        law._integral, law._unknown = -1, 0.0
        answers.append(-law.step(samples)[1:] / small)
    return answers[0], answers[1]


def _compiled(servo: Servo) -> FunctionType:
    """Return the compiled loop over the law; kept on disk, named by the kernel it belongs to."""
    kernel = kernel_of(servo).module.__name__
    text = _TEMPLATE.format(kernel=kernel)
    name = f'servo_twin_law_{hashlib.sha256(text.encode()).hexdigest()[:24]}'
    if name not in sys.modules:
        folder = cache_folder()
        file = folder / f'{name}.py'
        if not file.exists():
            draft = file.with_suffix(f'.{os.getpid()}')
            draft.write_text(text)
            draft.replace(file)
        spec = importlib.util.spec_from_file_location(name, file)
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name].run
