"""Values at which the shapes of candidates are tried first: by the motion and its spectrum."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from servo_twin.physics.effect import Effect

from .balance import BALANCES
from .candidates import ROW
from .scales import orders, PART, Scales
from .stack import Stack


def shape_values(stack: Stack, start: np.ndarray) -> Callable[[type[Effect], str],
                                                              list[dict[str, float]]]:
    """
    Return a function that lists the shape values worth trying for an effect at a site.

    ``start`` is what is left with no cause: orders are read off its spectrum over the angles.
    """
    scales = Scales(stack.balances)
    spectra: dict[tuple[str, str, str, float], tuple[float, ...]] = {}

    def found(effect: type[Effect], site: str) -> tuple[float, ...]:
        balance, angle = periodic_in(effect, site, stack)
        weight = {'position_dependent_friction': 'load_speed',
                  'position_dependent_backlash': 'torque',
                  'torque_ripple': 'current'}.get(effect.name, '')
        # friction on a part of a turn would be a level that nearly stays as it is
        least = PART if effect.port == 'mesh_error' else 1.0
        key = (balance, angle, weight, least)
        if key not in spectra:
            spectra[key] = _spectrum(stack, start, *key)
        return spectra[key]

    def shapes(effect: type[Effect], site: str) -> list[dict[str, float]]:
        grid = scales.grid(effect, site)
        order = effect.parameters.get('order')
        if order is None or order.row:
            return grid
        values = found(effect, site) if order.grid else ()
        values = values or order.grid or (order.default,)
        return [{**others, 'order': float(v)} for others in grid for v in values]

    return shapes


def periodic_in(effect: type[Effect], site: str, stack: Stack) -> tuple[str, str]:
    """Return (balance that shows it, column of the motion with its angle) of a periodic law."""
    names = {n for one in stack.balances for n in one.names}
    if effect.port in ('mesh_error', 'clearance', 'mesh'):
        return 'transmission', 'load_angle'
    angle = 'motor_angle' if site == 'motor' else 'load_angle'
    if 'torque' in names:
        return 'torque', angle
    return ('motor' if site == 'motor' else 'load'), angle


def _spectrum(stack, residual, balance, angle, weight, least) -> tuple[float, ...]:
    angles, values = [], []
    for number, one in enumerate(stack.balances):
        if balance not in one.names:
            continue
        kept = stack.kept(number, balance)
        rows = (stack.balance == BALANCES.index(balance)) & (stack.recording == number)
        factor = np.sign(one.weighed(weight, balance)[kept]) if weight else 1.0
        angles.append(one.weighed(angle, balance)[kept])
        values.append(residual[rows] * factor)
    if not angles:
        return ()
    return orders(np.concatenate(angles), np.concatenate(values), least=least, multiples=ROW)
