r"""
The factor by which a current is off, by the equation of motion with what the servo file gives.

.. math:: K_t i = f\,J \dot\omega + b\,\omega + c\,\mathrm{sgn}\,\omega + z
          + g_c \cos\theta + g_s \sin\theta

f is 1 where inertia, torque constant and current are those of the file. A current as its peak
where the torque constant is of its effective value makes it the root of 2, that of a line where
the constant is of a winding in delta the root of 3. Such a factor is told where f is surely beyond
what the tolerances of the file allow, and by its name. Stretches of each recording say how far f
may be off by what the equation lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import log, sqrt

import numpy as np

from servo_twin.physics.servo import Servo

from .excitation import Excitation, plain_terms
from .finding import Finding
from .mistakes import MISTAKE
from .pooled import Columns, pooled
from .rough_balances import inertia_of

CONSTANT = 'drive.torque_constant'
STRETCHES = 5
NAMES = {
    sqrt(2.0): 'the peak of a sine, where the torque constant is of its effective value',
    1.0 / sqrt(2.0): 'the effective value of a sine, where the torque constant is of its peak',
    1.5: 'the current of the q axis, where the torque constant is of one phase',
    1.0 / 1.5: 'the current of one phase, where the torque constant is of the q axis',
    sqrt(3.0): 'the current of a line, where the torque constant is of a winding in delta',
    1.0 / sqrt(3.0): 'the current of a winding in delta, where the torque constant is of a line'}
"""What a current is that is so many times what its torque constant asks for."""


def current_findings(shown: Sequence[Excitation | None], servo: Servo, sure: float
                     ) -> list[Finding]:
    """
    Return that a current is off by a factor that has a name, if the motion surely shows it.

    ``shown`` is what each recording excites; ``sure``, nats, is by how much the factor must beat
    the tolerances of the file, its rarity counted.
    """
    inertia, constant = inertia_of(servo), servo.values.get(CONSTANT, 0.0)
    columns = [one for found in shown if found and 'current' in found.signals.plain
               for one in _columns(found, servo, inertia)]
    if not columns or not (inertia > 0.0 and constant > 0.0):
        return []
    fit = pooled(columns, STRETCHES)
    factor, variance = float(fit.shared[0]), float(fit.covariance[0, 0])
    if not factor > 0.0 or not np.isfinite(variance):
        return []
    error = sqrt(variance) / factor
    low, high = _allowed(servo, inertia, constant)
    beyond = max(log(low / factor), log(factor / high), 0.0)
    if not 0.5 * (beyond / max(error, 1e-9))**2 > sure + MISTAKE:
        return []
    near = sorted((abs(log(factor / value)), value, what) for value, what in NAMES.items())
    near = [one for one in near if one[0] < 2.0 * error + max(log(high), -log(low))]
    if not near:
        return []
    told = '; or '.join([*(f'{value:.4g} would be {what}' for _, value, what in near),
                         'the inertia is as many times that of the servo file, as with a payload'])
    return [Finding('amber', f'The current is {factor:.3g} +- {factor * error:.1g} times what '
                    f'inertia and torque constant of the servo file ask of this motion: {told}.',
                    'look up which current the drive writes, and which one the torque constant '
                    'is of; correct the constant, or give what 1 of the column is: '
                    f'current [{1.0 / near[0][1]:.4g} A]')]


def _columns(found: Excitation, servo: Servo, inertia: float) -> list[Columns]:
    told = plain_terms(found.signals, servo)
    if told is None or 'inertia' not in told[1] or len(told[1]['inertia']) < 10 * STRETCHES:
        return []
    torque, terms = told
    rest = [column for name, column in terms.items() if name != 'inertia']
    return [Columns(torque, inertia * terms['inertia'][:, None], np.stack(rest, 1))]


def _allowed(servo: Servo, inertia: float, constant: float) -> tuple[float, float]:
    """Return the least and the largest factor that the tolerances of the file allow."""
    ends = []
    for side in (0, 1):
        values = {path: bounds[side] for path, bounds in servo.tolerance.items()
                  if path.startswith('mechanism.') and path.endswith('_inertia')}
        heavy = inertia_of(servo.with_values(values)) / inertia if values else 1.0
        other = servo.tolerance.get(CONSTANT, (constant, constant))[1 - side] / constant
        ends.append(heavy / other)
    return ends[0], ends[1]
