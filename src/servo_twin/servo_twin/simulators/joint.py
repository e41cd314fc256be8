"""One joint as a rigid-body simulator holds it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, nan

from ..physics.straight_units import straightened

FORMATS = ('mjcf', 'urdf', 'isaac')
GRAVITY = 9.81  # m/s2 along -z, as MuJoCo takes it for a URDF file, which says nothing of it


class ModelError(ValueError):
    """A model that cannot be read or written as asked: names the thing, the value, the choice."""


@dataclass(frozen=True)
class Winding:
    """
    The motor of a simulator that has one, at its own shaft.

    ``resistance`` in ohm, ``inductance`` in H, ``constant`` in N m/A and V s/rad, ``gear`` in
    turns of the motor for one of the joint. Cogging is ``cogging * sin(order * angle + phase)``.
    LuGre friction has ``bristle`` (N m/rad), ``bristle_damping`` (N m s/rad), ``coulomb`` and
    ``static`` (N m) and ``stribeck`` (rad/s); stiffness of zero is none, all torques in N m.
    """

    resistance: float
    inductance: float
    constant: float
    gear: float
    cogging: float = 0.0
    order: float = 1.0
    phase: float = 0.0
    bristle: float = 0.0
    bristle_damping: float = 0.0
    coulomb: float = 0.0
    static: float = 0.0
    stribeck: float = nan


@dataclass(frozen=True)
class Joint:
    r"""
    What moves a joint while the rest of the robot is held, all of it at the joint.

    .. math:: (J + A)\,\ddot q = \tau - b\,\dot q - f\,\mathrm{sgn}(\dot q) - k (q - q_0)
              + c \cos q + s \sin q

    .. math:: \tau = \mathrm{clip}\left(g\,u - e\,\dot q + k_p (q^* - q)
              + k_d (k_f\,\dot q^* - \dot q),\ \tau_{max}\right)

    ``inertia`` J is that of what the joint carries about its axis; ``armature`` A that of the
    motor; ``damping`` b; ``friction`` f; ``stiction`` what resists at rest above f; ``stiffness``
    k and ``rest`` q_0 of a spring; ``cosine`` and ``sine`` the gravity torque. ``gain`` g is the
    torque for one of the command u, ``command_limit`` the largest of it, ``back_emf`` e what a
    held command loses with speed; ``lag`` (s) and ``delay`` (s) act on the command. SI units; of a
    joint that ``slides`` rad reads m, N m reads N, kg m2 reads kg, and ``cosine`` is the force at
    any place. ``sources`` says of a field where it comes from, ``left_out`` what the simulator has
    beside all this, a sentence each.
    """

    name: str
    slides: bool = False
    inertia: float = 0.0
    armature: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    stiction: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    cosine: float = 0.0
    sine: float = 0.0
    gain: float = 0.0
    back_emf: float = 0.0
    kp: float = 0.0
    kd: float = 0.0
    kf: float = 1.0
    torque_limit: float = inf
    command_limit: float = inf
    lag: float = 0.0
    delay: float = 0.0
    winding: Winding | None = None
    sources: Mapping[str, str] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()

    @property
    def controlled(self) -> bool:
        """Whether a position or a speed is its reference."""
        return self.kp > 0.0 or self.kd > 0.0

    def unit(self, rotary: str) -> str:
        """Return the unit of a quantity at this joint; ``rotary`` is that of a hinge."""
        return straightened(rotary) if self.slides else rotary


UNITS = {
    'inertia': 'kg m2', 'armature': 'kg m2', 'damping': 'N m s/rad', 'friction': 'N m',
    'stiction': 'N m', 'stiffness': 'N m/rad', 'rest': 'rad', 'cosine': 'N m', 'sine': 'N m',
    'gain': 'N m/V', 'back_emf': 'N m s/rad', 'kp': 'N m/rad', 'kd': 'N m s/rad', 'kf': '',
    'torque_limit': 'N m', 'command_limit': 'V', 'lag': 's', 'delay': 's',
}
"""Unit of every number of a joint that turns."""

SPOKEN = {
    'friction': 'dry friction', 'stiction': 'static above dry friction',
    'stiffness': 'stiffness of the spring', 'rest': 'rest of the spring',
    'cosine': 'gravity at zero', 'sine': 'gravity a quarter turn on',
    'gain': 'torque of one unit of command', 'back_emf': 'torque lost with speed',
    'kf': 'share of the reference speed in kd',
}
"""What a number of a joint is called where its name does not say it."""
