"""Drives: from the command to the motor current."""

from .effect import Parameter
from .part import MotorDrive


class CurrentDrive(MotorDrive):
    r"""
    A drive whose current loop is fast against everything else.

    .. math:: i = K_a U_a

    Holds below the bandwidth of the current loop; `current_lag` adds that.
    """

    source = 'paper 000 eq. 1'

    gain = Parameter(0.49, 'A/V', (-1e4, 1e4), 'Current for one volt of command, K_a.')
    torque_constant = Parameter(0.4878, 'N m/A', (1e-9, 1e5), 'Torque of one ampere, K_m.')

    @staticmethod
    def law(p, current, command, speed, h):
        return p.gain * command


class VoltageDrive(MotorDrive):
    r"""
    A voltage across a brushed (or equivalent) winding.

    .. math:: L\,\dot i + R\,i + k_e\,\omega = K_v v

    Implicit Euler, so that an inductance of zero is allowed.
    """

    source = 'paper 004 eq. 1'

    gain = Parameter(1.0, 'V/V', (-1e4, 1e4), 'Volts at the winding for one volt of command.')
    resistance = Parameter(1.0, 'ohm', (1e-6, 1e6), 'Of the winding and the leads.')
    inductance = Parameter(0.0, 'H', (0.0, 1e3), 'Of the winding.', off=0.0)
    back_emf = Parameter(0.1, 'V s/rad', (0.0, 1e5), 'Volts at one radian a second.', off=0.0)
    torque_constant = Parameter(0.1, 'N m/A', (1e-9, 1e5), 'Torque of one ampere.')

    @staticmethod
    def law(p, current, command, speed, h):
        drop = p.gain * command - p.back_emf * speed
        return (p.inductance * current + h * drop) / (p.inductance + h * p.resistance)
