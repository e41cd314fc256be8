"""The gains with which a controller ran: they are settings, found anew for each recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import least_squares

if TYPE_CHECKING:
    from .balance import Balance


def gains_as_set(balance: Balance) -> dict[int, float]:
    """
    Find the gains of this recording, within their tolerance: gains are settings.

    Returns by slot of theta how far they are from those of the servo file. Found by the law
    itself and not by its slope, since a gain that is far off drives the law into its limit.
    """
    paths = [p for p in balance.servo.tolerance if p.startswith('controller.')]
    if not paths:
        return {}
    nominal = np.array([balance.servo.values[p] for p in paths])
    low, high = np.array([balance.servo.tolerance[p] for p in paths]).T
    slots = [balance.slots[p] for p in paths]
    scale = np.maximum(high - low, 1e-12)
    measured = balance.seen.recording['voltage']

    def misfit(x):
        theta = balance.servo.theta
        theta[slots] = x * scale
        left = measured - balance.command_of(theta, balance.base_switches, balance.seen.channels)
        left = balance.seen.fine.weigh(left)
        return np.nan_to_num(left - np.nanmedian(left))  # the integral may have begun anywhere

    tries = [least_squares(misfit, start / scale, bounds=(low / scale, high / scale),
                           loss='soft_l1', f_scale=0.01 * np.nanstd(measured) + 1e-9,
                           diff_step=1e-3, max_nfev=20)
             for start in (np.clip(nominal, low, high), 0.5 * (low + high),
                           low + 0.1 * (high - low))]
    best = min(tries, key=lambda found: found.cost)
    return dict(zip(slots, best.x * scale - nominal, strict=True))
