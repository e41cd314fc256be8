"""Drives: from the command to the motor current."""

from collections.abc import Mapping

from .effect import Parameter
from .servo_parts import MotorDrive


class CurrentDrive(MotorDrive):
    r"""
    A drive whose current loop is fast against everything else.

    .. math:: i = K_a U_a

    Holds below the bandwidth of the current loop; `current_lag` adds that.
    """

    source = 'paper 000 eq. 1'

    gain = Parameter(0.49, 'A/V', (-1e4, 1e4), 'Current for one volt of command, K_a.',
                     required=True)
    torque_constant = Parameter(0.4878, 'N m/A', (1e-9, 1e5), 'Torque of one ampere, K_m.',
                                required=True)

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
    resistance = Parameter(1.0, 'ohm', (1e-6, 1e6), 'Of the winding and the leads.', required=True)
    inductance = Parameter(0.0, 'H', (0.0, 1e3), 'Of the winding.', off=0.0)
    back_emf = Parameter(0.1, 'V s/rad', (0.0, 1e5), 'Volts at one radian a second.', off=0.0,
                         required=True)
    torque_constant = Parameter(0.1, 'N m/A', (1e-9, 1e5), 'Torque of one ampere.', required=True)

    @staticmethod
    def law(p, current, command, speed, h):
        drop = p.gain * command - p.back_emf * speed
        inverse = 1.0 / (p.inductance + h * p.resistance)  # once, before the first step
        return inverse * (p.inductance * current + h * drop)


class CurrentAmplifier(MotorDrive):
    r"""
    An analogue current amplifier on a brushed winding, with a proportional loop and a supply.

    .. math:: L\,\dot i + R\,i + k_e\,\omega = U_a, \quad
              U_a = \mathrm{sat}_{U_{max}}\!\left(k_p (i^* - i)\right), \quad
              i^* = \mathrm{sat}_{i_{max}}(K_a u)

    Implicit Euler, the saturation solved with the current at the end of the step, so that neither
    an inductance of zero nor a gain of any size is too fast for it. A proportional loop leaves an
    error: at rest the current is :math:`k_p/(k_p + R)` of its reference, and less by
    :math:`k_e \omega/(k_p + R)` at speed. Holds below the bandwidth of the output stage.
    """

    source = 'paper 004 sec. II B and eq. 1'

    gain = Parameter(0.2, 'A/V', (-1e4, 1e4), 'Current reference for one volt of command.',
                     required=True)
    current_limit = Parameter(2.0, 'A', (1e-6, 1e5), 'Largest reference.', required=True)
    proportional = Parameter(40.0, 'V/A', (1e-6, 1e7), 'Gain of the current loop, k_p.',
                             required=True)
    supply = Parameter(24.0, 'V', (1e-6, 1e5), 'Most that the winding gets.', required=True)
    resistance = Parameter(4.0, 'ohm', (1e-6, 1e6), 'Of the winding and the leads.', required=True)
    inductance = Parameter(2e-3, 'H', (0.0, 1e3), 'Of the winding.', off=0.0, required=True)
    back_emf = Parameter(0.05, 'V s/rad', (0.0, 1e5), 'Volts at one radian a second.', off=0.0,
                         required=True)
    torque_constant = Parameter(0.05, 'N m/A', (1e-9, 1e5), 'Torque of one ampere.', required=True)

    @staticmethod
    def law(p, current, command, speed, h):
        wanted = min(max(p.gain * command, -p.current_limit), p.current_limit)
        kept = p.inductance * current - h * p.back_emf * speed
        stiff = p.inductance + h * p.resistance
        looped = 1.0 / (stiff + h * p.proportional)  # once, before the first step
        after = looped * (kept + h * p.proportional * wanted)
        volts = p.proportional * (wanted - after)
        if abs(volts) <= p.supply:
            return after
        return (kept + h * min(max(volts, -p.supply), p.supply)) / stiff


def winding(values: Mapping[str, float]) -> tuple[float, float]:
    """
    Return gain (V/V) and resistance (ohm) of a drive that works on a winding, by a servo's values.

    Without limits a proportional current loop is a winding of more ohms. For a drive that sets a
    current: its gain (A/V) and 0; a drive without a gain has 0.
    """
    loop = values.get('drive.proportional', 0.0)
    gain, resistance = (values.get(f'drive.{name}', 0.0) for name in ('gain', 'resistance'))
    return gain * (loop or 1.0), resistance + loop
