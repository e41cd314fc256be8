"""The sensors a machine may have, each with its noise floor."""

from .effect import Parameter
from .servo_parts import SensorPart


class MotorEncoder(SensorPart):
    """Angle of the motor shaft."""

    source = 'data sheet of the encoder'
    channel = 'motor_position'
    noise = Parameter(2e-4, 'rad', (0.0, 10.0), 'Standard deviation of one reading.')


class LoadEncoder(SensorPart):
    """Angle of the load shaft."""

    source = 'data sheet of the encoder'
    channel = 'load_position'
    noise = Parameter(1e-6, 'rad', (0.0, 10.0), 'Standard deviation of one reading.')


class TorqueSensor(SensorPart):
    """Torque that the transmission delivers to the load."""

    source = 'data sheet of the torque sensor'
    channel = 'torque'
    noise = Parameter(0.1, 'N m', (0.0, 1e5), 'Standard deviation of one reading.')


class CurrentSensor(SensorPart):
    """Motor current."""

    source = 'data sheet of the drive'
    channel = 'current'
    noise = Parameter(0.005, 'A', (0.0, 1e4), 'Standard deviation of one reading.')


class VoltageSensor(SensorPart):
    """Command to the drive; recorded by every rig."""

    source = 'resolution of the command'
    channel = 'voltage'
    noise = Parameter(1e-3, 'V', (0.0, 1e4), 'Standard deviation of one reading.')
