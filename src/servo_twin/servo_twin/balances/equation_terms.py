r"""
The equations of a servo, each as a list of terms.

The live twin, the online estimator, friction learning and the diagnosis all take their residuals
from them.

A term is ``factor`` times the ``order``-th time derivative of a signal. Signals that a rig
measures have the names of a recording's columns. The others are what the models of the servo say:

=================  ==============================================================================
motor_torque       torque on the motor shaft beside the motor's own, N m; friction is negative
                   where the shaft turns forwards
load_torque        likewise on the load shaft, N m
torsion            angle between the shafts beside the linear elasticity: kinematic error,
                   half the clearance, rad at the load
drive_current      current that the drive makes of the command, A
controller_output  command that the controller makes of references and readings, V
=================  ==============================================================================

==============  =============================================================================
motor           :math:`K_m i - J_m\ddot\theta_m - T/N + \tau_m = 0`, N m
load            :math:`T - J_l\ddot\theta_l - T_e + \tau_l = 0`, N m
torque          N times motor plus load, where T is not measured, N m at the load
transmission    :math:`\theta_m/N - \theta_l - \delta - (T - D\,\dot w)/K = 0`, rad; where T is
                not measured, it is what the load equation asks for
drive           :math:`i - i_d = 0`, A
controller      :math:`u - u_c = 0`, V
==============  =============================================================================

Sources: paper 000 eq. 1 and 2; of a ball screw paper 001 eq. 1 to 13, its screw turning with the
rotor and its efficiency in the lever.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

EQUATIONS = ('drive', 'motor', 'transmission', 'load', 'torque', 'controller')
UNITS = {'drive': 'A', 'motor': 'N m', 'transmission': 'rad', 'load': 'N m', 'torque': 'N m',
         'controller': 'V'}
ROTATING = ('rotor', 'coupling', 'screw')  # inertias that turn with the motor



def rotor_inertia(values: Mapping[str, float]) -> float:
    """Return the inertia of all that turns with the motor, kg m2 at the motor; values by path."""
    return sum(values.get(f'mechanism.{part}_inertia', 0.0) for part in ROTATING)


@dataclass(frozen=True)
class Term:
    """``factor`` times the ``order``-th time derivative of ``signal``."""

    signal: str
    order: int
    factor: float


def equation_terms(values: Mapping[str, float], measured: Collection[str],
                   looped: bool = False) -> dict[str, tuple[Term, ...]]:
    """
    Return the terms of every equation that the measured channels allow, by its name.

    ``values`` are those of a servo by path, ``measured`` names of columns; an angle that is not
    measured follows from the other one. ``looped``: a controller ran. The terms of an equation sum
    to zero where the servo is right.
    """
    constant = values['drive.torque_constant']
    lever = values['mechanism.ratio'] * values.get('mechanism.efficiency', 1.0)
    rotor = rotor_inertia(values)
    inertia = values['mechanism.load_inertia']
    angles = sum(name in measured for name in ('motor_position', 'load_position'))
    terms: dict[str, tuple[Term, ...]] = {}
    on_motor = (Term('current', 0, constant), Term('motor_position', 2, -rotor),
                Term('motor_torque', 0, 1.0))
    on_load = (Term('load_position', 2, -inertia), Term('external_torque', 0, -1.0),
               Term('load_torque', 0, 1.0))
    driven = 'current' in measured or 'voltage' in measured
    if 'current' in measured and 'voltage' in measured:
        terms['drive'] = (Term('current', 0, 1.0), Term('drive_current', 0, -1.0))
    if angles and 'torque' in measured:
        if driven:
            terms['motor'] = (*on_motor, Term('torque', 0, -1.0 / lever))
        terms['load'] = (*on_load, Term('torque', 0, 1.0))
    elif angles and driven:
        terms['torque'] = (*(Term(t.signal, t.order, lever * t.factor) for t in on_motor),
                           *on_load)
    if angles == 2:
        terms['transmission'] = _transmission(values, on_load, 'torque' in measured)
    if looped and 'voltage' in measured and angles:
        terms['controller'] = (Term('voltage', 0, 1.0), Term('controller_output', 0, -1.0))
    return terms


def _transmission(values: Mapping[str, float], on_load: tuple[Term, ...],
                  sensed: bool) -> tuple[Term, ...]:
    turns = 1.0 / values['mechanism.ratio']
    terms = [Term('motor_position', 0, turns), Term('load_position', 0, -1.0),
             Term('torsion', 0, -1.0)]
    stiffness = values.get('mechanism.stiffness', 0.0)
    if not stiffness:
        return tuple(terms)
    relaxation = values.get('mechanism.damping', 0.0) / stiffness
    terms += [Term('motor_position', 1, relaxation * turns),
              Term('load_position', 1, -relaxation), Term('torsion', 1, -relaxation)]
    if sensed:
        return (*terms, Term('torque', 0, -1.0 / stiffness))
    return (*terms, *(Term(t.signal, t.order, t.factor / stiffness) for t in on_load))
