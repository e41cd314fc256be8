"""
Patterns: any curve over one variable, in either symmetry, in one equation.

A pattern over the variable of a mechanism of the table is that mechanism, whatever its formula.
One over a variable that no mechanism has there is something that the table does not know. Its
place, its variable and its symmetry are known all the same.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from servo_twin.balances.equation_terms import UNITS

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import ANY, Form, Hypothesis, Mechanism, UNKNOWN
from .lost_motion import as_gap
from .narrow_places import narrow_places
from .orders import hats
from .variables import Variable, variables_of

HATS, FEWEST = 10, 50  # of one curve; samples that say anything
SPEED_FRICTION = 'friction_over_speed'
"""Any friction that depends on speed alone; named by what it is made of."""

SIGNATURES = {
    ('shaft', 'speed', 'odd'): SPEED_FRICTION,
    ('shaft', 'speed', 'even'): 'asymmetric_friction',
    ('shaft', 'angle', 'odd'): 'position_dependent_friction',
    ('shaft', 'load', 'odd'): 'load_dependent_friction',
    ('shaft', 'travel since reversal', 'odd'): 'presliding_friction',
    ('shaft', 'time', 'odd'): 'friction_drift',
    ('shaft', 'temperature', 'odd'): 'friction_drift',
    ('transmission', 'load', 'odd'): 'nonlinear_stiffness',
    ('transmission', 'angle', 'even'): 'transmission_error',
    ('transmission', 'angle', 'odd'): 'position_dependent_backlash',
    ('transmission', 'travel since reversal', 'odd'): 'hysteresis',
}
"""Which mechanism of the table a pattern is, by place, variable and symmetry."""

PORTS = {'transmission_error': 'mesh_error', 'position_dependent_backlash': 'clearance',
         'backlash': 'clearance', 'spring_load': 'torque'}

OF_RIGID = {'nonlinear_stiffness': 'stiffness_error', 'hysteresis': 'backlash'}
"""What a pattern is of a rigid transmission: it lacks the elasticity itself, or loses motion."""
"""Where a pattern with a name acts, unless it is friction or an elasticity."""

PLACES = {'motor': ('motor_torque', 'motor'), 'load': ('load_torque', 'load'),
          'torque': ('load_torque', 'load'), 'transmission': ('torsion', 'mesh'),
          'drive': ('drive_current', 'drive')}


def patterns_of(builder: Builder, sides: Collection[str], without: Collection[str],
                residual: np.ndarray) -> Iterator[Hypothesis]:
    """
    Yield a hypothesis for each equation, variable and symmetry.

    Over the place of a shaft there is another, that bends where the ``residual`` (samples,) does.
    ``sides`` are the shafts that can be told apart. In the balance of both a pattern is the
    load's, and one that has a name may be the motor's as well.
    """
    for equation in builder.samples.present:
        if equation not in PLACES:
            continue
        places = [PLACES[equation]]
        if equation == 'torque' and 'motor' in sides:
            places.append(PLACES['motor'])
        for signal, site in places:
            for variable in variables_of(site if equation == 'torque' else equation):
                edges = _edges([variable.sized(one) for one in builder.samples.errors])
                if edges is None:
                    continue
                for symmetry in ('even', 'odd'):
                    if (equation, variable.name, symmetry) == ('torque', 'load', 'even'):
                        continue  # that load comes from this balance: it would explain itself
                    found = (_pattern(builder, equation, signal, site, variable, edges, symmetry,
                                      without),
                             _narrow(builder, residual, equation, signal, site, variable, symmetry,
                                     without))
                    for one in filter(None, found):
                        if (signal, site) == PLACES[equation] or one.mechanism.name != UNKNOWN:
                            yield one


def _narrow(builder: Builder, residual: np.ndarray, equation: str, signal: str, site: str,
            variable: Variable, symmetry: str, without: Collection[str]) -> Hypothesis | None:
    """Return the pattern over the place of a shaft with its narrow places, if there are some."""
    if variable.name != 'angle' or equation not in ('motor', 'load', 'torque'):
        return None
    places = narrow_places(builder, residual, equation, symmetry == 'odd')
    if places is None:
        return None
    one = _pattern(builder, equation, signal, site, variable, places, symmetry, without)
    return one and replace(one, detail={
        **one.detail, 'narrowest': float(np.diff(places).min())})


def _pattern(builder: Builder, equation: str, signal: str, site: str, variable: Variable,
             edges: np.ndarray, symmetry: str, without: Collection[str]) -> Hypothesis | None:
    by_flank = equation == 'transmission' and variable.name in ('load', 'angle')
    place = 'shaft' if equation in ('motor', 'load', 'torque') else equation
    known = SIGNATURES.get((place, variable.name, symmetry), UNKNOWN)
    if not builder.samples.servo.mechanism.compliant:
        known = OF_RIGID.get(known, known)
    part = 0.5 if _port(known, place) == 'clearance' else 1.0  # half of it to either side

    def of(one: EquationErrors) -> np.ndarray:
        curve = hats(variable.sized(one), edges)
        if symmetry == 'even':
            return curve
        way = one.flank(one.motion) if by_flank else variable.way(one)
        return part * way[:, None] * curve

    if (place, variable.name, symmetry) == ('transmission', 'acceleration', 'odd') and not all(
            'torque' in one.measured.channels for one in builder.samples.errors):
        known = 'stiffness_error'  # there the torque is what the acceleration asks for
    if (place, site, variable.name, symmetry) == ('shaft', 'load', 'angle', 'even') and not (
            builder.turns('load_angle') and np.ptp(edges) < len(edges) * 2.0 * np.pi):
        known = 'spring_load'  # by the place alone, where nothing turns or from turn to turn
    known = UNKNOWN if known in without else known
    mechanism = Mechanism(known, _port(known, place), site, (variable.name,), symmetry)
    columns = builder.place(signal, of)
    if known == UNKNOWN:  # a pattern without a name claims nothing of other equations
        rows = builder.samples.rows(equation)[:, None]
        columns = replace(columns, table=np.where(rows, columns.table, 0.0))
    sign = -1.0 if place == 'shaft' and symmetry == 'odd' else 1.0  # friction resists
    form = Form(variable.name, variable.unit, UNITS[equation], variable.sized,
                lambda x: sign * hats(x, edges))
    room = ANY if known != SPEED_FRICTION else (
        -builder.rubbing(site, variable.sized, edges), np.inf)
    law = as_gap(builder) if known == 'backlash' else {}
    return builder.hypothesis(mechanism, columns, [0] * len(edges), edges, form=form, room=room,
                              detail={'form': 'curve', 'equation': equation, **law})


def _port(name: str, place: str) -> str:
    if name == UNKNOWN:
        return place
    return PORTS.get(name, 'friction' if place == 'shaft' else 'mesh')


def _edges(several: list[np.ndarray]) -> np.ndarray | None:
    """Knots at quantiles of a variable, the ends included; None where it hardly varies."""
    x = np.concatenate([s[::7] for s in several])
    x = x[np.isfinite(x)]
    if len(x) < FEWEST:
        return None
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, HATS)))
    return edges if len(edges) >= 4 and np.ptp(edges) > 0.0 else None
