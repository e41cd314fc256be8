r"""
Rows of the torque and the drive balance, from samples as they come.

The filters are those of the balances (servo_twin.balances.residual_filters), of zero phase: each
answer comes half a window late.
Where the balance of a shaft is linear in the friction of that shaft,

.. math:: T - J_l\dot\omega_l - T_e = \tau_c\,\mathrm{sgn}\,\omega + b\,\omega

is averaged over a block in which the shaft turns one way, and is one row. The drive's balance
:math:`i = K_a u` gives one row a block. Blocks that say nothing give none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from servo_twin.balances.equations import balance_taps
from servo_twin.physics.servo import Servo
from servo_twin.physics.state import OUTPUTS
from servo_twin.recording.joined_samples import CHANNELS
from servo_twin.recording.recording import BALANCES

_TAKEN = [CHANNELS.index(name) for name in OUTPUTS]
_EXTERNAL = CHANNELS.index('external_torque')
MOTOR, LOAD, TORQUE, CURRENT, VOLTAGE = range(len(OUTPUTS))


@dataclass(frozen=True)
class Filtered:
    """
    What the filters make of samples, each of shape (n,); NaN where a channel is missing.

    ``friction`` (N m) and ``speed`` (rad/s) of the shaft that the friction is at; ``current`` (A)
    and ``voltage`` (V); ``wind_up`` (rad) and ``torque`` (N m) of the transmission; angle of the
    ``load`` (rad).
    """

    friction: np.ndarray
    speed: np.ndarray
    current: np.ndarray
    voltage: np.ndarray
    wind_up: np.ndarray
    torque: np.ndarray
    load: np.ndarray


class Filters:
    """
    The filters of one servo for friction at a site, ``motor`` or ``load``.

    Where the torque between the shafts is not measured, the friction is that of both shafts, seen
    at the load. ``friction_noise`` (N m): what noise of the sensors makes of it.
    """

    def __init__(self, servo: Servo, period: float, site: str, half: int) -> None:
        self.half = half
        values = servo.values
        self._ratio = values['mechanism.ratio']
        self._stiffness = values.get('mechanism.stiffness', np.inf)
        taps = dict(zip(BALANCES, balance_taps(servo, period, half), strict=True))
        self.balance = site if taps[site].any() else 'torque_balance'
        row = taps[self.balance][:len(OUTPUTS)]
        self._friction = [(c, row[c]) for c in range(len(OUTPUTS)) if row[c].any()]
        self.friction_noise = float(np.linalg.norm([
            np.nan_to_num(servo.noise(OUTPUTS[c])) * np.linalg.norm(taps)
            for c, taps in self._friction])) or 1.0
        self._window = biweight(half)
        self._speed = np.convolve(biweight(half - 1), np.array([1.0, 0.0, -1.0]) / (2.0 * period))
        self._drive = taps['drive'][VOLTAGE] / -values['drive.gain']
        self._current = taps['drive'][CURRENT]
        self.drives = bool(self._current.any()) and 'drive.resistance' not in values
        self._of_motor = site == 'motor' and self.balance == 'motor'

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels without which the friction is not seen."""
        return tuple(OUTPUTS[c] for c, _ in self._friction)

    def run(self, rows: np.ndarray) -> Filtered:
        """Filter samples (n + 2 half, len(CHANNELS)); the answers are those of the middle n."""
        e = rows[:, _TAKEN].T
        size = len(rows) - 2 * self.half
        here = slice(self.half, self.half + size)
        friction = np.zeros(size)
        for channel, taps in self._friction:
            friction += np.convolve(e[channel], taps[::-1], 'valid')
        if not self._of_motor:
            friction -= np.convolve(np.nan_to_num(rows[:, _EXTERNAL]), self._window, 'valid')
        load = e[LOAD] if np.isfinite(e[LOAD]).any() else e[MOTOR] / self._ratio
        turning = e[MOTOR] if self._of_motor else load
        both = e[MOTOR, here] / self._ratio - e[LOAD, here] - np.nan_to_num(
            e[TORQUE, here]) / self._stiffness
        return Filtered(
            friction, np.convolve(turning, self._speed, 'valid'),
            np.convolve(e[CURRENT], self._current[::-1], 'valid'),
            np.convolve(e[VOLTAGE], self._drive[::-1], 'valid'),
            both, np.convolve(e[TORQUE], self._window, 'valid'), load[here])


def biweight(half: int) -> np.ndarray:
    """Return the biweight window of the balances, of sum 1, shape (2 half + 1,)."""
    window = (1.0 - (np.arange(-half, half + 1) / max(half, 1)) ** 2) ** 2
    return window / window.sum() if window.sum() > 0.0 else np.ones(1)
