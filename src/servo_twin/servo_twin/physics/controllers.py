"""
Controllers: from a reference and the readings to the command.

What is added to the output of a controller (``added``, in the unit of the command) stands before
its limit: what is limited is what the drive is told. The torque offset of a drive acts so (CiA
402-2, objects 60B2h and 6072h), and the torque fed forward in the firmware of robot joints.
"""

from math import exp

from numba.extending import register_jitable

from .effect import Parameter
from .elementary_functions import limited
from .servo_parts import Controller

ON_LOAD = '1: feedback from the load encoder; 0: from the motor encoder, its angle over the ratio.'


@register_jitable(error_model='numpy')
def encoder_speed(s, angle, filter, period):
    r"""
    Return the speed of an encoder's angle (rad), rad/s: differences behind a low pass.

    .. math:: \hat\omega \leftarrow a\,\hat\omega + (1 - a)\,\Delta\theta / T,
              \quad a = e^{-T / T_f}

    ``filter`` is T_f and ``period`` T, s; ``s`` begins with whether it has begun, the angle
    before and the speed.
    """
    if s[0] == 0.0:
        s[0], s[1] = 1.0, angle
    keep = exp(-period / filter) if filter > 0.0 else 0.0
    s[2] = keep * s[2] + (1.0 - keep) * (angle - s[1]) / period
    s[1] = angle
    return s[2]


@register_jitable(error_model='numpy')
def limited_pi(s, error, gain, ki, limit, period, added):
    r"""
    Return the command, V, of proportional and integral action on an error of speed (rad/s).

    .. math:: u = K e + K_i \int e\,dt + u_+, \quad |u| \le u_{max}

    ``s[3]`` is the integral, V; it stands still while the output is at its limit.
    """
    more = ki * period * error
    command = gain * error + s[3] + more + added
    if abs(command) <= limit:
        s[3] += more
    return limited(command, limit)


class Open(Controller):
    """No controller: the command is given."""

    source = 'none needed'

    @staticmethod
    def law(p, s, reference_position, reference_velocity, added, motor, load, ratio, period):
        return 0.0


class VelocityPi(Controller):
    r"""
    Proportional and integral action on the speed of the load, from differences of an encoder.

    .. math:: u = K_p (\omega_r - \hat\omega) + K_i \int (\omega_r - \hat\omega)\,dt

    The integral stands still while the output is at its limit.
    """

    source = 'paper 000 section 4 (K_p 16.09, K_i 505.38)'

    kp = Parameter(16.09, 'V s/rad', (0.0, 1e7), 'Proportional gain on load speed.', off=0.0,
                   required=True)
    ki = Parameter(505.38, 'V/rad', (0.0, 1e9), 'Integral gain on load speed.', off=0.0,
                   required=True)
    filter = Parameter(0.0, 's', (0.0, 10.0), 'Time constant of the speed filter.', off=0.0)
    limit = Parameter(10.0, 'V', (0.0, 1e6), 'The command never exceeds this.')
    on_load = Parameter(0.0, '', (0.0, 1.0), ON_LOAD)

    @staticmethod
    def law(p, s, reference_position, reference_velocity, added, motor, load, ratio, period):
        angle = load if p.on_load > 0.5 else motor / ratio
        speed = encoder_speed(s, angle, p.filter, period)
        error = reference_velocity - speed
        return limited_pi(s, error, p.kp, p.ki, p.limit, period, added)


class PositionLoop(Controller):
    r"""
    A position loop around a speed loop, both proportional, the inner one with integral action.

    .. math:: u = k_v\left(k_p (\theta_r - \theta) + k_f\,\omega_r - k_d\,\hat\omega\right)
              + k_i \int (\cdot)\,dt

    With ``ki`` zero this is the loop of the EMPS bench; with ``kd`` zero as well it is the
    proportional loop of a hobby servo.
    """

    source = 'Janot, Gautier, Brunot 2019 (EMPS), eq. of the controller'

    kp = Parameter(100.0, '1/s', (0.0, 1e7), 'Position gain.', off=0.0, required=True)
    kv = Parameter(1.0, 'V s/rad', (0.0, 1e7), 'Gain of the speed loop.', off=0.0, required=True)
    ki = Parameter(0.0, 'V/rad', (0.0, 1e9), 'Integral gain of the speed loop.', off=0.0)
    kd = Parameter(1.0, '', (0.0, 10.0), 'Share of the measured speed that is fed back.', off=0.0)
    kf = Parameter(0.0, '', (0.0, 10.0), 'Share of the reference speed that is fed on.', off=0.0)
    filter = Parameter(0.0, 's', (0.0, 10.0), 'Time constant of the speed filter.', off=0.0)
    limit = Parameter(10.0, 'V', (0.0, 1e6), 'The command never exceeds this.')
    on_load = Parameter(0.0, '', (0.0, 1.0), ON_LOAD)

    @staticmethod
    def law(p, s, reference_position, reference_velocity, added, motor, load, ratio, period):
        angle = load if p.on_load > 0.5 else motor / ratio
        speed = encoder_speed(s, angle, p.filter, period)
        error = p.kp * (reference_position - angle) + p.kf * reference_velocity - p.kd * speed
        return limited_pi(s, error, p.kv, p.ki, p.limit, period, added)


