"""
What the transmission does beside its linear elasticity, as angle lost for a torque.

Seen so, everything is linear: a clearance is a jump where the torque changes sign, a bent
elasticity a curve over the torque, a kinematic error a wave over the angle.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import Columns, Form, Hypothesis, Mechanism, Series
from .hysteresis import creep, hysteresis, rounded_loops
from .loose_shaft import loose_shaft
from .lost_motion import as_gap, lost_motion
from .orders import periodic, waves
from .shape_search import SHAPES
from .slip import slip
from .unseen_error import at_load, PART, unseen_error
from .unseen_shaft import asked, unseen_shaft

BENDS = np.array((0.2, 0.35, 0.55, 0.75))
"""Shares of the largest torque up to which it may be softer: below, a clearance is alike."""
KNEES = (0.1, 1.0)  # shares of the largest torque at which a lack of stiffness may be made up
BEYOND = np.arange(0.1, 1.0, 0.1)  # shares from which it may be harder, or softer
SOFT = (0.03, 0.1)  # shares up to which a clearance may take the load up: oil, rough flanks
GROWS = (0.025, 0.06, 0.15, 0.35, 0.7)  # shares between which one may grow
SHARES = ((1.0,), (1.0, 2.0))  # half waves over the travel of an axis, by which it is stiffer


def transmission_of(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """Yield the hypotheses of the transmission; of one angle alone, what its shaft feels."""
    if 'transmission' not in builder.samples.present:
        yield from filter(None, (unseen_shaft(builder, residual),))
        if 'torque' in builder.samples.present:
            yield from filter(None, (loose_shaft(builder, residual),))
            yield from unseen_error(builder, residual)
        return
    top = builder.scales.torque
    if not builder.samples.servo.mechanism.compliant:
        yield from filter(None, (_compliance(builder),))
    elif top > 0.0:  # beside an elasticity alone can one bend, or a clearance grow with the load
        yield from filter(None, (_bent(builder, top), _bent(builder, top, beyond=True),
                                 _one_sided(builder), _softer(builder, top, residual),
                                 hysteresis(builder, top),
                                 rounded_loops(builder, top, residual),
                                 creep(builder, residual), _by_load(builder, top)))
        yield from _varying(builder, residual)
    if builder.samples.present == ('transmission',):
        yield from filter(None, (lost_motion(builder, residual),))
    if top > 0.0:
        yield from filter(None, (_backlash(builder, top), slip(builder, top)))
        flank = Mechanism('position_dependent_backlash', 'clearance', 'mesh',
                          ('angle', 'load'), 'odd')
        yield from periodic(builder, flank, residual, 'transmission', 'driven_angle', 'torsion',
                            'flank', lambda one: 0.5 * one.flank(one.motion), 'rad',
                            mean=True)
    error = Mechanism('transmission_error', 'mesh_error', 'mesh', ('angle',), 'even')
    yield from periodic(builder, error, residual, 'transmission', 'driven_angle', 'torsion', '',
                        lambda one: np.ones(len(one.motion.rows)), 'rad', PART)
    ratio = builder.samples.servo.numbers['mechanism.ratio']
    if ratio > 1.0:  # by the load's turn, the motor's orders lie beyond the largest, or between
        for one in periodic(builder, error, residual, 'transmission', 'motor_angle', 'torsion',
                            '', lambda one: np.ones(len(one.motion.rows)), 'rad', PART):
            yield _without_energy(builder, one)
            yield at_load(builder, one, ratio)


def _varying(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """A stiffness that varies over the turn, as with the number of teeth that carry."""
    mechanism = Mechanism('stiffness_error', 'mesh', 'mesh', ('load', 'angle'), 'odd')
    if not builder.turns('load_angle'):
        yield from filter(None, (_along(builder, mechanism, waved) for waved in SHARES))
    for one in periodic(builder, mechanism, residual, 'transmission', 'driven_angle', 'torsion',
                        'load', lambda one: one.transmitted(), 'rad/(N m)', mean=True):
        yield replace(one, detail={'law': 'stiffness_ripple'})


def _along(builder: Builder, mechanism: Mechanism, shares: tuple[float, ...]
           ) -> Hypothesis | None:
    """A stiffness that varies along an axis, as that of a belt with its free length."""
    low, high = builder.scales.travel('load_angle')
    if not high > low:
        return None
    orders = (0.0, *(share * np.pi / (high - low) for share in shares))
    form = Form('angle', 'rad', 'rad/(N m)', lambda one: one.motion['load_angle'],
                lambda x: waves(x, orders))
    columns = _torsion(builder, lambda one: one.transmitted()[:, None] * form.shape(form.of(one)))
    knots = tuple(order for order in orders for _ in range(2))
    return builder.hypothesis(mechanism, columns, [0] * len(knots), knots, form=form,
                              detail={'law': 'stiffness_ripple', 'along': (low, high)})


def _without_energy(builder: Builder, one: Hypothesis) -> Hypothesis:
    """
    Return an error over the motor's turn with what it costs and gives the motor.

    The error makes no energy: a torque T on the load costs the motor as much less as the lost
    angle grows with the motor's, paper 004 eq. 4.
    """
    orders = np.array(one.knots[::2])

    def torque(errors: EquationErrors) -> np.ndarray:
        turned = errors.motion['motor_angle'][:, None] * orders
        slopes = np.empty((len(turned), 2 * len(orders)))
        slopes[:, ::2], slopes[:, 1::2] = -orders * np.sin(turned), orders * np.cos(turned)
        return errors.transmitted()[:, None] * slopes

    back = builder.place('motor_torque', torque)
    return replace(one, columns=one.columns.plus(back).packed(),
                   detail={'law': 'kinematic_error'})


def _torsion(builder: Builder, of: Series) -> Columns:
    return builder.place('torsion', of)


def _compliance(builder: Builder) -> Hypothesis | None:
    """The elasticity that a rigid twin lacks: torsion in proportion to torque and its rate."""
    mechanism = Mechanism('stiffness_error', 'mesh', 'mesh', ('load',), 'odd')

    def torsion(one: EquationErrors) -> np.ndarray:
        torque = asked(one)
        return np.column_stack((torque, -np.gradient(torque, one.measured.period)))

    return builder.hypothesis(mechanism, _torsion(builder, torsion), [1, 1])


def _backlash(builder: Builder, top: float) -> Hypothesis | None:
    """A clearance: an angle lost at once as the torque changes sign, or over a little of it."""
    mechanism = Mechanism('backlash', 'clearance', 'mesh', ('load',), 'odd')

    def taken(size: np.ndarray) -> np.ndarray:
        return np.column_stack([np.minimum(size / (share * top), 1.0) for share in SOFT])

    def torsion(one: EquationErrors) -> np.ndarray:
        torque = one.transmitted()
        return 0.5 * np.column_stack((one.flank(one.motion),
                                      np.sign(torque)[:, None] * taken(np.abs(torque))))

    form = Form('load', 'N m', 'rad', lambda one: np.abs(one.transmitted()),
                lambda x: np.column_stack((np.ones(len(x)), taken(x))))
    return builder.hypothesis(mechanism, _torsion(builder, torsion), [1] * (1 + len(SOFT)),
                              form=form, detail=as_gap(builder))


def _bent(builder: Builder, top: float, beyond: bool = False) -> Hypothesis | None:
    """
    An elasticity that bends: the file has its stiffness at large torque, or at small (``beyond``).

    The curves are 1 at the largest torque.
    """
    mechanism = Mechanism('nonlinear_stiffness', 'mesh', 'mesh', ('load',), 'odd')
    shares = BEYOND if beyond else BENDS

    def torsion(torque: np.ndarray) -> np.ndarray:
        size = np.abs(torque)[:, None] / top
        bends = (np.maximum(size - shares, 0.0) / (1.0 - shares) if beyond else
                 np.minimum(size / shares, 1.0))
        return np.sign(torque)[:, None] * bends

    form = Form('load', 'N m', 'rad', lambda one: one.transmitted(), torsion)
    return builder.hypothesis(mechanism, builder.of_form('torsion', form), [1] * len(shares),
                              tuple(shares * top), either=True, form=form)


def _softer(builder: Builder, top: float, residual: np.ndarray) -> Hypothesis | None:
    """An elasticity that is softer at small torque, and smoothly becomes that of the file."""
    mechanism = Mechanism('nonlinear_stiffness', 'mesh', 'mesh', ('load',), 'odd')

    def of(knee: float) -> Form:
        return Form('load', 'N m', 'rad', lambda one: one.transmitted(), lambda x: np.column_stack(
            (x / np.sqrt(1.0 + (x / knee) ** 2), x / (1.0 + np.abs(x) / knee))))

    knee = builder.best_shape(KNEES[0] * top, KNEES[1] * top, lambda number: builder.of_form(
        'torsion', of(number)).table.sum(axis=1), residual)
    return builder.hypothesis(mechanism, builder.of_form('torsion', of(knee)), [1, 1],
                              (knee, knee), form=of(knee), tried=SHAPES)


def _one_sided(builder: Builder) -> Hypothesis | None:
    """A stiffness that differs by direction."""
    mechanism = Mechanism('nonlinear_stiffness', 'mesh', 'mesh', ('load',), 'even')
    form = Form('load', 'N m', 'rad', lambda one: one.transmitted(),
                lambda x: np.abs(x)[:, None])
    stiffness = builder.samples.servo.numbers['mechanism.stiffness']
    return builder.hypothesis(mechanism, builder.of_form('torsion', form), [0], form=form,
                              detail={'law': 'one_sided_stiffness', 'stiffness': stiffness})


def _by_load(builder: Builder, top: float) -> Hypothesis | None:
    """A clearance that grows with the load; where the servo has one already, its growth alone."""
    mechanism = Mechanism('load_dependent_backlash', 'clearance', 'mesh', ('load',), 'odd')
    known = builder.known('clearance')
    edges = (0.0, *GROWS, 1.0)

    def width(torque: np.ndarray) -> np.ndarray:
        share = np.abs(torque) / top
        grown = [np.clip((share - low) / (high - low), 0.0, 1.0)
                 for low, high in zip(edges[:-1], edges[1:], strict=True)]
        return np.column_stack(grown if known else [np.ones(len(share)), *grown])

    form = Form('load', 'N m', 'rad', lambda one: np.abs(one.transmitted()), width)
    columns = _torsion(builder, lambda one: (
        0.5 * one.flank(one.motion)[:, None] * width(one.transmitted())))
    knots = tuple(high * top for high in edges[1:])
    return builder.hypothesis(mechanism, columns, [1] * (len(knots) + (not known)),
                              knots if known else (0.0, *knots), form=form)
