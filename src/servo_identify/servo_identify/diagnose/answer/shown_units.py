"""In which units an answer speaks: in those of the side of the axis that it speaks of."""

from __future__ import annotations

from servo_twin.physics.servo import Servo

from ..handover.curves import Curve
from ..mechanisms.hypothesis import Form, Mechanism, UNKNOWN

CHANNELS = {'torque': 'N m', 'current': 'A'}
"""Units of channels that are no angle, of an axis that turns."""
AT_LOAD = ('angle', 'load', 'acceleration')
"""Variables that are those of the load where the mechanism has no name."""


def channel_unit(servo: Servo, channel: str) -> str:
    """Return the unit of a channel of a servo; the torsion is counted at the load."""
    return servo.reads(CHANNELS.get(channel, 'rad'), channel)


def curve_units(servo: Servo, mechanism: Mechanism, curve: Curve | Form) -> tuple[str, str]:
    """Return the units of the variable and of the value of a curve, at the shaft of each."""
    over = mechanism.site
    if mechanism.name == UNKNOWN and curve.variable in AT_LOAD:
        over = 'load'
    elif mechanism.name == 'kinematic_error':  # an error of the load over the turn of the motor
        over = 'motor'
    return servo.reads(curve.unit, over), servo.reads(curve.y_unit, mechanism.site)
