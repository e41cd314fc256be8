"""Values of the servo file that may be off beyond their tolerance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from servo_twin.physics.effect import Parameter
from servo_twin.physics.servo import Placed

from ...fit.free_values import SURE
from ..residuals.equation_errors import EquationErrors
from ..residuals.nuisance import FAR, FINE, room_of, slope, value_of
from ..residuals.samples import ResidualSamples
from .builder import Builder
from .hypothesis import Columns, Form, Hypothesis, Mechanism
from .orders import rises, waves
from .varying_values import VARYING, varying

SLOPE = 0.1  # share of a value over which its slope is taken

NAMES = {'drive.torque_constant': 'torque_constant_error',
         'mechanism.stiffness': 'stiffness_error'}
"""Values whose error has a name of its own in the table of signatures."""

VARIABLES = {
    'drive.torque_constant': ('current',), 'drive.gain': ('command',),
    'drive.resistance': ('current',), 'drive.back_emf': ('speed',),
    'drive.inductance': ('rate of current',), 'mechanism.stiffness': ('load',),
    'mechanism.damping': ('rate of torsion',)}
PORTS = {'coulomb_friction': 'friction', 'viscous_friction': 'friction'}
LEVERS = ('mechanism.ratio', 'mechanism.efficiency')
"""Values that scale the balance of both shafts, counted at the load: a scale closes no gap."""
ROTOR, LINKS = 'mechanism.rotor_inertia', 'mechanism.load_inertia'
LINKED = ((0.0, 1.0), (0.0, 2.0), (0.0, 1.0, 2.0, 3.0))
"""Orders of a turn by which the inertia of a crank or of a linkage varies."""



def values_of(builder: Builder) -> Iterator[Hypothesis]:
    """Yield a hypothesis for each physical value of the servo."""
    servo, samples = builder.samples.servo, builder.samples
    sites = {placed.name: placed for placed in servo.effects}
    for path, parameter in servo.declarations():
        section = path.split('.')[0]
        if section not in ('drive', 'mechanism', 'effects') or parameter.row:
            continue
        lead = path == 'mechanism.ratio'
        if lead and 'transmission' not in samples.present:
            continue  # of one encoder no angle tells it, and torques have likelier causes
        if section == 'effects' and parameter.off is None:
            continue
        value = servo.numbers[path]
        step = (FINE if lead else SLOPE) * abs(value) or SLOPE * abs(
            default_of(parameter)) or SLOPE
        column = slope(samples, path, step, parameter.bounds)
        if lead:  # the firmware counts with the lead of the file
            column = np.where(samples.rows('controller'), 0.0, column)
        if path in LEVERS:
            column = column - np.where(samples.rows('torque'), samples.base / value, 0.0)
        mechanism = _of_value(path, sites)
        one = builder.hypothesis(mechanism, Columns(column[:, None]), [0], path=path,
                                 room=room_of(samples, path, parameter.bounds),
                                 form=_line(path, mechanism))
        if one:
            yield one
        # on one shaft it is the load that is picked up or linked, not the rotor
        rotor = path == ROTOR and not servo.mechanism.compliant
        if one and path in VARYING and not rotor:
            yield from varying(builder, path, step, mechanism)
        if one and path == LINKS and builder.turns('load_angle'):
            yield from filter(None, (_linked(builder, mechanism, orders) for orders in LINKED))


def _linked(builder: Builder, mechanism: Mechanism, orders: Sequence[float]
            ) -> Hypothesis | None:
    r"""
    An inertia of the load that varies over its turn; a rotor is round.

    .. math:: T = J(q)\,\ddot q + \tfrac12 J'(q)\,\dot q^2
    """
    def torque(one: EquationErrors) -> np.ndarray:
        speed, angle = one.motion['load_speed'], one.motion['load_angle']
        return -(one.motion['load_acceleration'][:, None] * waves(angle, orders)
                 + 0.5 * (speed**2)[:, None] * rises(angle, orders))

    form = Form('angle', 'rad', 'kg m2', lambda one: one.motion['load_angle'],
                lambda x: waves(x, orders))
    return builder.hypothesis(
        replace(mechanism, variables=(*mechanism.variables, 'angle')),
        builder.place('load_torque', torque), [0] * 2 * len(orders),
        tuple(np.repeat(orders, 2)), form=form, detail={'law': 'linked_inertia', 'of': LINKS})


def _line(path: str, mechanism: Mechanism) -> Form | None:
    """Return the torque that an inertia or a torque constant is off by, as a straight line."""
    if path == 'drive.torque_constant':
        return Form('current', 'A', 'N m', lambda one: one.predicted_current, lambda x: x[:, None])
    if mechanism.port == 'inertia':
        shaft = 'load' if 'load' in path else 'motor'
        lever = (lambda one: 1.0) if shaft == 'load' else (
            lambda one: one.servo.values['mechanism.ratio'])
        return Form('acceleration', 'rad/s2', 'N m',
                    lambda one: lever(one) * one.motion['load_acceleration'],
                    lambda x: -x[:, None])
    return None


def far_off(samples: ResidualSamples, one: Hypothesis, amplitudes: np.ndarray) -> float:
    """
    Return what it costs that a value of the file is another, nats; 0.0 for what is none.

    A data sheet is right within a factor, as likely more as less: of two values that would do
    alike the one that is off less in proportion is the likelier. One that varies counts by its
    mean.
    """
    path = one.path or one.detail.get('of', '')
    given = samples.servo.numbers.get(path, 0.0)
    waved = {'angle', 'coupled angle'} & set(one.mechanism.variables)
    level = amplitudes[0] if waved else amplitudes.mean()
    ratio = value_of(samples, path, float(level)) / given if given else 0.0
    return float(0.5 * (SURE * np.log(ratio) / np.log(FAR)) ** 2) if ratio > 0.0 else 0.0


def default_of(parameter: Parameter) -> float:
    """Return the default of a parameter, of a row the largest."""
    default = parameter.default
    return float(max(map(abs, default)) if isinstance(default, tuple) else default)


def _of_value(path: str, sites: Mapping[str, Placed]) -> Mechanism:
    if path.startswith('effects.'):
        placed = sites[path.split('.')[1]]
        return Mechanism(f'parameter:{path.removeprefix("effects.")}', placed.effect.port,
                         placed.site, tuple(sorted(placed.effect.variables())) or ('direction',),
                         'odd')
    site = 'motor' if path == 'drive.torque_constant' else (
        'drive' if path.startswith('drive.') else 'motor' if 'rotor' in path else
        'load' if 'load' in path else 'mesh')
    variables = ('acceleration',) if 'inertia' in path else VARIABLES.get(path, ('speed',))
    port = 'inertia' if 'inertia' in path else path.split('.')[0]
    return Mechanism(name_of(path), port, site, variables, 'odd')


def name_of(path: str) -> str:
    """Return the name of the error of a value of drive or mechanism, by its path."""
    return NAMES.get(path, f'parameter:{path.rpartition(".")[2]}')
