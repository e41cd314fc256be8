"""What a channel that is read early or late does to the residuals."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from servo_twin.balances.equation_terms import Term

from .equation_errors import EquationErrors

Columns = Mapping[int, Mapping[str, np.ndarray]]
"""By recording and equation: values at the centres, shape (centres,) or (centres, n)."""


def sampling_columns(errors: list[EquationErrors], steep: bool = False) -> Columns:
    """
    Return what a channel does that is read one sample period late: columns by channel.

    With ``steep`` the angle of the load, whose jumps are none, is left out. All side by side in
    the order of :func:`late_channels`.
    """
    names = [n for n in late_channels(errors) if not (steep and n == 'load_position')]
    answer: dict[int, dict[str, np.ndarray]] = {}
    for number, one in enumerate(errors):
        theta = one.servo.theta
        for name, several in one._terms(theta).items():
            table = np.zeros((len(one.times(name)), len(names)))
            for term in several:
                signal = _late(term, one)
                if signal not in names:
                    continue
                series = one._series(term.signal, name, theta, one._readings,
                                     (one.motion, one.gear_motion), {}, None)
                assert series is not None  # what is read late is a reading
                shift = term.factor * one.test(name).project(series, term.order + 1)
                table[:, names.index(signal)] += np.nan_to_num(shift * one.measured.period)
            answer.setdefault(number, {})[name] = table
    return answer


def _late(term: Term, one: EquationErrors) -> str:
    if term.signal == 'current':
        return 'current' if 'current' in one.measured.channels else 'drive'
    return {'torque': 'torque', 'load_position': 'load_position', 'drive_current': 'drive',
            'voltage': 'controller', 'external_torque': 'external_torque'}.get(term.signal, '')


def late_channels(errors: list[EquationErrors]) -> list[str]:
    """Return the channels whose instant of sampling is not known."""
    seen = {_late(term, one) for one in errors for several in one._terms(one.servo.theta).values()
            for term in several}
    both = any({'motor_position', 'load_position'} <= one.measured.channels for one in errors)
    loaded = any('external_torque' in one.measured.channels for one in errors)
    return [n for n in ('current', 'torque', 'load_position', 'external_torque', 'drive',
                        'controller')
            if n in seen and (n != 'load_position' or both) and (n != 'external_torque' or loaded)]
