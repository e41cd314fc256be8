"""Loops of a transmission: from the angle lost over the torque to the torque over the torsion."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar, nnls

from servo_identify.diagnose.handover.curves import Part
from servo_identify.diagnose.handover.effect_values import direct
from servo_identify.diagnose.mechanisms.hypothesis import Columns, Hypothesis, Mechanism
from servo_identify.diagnose.mechanisms.memory import dahl_operator, stop_operator

LOOPS = Mechanism('hysteresis', 'mesh', 'mesh', ('load',), 'odd', memory=True)
STIFFNESS, LEVEL = 9000.0, 2.0  # N m/rad, N m
TURNS = np.interp(np.arange(0.0, 6.0, 1e-4), np.arange(7),
                  [0.0, 1.0, -1.0, 0.6, -0.3, 1.0, -1.0])
TRAVELS = [1e-4, 2e-4, 6e-4]  # rad; beside the first one the loop is twice as stiff as the spring


def values_of(amplitudes, widths, **detail):
    one = Hypothesis(LOOPS, Columns(np.zeros((1, len(widths)))), np.ones(len(widths)),
                     knots=tuple(widths), detail={'stiffness': STIFFNESS} | detail)
    return direct(Part(0, LOOPS, None, np.asarray(amplitudes)), one).values


@pytest.mark.parametrize('travel', TRAVELS)
def test_elements_that_slip_have_their_level_and_travel(travel):
    torsion = 2e-3 * TURNS
    torque = STIFFNESS * torsion + LEVEL / 4 * sum(
        stop_operator(torsion, share * travel) for share in (0.25, 0.5, 0.75, 1.0))
    widths = np.geomspace(0.02, 0.9, 30) * torque.max()
    lost = np.column_stack([stop_operator(torque, width) for width in widths])
    values = values_of(nnls(lost, torque / STIFFNESS - torsion)[0], widths)
    assert values['level'] == pytest.approx(LEVEL, rel=0.03)
    assert values['travel'] == pytest.approx(travel, rel=0.1)


@pytest.mark.parametrize('travel', TRAVELS)
def test_rounded_loops_have_their_level_and_travel(travel):
    torsion = 2e-3 * TURNS
    torque = STIFFNESS * torsion + LEVEL * dahl_operator(torsion, travel)
    lost = torque / STIFFNESS - torsion

    def left(width):
        table = dahl_operator(torque, width)[:, None]
        return nnls(table, lost)[1]

    width = minimize_scalar(left, bounds=(0.02 * torque.max(), torque.max()),
                            method='bounded').x
    amplitude = nnls(dahl_operator(torque, width)[:, None], lost)[0]
    values = values_of(amplitude, [width], law='dahl_hysteresis')
    assert values['level'] == pytest.approx(LEVEL, rel=0.1)
    assert values['travel'] == pytest.approx(travel, rel=0.25)
