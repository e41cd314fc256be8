"""A servo drive of three phases: digital loops, inverter and a permanent-magnet motor."""

from numba import njit

from .effect import Parameter
from .elementary_functions import cos_sin
from .servo_parts import DigitalDrive
from .three_phase import averaged, clarke, duties, park, stator, turned_back, winding

# the memory of the drive
TO_CURRENT, TO_VELOCITY = 0, 1  # s to the current loop's next run; its runs to the velocity's
STARTED, LAST_ANGLE = 2, 3  # 1 once it has run; rad, where the velocity loop last saw the motor
VELOCITY_SUM, WANTED = 4, 5  # A, the integral; A, what the current loop is told
SUM_D, SUM_Q = 6, 7  # V
D, Q = 8, 9  # A
VOLTAGE_D, VOLTAGE_Q, FROM = 10, 11, 12  # V, in the rotor frame as it stood at the angle FROM, rad
DUTY_A, DUTY_B, DUTY_C = 13, 14, 15


@njit(error_model='numpy')
def through_edges(p, s, angle, omega, flux, h):
    """
    Return the currents (d, q) h later, A, through every edge of the inverter on the way.

    ``omega`` is the electrical speed, rad/s. A phase conducts from the upper switch in the middle
    of the cycle of the current loops, for its share of it.
    """
    d, q, cycle = s[D], s[Q], p.current_cycle
    begin = cycle - s[TO_CURRENT]
    now, end = begin, begin + h
    while now < end:
        until = end
        for k in range(3):
            for way in (-1.0, 1.0):
                edge = 0.5 * cycle * (1.0 + way * s[DUTY_A + k])
                if now < edge < until:
                    until = edge
        middle = 0.5 * (now + until)
        off = abs(2.0 * middle / cycle - 1.0)
        alpha, beta = clarke(p.bus_voltage * (off < s[DUTY_A]), p.bus_voltage * (off < s[DUTY_B]),
                             p.bus_voltage * (off < s[DUTY_C]))
        c, sine = cos_sin(p.pole_pairs * angle + omega * (middle - begin))
        voltage_d, voltage_q = park(alpha, beta, c, sine)
        d, q = winding(d, q, voltage_d, voltage_q, omega, p.phase_resistance, p.d_inductance,
                       p.q_inductance, flux, until - now)
        now = until
    return d, q


