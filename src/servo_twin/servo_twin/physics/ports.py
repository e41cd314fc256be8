"""
Where an effect can act, what its law is shown there, what it returns and how several combine.

Signs, once for all: positive angle, speed and torque point the same way on both shafts; the
torsion is ``motor_angle / ratio - load_angle - error``; the transmitted torque is the torque on
the load; friction resists; an external torque resists the load.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

from .effect import Effect


class Shaft(NamedTuple):
    """What a law at a shaft sees: its own side's quantities."""

    angle: float  # rad, of this shaft
    speed: float  # rad/s, of this shaft
    direction: float  # +1 or -1: of the motion that is about to happen, never 0
    torque: float  # N m, transmitted by the mesh, as felt at this shaft, unsigned by friction
    travel: float  # rad, since this shaft last reversed, never negative
    current: float  # A, motor current
    temperature: float  # degC
    time: float  # s, since the start of the run


class Teeth(NamedTuple):
    """What a law in the mesh sees before torque is known."""

    motor_angle: float  # rad
    load_angle: float  # rad
    direction: float  # +1 or -1, of the load shaft
    travel: float  # rad, since the load shaft last reversed
    torque: float  # N m, transmitted a step ago
    driven: float  # rad at the load, what the motor's angle would turn it without any loss


class WindUp(NamedTuple):
    """What a law of the mesh torque sees."""

    angle: float  # rad at the load shaft, what is left after error and clearance
    rate: float  # rad/s at the load shaft; 0 while the teeth do not touch
    load_angle: float  # rad


class Signal(NamedTuple):
    """What a law on the way from command to current sees."""

    value: float  # V before the drive, A behind it
    speed: float  # rad/s, motor shaft
    time: float  # s, since the start of the run


class Reading(NamedTuple):
    """What a law of a sensor sees, once a sample."""

    value: float  # what the sensor would read so far, in the unit of its channel
    angle: float  # rad, true angle of the shaft the sensor sits on; of torque the load's
    speed: float  # rad/s, of that shaft
    time: float  # s, since the start of the run
    reference: float  # rad at the load, that the position loop is told; 0 where there is none


class Carried(NamedTuple):
    """What a law of an inertia sees, at each step."""

    angle: float  # rad, of the load shaft
    coupled_angle: float  # rad, of the axis that this one carries; 0 where none is recorded
    time: float  # s, since the start of the run


class Drive(Effect):
    """The command (V) or the current (A) on its way; returns the new value; in order."""

    port = 'drive'
    motion = Signal
    sites: ClassVar[tuple[str, ...]] = ('command', 'current')
    combine = 'order'


class Torque(Effect):
    """A torque on a shaft, N m, signed like the angle; several add up."""

    port = 'torque'
    motion = Shaft
    sites: ClassVar[tuple[str, ...]] = ('motor', 'load')
    combine = 'sum'


class Friction(Effect):
    """
    What a bearing can resist with, N m; several add up.

    A law may return a negative share (less friction in one direction); the sum of a shaft is cut
    at zero, so that friction never drives. Sign and sticking are the integrator's business.
    """

    port = 'friction'
    motion = Shaft
    sites: ClassVar[tuple[str, ...]] = ('motor', 'load')
    combine = 'sum'


class MeshError(Effect):
    """
    Angle lost by the shape of the teeth, rad at the load shaft; several add up.

    An error that goes with the motor has also a pure ``motor_slope(p, motion)``, the derivative of
    its law by the motor angle, rad/rad: a compliant mechanism lets it act back on the motor.
    """

    port = 'mesh_error'
    motion = Teeth
    sites: ClassVar[tuple[str, ...]] = ('mesh',)
    combine = 'sum'


class Clearance(Effect):
    """
    Width of the gap in which the teeth do not touch, rad at the load shaft; several add up.

    As friction is a budget of torque, clearance is a budget of angle: the mechanism takes from the
    torsion what the gap swallows, up to half the width to either side. The sum is cut at zero.
    """

    port = 'clearance'
    motion = Teeth
    sites: ClassVar[tuple[str, ...]] = ('mesh',)
    combine = 'sum'


class Mesh(Effect):
    """Torque on the load by the torsion, N m, beside the linear stiffness; several add up."""

    port = 'mesh'
    motion = WindUp
    sites: ClassVar[tuple[str, ...]] = ('mesh',)
    combine = 'sum'


class Inertia(Effect):
    """
    Inertia of the load shaft beside that of the mechanism, kg m2; several add up.

    Asked at each step; what another axis or the time changes is taken from sample to sample. There
    the shaft keeps its angular momentum. One that goes with its own angle has also a pure
    ``angle_slope(p, motion)``, the derivative of its law by that angle, kg m2/rad: it keeps its
    energy, half of the growth is given back.
    """

    port = 'inertia'
    motion = Carried
    sites: ClassVar[tuple[str, ...]] = ('load',)
    combine = 'sum'


class Sensor(Effect):
    """A reading, in the unit of its channel; returns the new reading; in order."""

    port = 'sensor'
    motion = Reading
    sites: ClassVar[tuple[str, ...]] = ('motor_position', 'load_position', 'torque', 'current')
    combine = 'order'


PORTS = {port.port: port for port in (
    Drive, Torque, Friction, MeshError, Clearance, Mesh, Inertia, Sensor)}
