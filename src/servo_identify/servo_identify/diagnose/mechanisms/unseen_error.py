r"""
A kinematic error of the gear that one encoder alone tells: the other shaft waves along.

The shaft without an encoder turns by the angle lost :math:`e` more or less than the ratio says, so
that its inertia asks for a torque that the twin does not know of. At the square of the speed that
is much, however small the error. A reading that is off by such a wave does nearly the same.

.. math:: \theta_l = \theta_m / N - e: \quad J_l \ddot e \text{ is not asked of the motor}, \quad
          N J_m \ddot e \text{ is, by the encoder of the load}

On an elastic transmission the twin tells how the unseen shaft swings. Source: paper 004 eq. 4,
with the measured shaft led.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from servo_twin.balances.equation_terms import rotor_inertia
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import bridged
from .builder import Builder
from .hypothesis import Columns, Form, Hypothesis, Mechanism
from .loose_shaft import contact_of
from .orders import orders_of, series_of, waves

PART = 0.35  # of a period that a shaft must cover for a kinematic error of that order
SMALL = 1e-5  # rad of error by which the twin tells what one does
NAME = 'unseen_error'  # of the error in the twin that has it


def unseen_error(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """
    Yield the kinematic errors over the turn of either shaft, by the torque that they ask for.

    ``residual`` (samples,) tells the orders.
    """
    servo = builder.samples.servo
    values, ratio = servo.numbers, servo.numbers['mechanism.ratio']
    unseen = values['mechanism.load_inertia'] if builder.by_motor else rotor_inertia(values)
    if not unseen > 0.0 or (servo.mechanism.compliant and not servo.mechanism.correctable):
        return
    mechanism = Mechanism('transmission_error', 'mesh_error', 'mesh', ('angle',), 'even')
    low, high = find('transmission_error').parameters['order'].bounds
    made: dict[float, Columns] = {}
    for angle, lead in (('load_angle', 1.0), ('motor_angle', ratio)):
        if not builder.turns(angle) or (angle == 'motor_angle' and ratio == 1.0):
            continue
        found, tried = orders_of(builder, 'torque', angle, residual, 'square of speed', PART)
        if not found:
            continue
        known = set(made)
        for orders in series_of(found):
            led = [lead * order for order in orders]
            if known.issuperset(led) or not low <= min(led) <= max(led) <= high:
                continue  # over the turn of the other shaft it was tried, or no twin has it
            for order in set(led) - made.keys():
                made[order] = _columns(builder, order)
            several = [made[order] for order in led]
            table = np.hstack([one.table for one in several])
            form = Form('angle', 'rad', 'rad', lambda one, angle=angle: one.motion[angle],
                        partial(waves, orders=orders))
            one = builder.hypothesis(
                mechanism, Columns(table), [0] * table.shape[1],
                tuple(order for order in orders for _ in range(2)), form=form, tried=tried,
                detail=contact_of(builder))
            if one:
                yield one if lead == 1.0 else at_load(builder, one, ratio)


def at_load(builder: Builder, one: Hypothesis, ratio: float) -> Hypothesis:
    """Return an error over the turn of the motor, counted at the load."""
    form, turns = one.form, builder.turns('load_angle')
    assert form is not None
    whole = all(float(order).is_integer() for order in one.knots)
    return replace(one, knots=tuple(ratio * order for order in one.knots), form=replace(
        form, of=lambda errors: errors.motion['motor_angle'] / ratio,
        shape=lambda x: form.shape(ratio * x),
        period=form.period if turns or not whole else form.period / ratio))


def _columns(builder: Builder, order: float) -> Columns:
    """Return what cosine and sine of an error of one order of the load do, rad each."""
    servo = builder.samples.servo
    if servo.mechanism.compliant:
        tables = []
        for wave in ('cosine', 'sine'):
            other = servo.with_effects(Placed(NAME, find('transmission_error'), 'mesh'), values={
                f'effects.{NAME}.order': order, f'effects.{NAME}.cosine': (0.0,),
                f'effects.{NAME}.sine': (0.0,), f'effects.{NAME}.{wave}': (SMALL,)})
            tables.append(builder.turned(other, 1.0 / SMALL).table)
        return Columns(np.hstack(tables))
    if builder.by_motor:
        inertia = servo.numbers['mechanism.load_inertia']
        return builder.place('load_torque', lambda one: inertia * _waved(one, order))
    inertia = rotor_inertia(servo.numbers) * servo.numbers['mechanism.ratio']
    return builder.place('motor_torque', lambda one: -inertia * _waved(one, order))


def _waved(one: EquationErrors, order: float) -> np.ndarray:
    """
    Return the acceleration of both waves, (samples, 2), 1/s2.

    Of the reading itself: the test function smooths it once, as it does the equation.
    """
    period = one.measured.period
    return np.gradient(np.gradient(waves(bridged(one.angles()[1]), (order,)), period, axis=0),
                       period, axis=0)
