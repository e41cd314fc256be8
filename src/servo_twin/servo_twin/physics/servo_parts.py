"""The parts that every servo has: a drive, a mechanism, a controller, sensors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from .effect import Declared, Effect, Parameter


class Part(Declared):
    """A part of a servo that is chosen by its name in the servo file."""

    source: ClassVar[str] = ''
    memory: ClassVar[int] = 0
    """How many numbers a drive or a mechanism remembers beside the state that all servos have."""


class MotorDrive(Part):
    """
    What makes torque of a command.

    ``law(p, current, command, speed, h)`` returns the current h later, A; the torque on the motor
    shaft is ``p.torque_constant`` times the current. No memory but the current.
    """


class DigitalDrive(MotorDrive):
    """
    A drive with loops of its own that run at their own cycles, between two samples.

    ``law(p, s, command, angle, speed, h)`` advances the drive by h at the motor's angle (rad) and
    speed (rad/s), of the beginning of h, and returns the current h later, A, as a MotorDrive's
    law does. ``s`` is its memory, shape (memory,), zero at the start, updated in place.
    """


class Mechanism(Part):
    """
    What moves.

    ``step(p, theta, on, x, current_torque, external, temperature, h)`` advances the state in
    place; it is copied into the kernel and may use the names of :mod:`.ideal_ports`. ``x[ADDED]``
    is the inertia (kg m2) that the load has beside the mechanism's own, ``x[SWELL]`` its growth S
    (kg m2/s). Its torque is S w over 1 + h S / J, so that 1 / w grows by h S / (J w): seen from
    either end of a step the growth is the same, and no energy is lost.
    ``rest(p, torque)`` returns the torsion (rad at the load) that carries a torque at rest,
    ``pull(p, wind_up, rate)`` the torque of the linear mesh. What it remembers, zero at the start,
    begins at ``x[MECHANISM]``. ``slides`` says that the load of a turning motor moves straight:
    what stands in rad, N m and kg m2 at the load is in m, N and kg there. ``correctable`` says
    that angles and speeds in the state may be pulled by measurements, ``restartable`` that it
    begins at any of them.
    """

    step: ClassVar[Callable[..., None]]
    rest: ClassVar[Callable[..., float]]
    pull: ClassVar[Callable[..., float]]
    compliant: ClassVar[bool]
    slides: ClassVar[bool] = False
    carries: ClassVar[bool] = False
    """Whether its load may have more inertia than its own: it minds ``x[ADDED]``."""
    correctable: ClassVar[bool] = True
    restartable: ClassVar[bool] = True

    @classmethod
    def refuses(cls, effect: type[Effect], site: str, values: Mapping[str, object]) -> str:
        """Say why an effect cannot act at a site of this mechanism, or return ''."""
        if not cls.compliant and effect.port in ('mesh', 'clearance'):
            return 'needs a mesh that winds up, and the mechanism is rigid'
        return ''

    @classmethod
    def springs(cls, values: Mapping[str, Any], stiffer: float, denser: float
                ) -> tuple[Any, Any, Any] | None:
        """
        Return inertias (n,), springs and dampers (n, n) near rest, the motor first, the load last.

        ``values`` by the names of the parameters; ``stiffer`` and ``denser`` are what effects add
        to the stiffness and damping of the mesh. None where they are not known.
        """
        return None

    @classmethod
    def running(cls, run: Callable[..., Any], servo: Any) -> Callable[..., Any]:
        """Return what runs in place of a kernel's compiled `run`, for mechanisms beside it."""
        return run


class Controller(Part):
    """
    What makes the command of a reference, once a sample.

    ``law(p, s, reference_position, reference_velocity, added, motor, load, ratio, period)`` with
    the readings of the two encoders (rad) returns the command, V (A where the drive takes a
    current). ``added`` is what stands beside the feedback in the same unit, before the limit: a
    torque that is fed forward, an excitation. ``s`` holds four numbers, the first of which is 0
    before the first call.
    """

    law: ClassVar[Callable[..., float]]


class SensorPart(Part):
    """A sensor that the machine has; what it does wrong is an effect at its channel."""

    channel: ClassVar[str]


class Correction(Part):
    r"""
    How the measurements pull the twin's state when it runs as an observer.

    Each measured shaft: a critically damped two-state filter, with ``a = exp(-bandwidth T)``,

    .. math:: \theta \mathrel{+}= (1 - a^2)\,e, \quad \omega \mathrel{+}= (1 - a)^2\,e / T
    """

    source = 'Brookner, Tracking and Kalman Filtering Made Easy, 1998, eq. 1.2-16'

    bandwidth = Parameter(60.0, 'rad/s', (0.0, 1e4), 'How fast an error dies away.', off=0.0,
                          told=False)