class Cascade(Controller):
    r"""
    A position loop over the encoder of the load around a speed loop over that of the motor.

    .. math:: \omega_w = \mathrm{clip}(k_p (\theta_r - \theta_l), \omega_{max}), \quad
              u = k_v (\omega_w - \hat\omega_m / N) + k_i \int (\omega_w - \hat\omega_m / N)\,dt

    The backlash of the transmission lies inside the outer loop. The integral stands still while
    the output is at its limit.
    """

    source = 'closed loop of position over an encoder at the output, paper 002 (bench and model)'

    kp = Parameter(8.0, '1/s', (0.0, 1e7), 'Position gain.', off=0.0, required=True)
    kv = Parameter(1.0, 'V s/rad', (0.0, 1e7), 'Gain of the speed loop, load side.', off=0.0,
                   required=True)
    ki = Parameter(0.0, 'V/rad', (0.0, 1e9), 'Integral gain of the speed loop.', off=0.0)
    filter = Parameter(0.0, 's', (0.0, 10.0), 'Time constant of the speed filter.', off=0.0)
    speed_limit = Parameter(1e3, 'rad/s', (0.0, 1e6), 'Most speed that it asks for, load side.')
    limit = Parameter(10.0, 'V', (0.0, 1e6), 'The command never exceeds this.')

    @staticmethod
    def law(p, s, reference_position, reference_velocity, added, motor, load, ratio, period):
        angle = motor / ratio
        speed = encoder_speed(s, angle, p.filter, period)
        wanted = p.kp * (reference_position - load)
        error = limited(wanted, p.speed_limit) - speed
        return limited_pi(s, error, p.kv, p.ki, p.limit, period, added)


class Impedance(Controller):
    r"""
    A spring and a damper between the joint and its reference: what most robot joints run.

    .. math:: \tau = k_p (\theta_r - \theta) + k_d (k_f\,\omega_r - \hat\omega) + c\,u_+, \quad
              u = \mathrm{clip}(\tau, \tau_{max}) / c

    Torques are those at the load. ``command_torque`` is c, the torque at the load that the
    firmware expects of one unit of command: ratio, gain and torque constant as it knows them,
    which need not be the true ones. The torque that is fed forward is the recording's
    ``added_command`` times c; it is limited together with the rest. With ``kp`` zero the
    reference position is not needed, and the joint is damped towards the reference speed.
    Sampled, as firmware is: holds where kd times the period is well below the inertia.
    """

    source = ('Hogan: Impedance Control, ASME J. Dyn. Sys. 107(1), 1985; Katz: A Low Cost Modular '
              'Actuator for Dynamic Robots, MIT, 2018 (the same in the firmware of a joint)')

    kp = Parameter(20.0, 'N m/rad', (0.0, 1e7), 'Stiffness at the load.', off=0.0, required=True)
    kd = Parameter(0.5, 'N m s/rad', (0.0, 1e6), 'Damping at the load.', off=0.0, required=True)
    kf = Parameter(1.0, '', (0.0, 10.0), 'Share of the reference speed that is fed on.', off=0.0)
    command_torque = Parameter(1.0, 'N m/V', (1e-9, 1e7),
                               'Torque at the load that it expects of one unit of command.',
                               required=True)
    filter = Parameter(0.0, 's', (0.0, 10.0), 'Time constant of the speed filter.', off=0.0)
    torque_limit = Parameter(1e6, 'N m', (0.0, 1e7), 'Most torque at the load that it asks for.')
    on_load = Parameter(0.0, '', (0.0, 1.0), ON_LOAD)

    @staticmethod
    def law(p, s, reference_position, reference_velocity, added, motor, load, ratio, period):
        angle = load if p.on_load > 0.5 else motor / ratio
        speed = encoder_speed(s, angle, p.filter, period)
        torque = p.kd * (p.kf * reference_velocity - speed) + p.command_torque * added
        if p.kp > 0.0:
            torque += p.kp * (reference_position - angle)
        return limited(torque, p.torque_limit) / p.command_torque