class PmsmDrive(DigitalDrive):
    r"""
    The drive that is told a speed: velocity loop, current loops, space vector modulation, motor.

    Each loop runs at its own cycle, and what it says is held until it runs again; its law is

    .. math:: u(k) = k_p\,e(k) + \frac{k_p}{T_i} \sum_{j=0}^k e(j)\,T

    with :math:`k_p = g_v J / K_t` of the velocity loop, on the difference of the motor's angle
    over a cycle, and :math:`k_p = g_i L_q` of the current loops, which hold the d current at zero.
    The integrals stand still while the output is at its limit: the current's, and the circle
    within the inverter's hexagon. The motor is that of eq. 16 to 20 of the paper,

    .. math:: T = \tfrac{3}{2} p\,(\psi_d i_q - \psi_q i_d)

    and what it tells as its current is T over the torque constant, the q current where both
    inductances are alike. The inverter gives the average of its cycle, or, ``switching``, each
    edge of it. Iron losses, the inverter's dead time and the time of computing are left out.
    """

    source = 'paper 001 section 2.3 and 2.4, table 2'
    memory = 16

    speed_gain = Parameter(20.0, 'rad/s/V', (1e-6, 1e6), 'Motor speed for one volt of command.',
                           required=True)
    torque_constant = Parameter(1.02, 'N m/A', (1e-9, 1e5), 'Torque of one ampere of q current.',
                                required=True)
    pole_pairs = Parameter(4.0, '', (1.0, 100.0), 'Of the motor.', required=True)
    phase_resistance = Parameter(0.184, 'ohm', (1e-6, 1e6), 'Of one phase.', required=True)
    d_inductance = Parameter(2.3e-3, 'H', (1e-9, 1e3), 'Along the magnets.', required=True)
    q_inductance = Parameter(2.3e-3, 'H', (1e-9, 1e3), 'Across the magnets.', required=True)
    bus_voltage = Parameter(560.0, 'V', (1e-3, 1e6), 'Direct voltage that feeds the inverter.',
                            required=True)
    current_limit = Parameter(35.0, 'A', (1e-3, 1e6), 'Largest q current that is asked for.',
                              required=True)
    current_cycle = Parameter(31.25e-6, 's', (1e-7, 1e-2), 'Of the current loops.', required=True)
    current_gain = Parameter(5000.0, '1/s', (0.0, 1e6), 'Gain of the current loops, over L.',
                             required=True)
    current_time = Parameter(9.8e-3, 's', (1e-6, 1e3), 'Integral time of the current loops.',
                             required=True)
    velocity_cycle = Parameter(125e-6, 's', (1e-7, 1e-1), 'Of the velocity loop.', required=True)
    velocity_gain = Parameter(800.0, '1/s', (0.0, 1e6), 'Gain of the velocity loop, over J.',
                              required=True)
    velocity_time = Parameter(0.04, 's', (1e-6, 1e3), 'Integral time of the velocity loop.',
                              required=True)
    tuned_inertia = Parameter(0.01, 'kg m2', (0.0, 1e4), 'Inertia the velocity loop is set for.',
                              required=True)
    switching = Parameter(0.0, '', (0.0, 1.0), '1: the inverter switches, 0: its average.')

    @staticmethod
    def law(p, s, command, angle, speed, h):
        if s[STARTED] == 0.0:
            s[STARTED], s[LAST_ANGLE] = 1.0, angle - p.velocity_cycle * speed

        # the loops, each at the step nearest to the end of its cycle
        since = angle - s[FROM]
        if s[TO_CURRENT] < 0.5 * h:
            if s[TO_VELOCITY] < 0.5:
                s[TO_VELOCITY] += round(p.velocity_cycle / p.current_cycle)
                seen = (angle - s[LAST_ANGLE]) * (1.0 / p.velocity_cycle)
                error = p.speed_gain * command - seen
                s[LAST_ANGLE] = angle
                gain = p.velocity_gain * p.tuned_inertia / p.torque_constant
                summed = s[VELOCITY_SUM] + gain * p.velocity_cycle / p.velocity_time * error
                wanted = gain * error + summed
                if abs(wanted) <= p.current_limit:
                    s[VELOCITY_SUM] = summed
                s[WANTED] = min(max(wanted, -p.current_limit), p.current_limit)
            s[TO_VELOCITY] -= 1.0
            gain = p.current_gain * p.q_inductance
            share = gain * p.current_cycle / p.current_time
            error = s[WANTED] - s[Q]
            sum_d, sum_q = s[SUM_D] - share * s[D], s[SUM_Q] + share * error
            voltage_d = s[SUM_D] - (gain + share) * s[D]
            voltage_q = s[SUM_Q] + (gain + share) * error
            square = voltage_d * voltage_d + voltage_q * voltage_q
            inside = 3.0 * square <= p.bus_voltage * p.bus_voltage
            if inside:
                s[SUM_D], s[SUM_Q] = sum_d, sum_q
            if p.switching > 0.5 or not inside:
                c, sine = cos_sin(p.pole_pairs * angle)
                alpha, beta = stator(voltage_d, voltage_q, c, sine)
                s[DUTY_A], s[DUTY_B], s[DUTY_C] = duties(alpha, beta, p.bus_voltage)
                alpha, beta = averaged(alpha, beta, p.bus_voltage)
                voltage_d, voltage_q = park(alpha, beta, c, sine)
            s[VOLTAGE_D], s[VOLTAGE_Q], s[FROM] = voltage_d, voltage_q, angle
            since = 0.0
            s[TO_CURRENT] += p.current_cycle

        # the winding, under what stands in the stator while the rotor turns on
        flux = p.torque_constant / (1.5 * p.pole_pairs)
        omega = p.pole_pairs * speed
        if p.switching > 0.5:
            s[D], s[Q] = through_edges(p, s, angle, omega, flux, h)
        else:
            turned = p.pole_pairs * since + 0.5 * h * p.pole_pairs * speed
            voltage_d, voltage_q = turned_back(s[VOLTAGE_D], s[VOLTAGE_Q], turned)
            s[D], s[Q] = winding(s[D], s[Q], voltage_d, voltage_q, omega, p.phase_resistance,
                                 p.d_inductance, p.q_inductance, flux, h)
        s[TO_CURRENT] -= h
        if p.d_inductance == p.q_inductance:
            return s[Q]
        return s[Q] * (1.0 + (p.d_inductance - p.q_inductance) / flux * s[D])
