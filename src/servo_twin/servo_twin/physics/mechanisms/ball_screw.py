"""Motor, screw and table: a ball screw that twists, stretches and has play in its nut."""

from types import SimpleNamespace

from numba import njit

from ..effect import Parameter
from ..elementary_functions import fused
from ..ideal_ports import (
    load_friction,
    load_torque,
    mesh_clearance,
    mesh_error,
    mesh_torque,
    motor_friction,
    motor_torque,
)
from ..ports import Shaft, Teeth, WindUp
from ..servo_parts import Mechanism
from ..state import (
    CURRENT,
    LOAD_ANGLE,
    LOAD_DIRECTION,
    LOAD_REVERSAL,
    LOAD_SPEED,
    MOTOR_ANGLE,
    MOTOR_DIRECTION,
    MOTOR_REVERSAL,
    MOTOR_SPEED,
    TIME,
    TORQUE,
    ZERO,
)
from .friction_step import slide

# ruff: noqa: F821  (MECHANISM is where this mechanism's memory begins)


@njit(error_model='numpy')
def reach(p, table):
    """
    Return the product of the nut's distances from either bearing, m2, the table at ``table`` (m).

    The screw is held at both ends; its nut stays within it, a twentieth of the span from either.
    """
    place = min(max(p.nut_place + table, 0.05 * p.span), 0.95 * p.span)
    return place * (p.span - place)


@njit(error_model='numpy')
def softness(p):
    """
    Return (a, b) of 1/K_L = a + b reach, rad/(N m) and per m2 of it, seen from the motor (eq. 3).

    Along the screw (eq. 5 to 7): nut and bearings, and the screw itself between them; and in
    torsion (eq. 4).
    """
    nut = 0.8 * p.nut_stiffness * (p.preload / (0.1 * p.preload_rating)) ** (1.0 / 3.0)
    held = 1.0 / nut + 1.0 / (p.bearing_stiffness + p.far_bearing_stiffness)
    torsional = 1.0 / p.coupling_stiffness + 1.0 / p.screw_stiffness
    lever = p.efficiency * p.ratio * p.ratio
    return lever * held + torsional, lever / (p.modulus * p.section * p.span)


@njit(error_model='numpy')
def compliance(p, table):
    """Return 1/K_L, rad/(N m), with the table at ``table`` (m)."""
    fixed, along = softness(p)
    return fixed + along * reach(p, table)


class BallScrew(Mechanism):
    r"""
    Motor and screw joined by one spring, screw and table by the flanks of the nut.

    .. math:: T_L = K_L (\theta_m - \theta_s), \quad
              \frac{1}{K_L} = \eta \left(\frac{2\pi}{p}\right)^2 \frac{1}{K_Z} + \frac{1}{K_T}

    .. math:: J_m\ddot\theta_m = T_e - T_L, \quad
              (J_c + J_s)\ddot\theta_s = T_L - B_s\dot\theta_s - T_t, \quad
              M\ddot S = \eta \frac{2\pi}{p} T_t - F_x - F_f

    .. math:: T_t = K_c\,\Delta\theta + d\,\dot{\Delta\theta}, \quad
              \Delta\theta = \theta_s - \frac{2\pi}{p}(S + S'), \quad
              S' = F \left(\frac{1}{K_Z} + \left(\frac{p}{2\pi}\right)^2
              \frac{1}{\eta K_T}\right)

    The load is the table, in m and N, and the flanks' stiffness and damping are given as seen from
    there: what the backlash of the nut (an effect of the transmission, b of eq. 9)
    leaves of the torsion presses the flanks. S' follows the force at once, so the spring of the
    flanks is in series with it. The paper lets the screw give way twice, in K_L and in S';
    ``deformation`` 0 leaves the second out. Efficiency is that of driving either way. The damping
    of the twist is not the paper's, and zero there. Semi-implicit Euler.
    """

    source = 'paper 001 eq. 1 to 13'
    compliant = True
    slides = True
    memory = 2  # twist of the screw behind the motor, rad, and its rate, rad/s

    rotor_inertia = Parameter(5.3e-3, 'kg m2', (1e-9, 1e3), 'Inertia on the motor shaft, J_m.',
                              required=True)
    coupling_inertia = Parameter(5e-4, 'kg m2', (0.0, 1e3), 'Of the coupling, J_c.', off=0.0,
                                 required=True)
    screw_inertia = Parameter(2e-3, 'kg m2', (1e-9, 1e3), 'Of the screw, J_s.', required=True)
    load_inertia = Parameter(200.0, 'kg', (1e-6, 1e6), 'Mass of the table, M.', required=True)
    ratio = Parameter(392.699, 'rad/m', (1e-3, 1e6), 'Motor angle for one metre, 2 pi / p.',
                      required=True)
    efficiency = Parameter(0.95, '', (1e-3, 1.0), 'Of the screw, eta.', required=True)
    screw_damping = Parameter(2e-3, 'N m s/rad', (0.0, 1e3), 'Of the screw, B_L.', off=0.0,
                              required=True)
    twist_damping = Parameter(0.0, 'N m s/rad', (0.0, 1e3), 'Between motor and screw.', off=0.0)
    coupling_stiffness = Parameter(1e4, 'N m/rad', (1e-3, 1e10), 'Of the coupling, K_tc.',
                                   required=True)
    screw_stiffness = Parameter(2e4, 'N m/rad', (1e-3, 1e10), 'Of the screw in torsion, K_ts.',
                                required=True)
    modulus = Parameter(2.06e11, 'N/m2', (1e6, 1e13), 'Of elasticity of the screw, E_bs.',
                        required=True)
    section = Parameter(9.6e-4, 'm2', (1e-8, 1.0), 'Area across the screw, A_s.', required=True)
    span = Parameter(0.9, 'm', (1e-3, 100.0), 'Between the bearings, L_sg.', required=True)
    nut_place = Parameter(0.45, 'm', (0.0, 100.0), 'Of the nut from one bearing at S = 0.',
                          required=True)
    bearing_stiffness = Parameter(3e8, 'N/m', (1.0, 1e13), 'Of one bearing along, K_ab1.',
                                  required=True)
    far_bearing_stiffness = Parameter(3e8, 'N/m', (0.0, 1e13), 'Of the other one, K_ab2.',
                                      required=True)
    nut_stiffness = Parameter(8e8, 'N/m', (1.0, 1e13), 'Of the nut at its rating, K_n0.',
                              required=True)
    preload = Parameter(3000.0, 'N', (1e-3, 1e7), 'Of the nut, F_p.', required=True)
    preload_rating = Parameter(4e4, 'N', (1e-3, 1e8), 'Dynamic load rating of the nut, C_n0.',
                               required=True)
    stiffness = Parameter(6e8, 'N/m', (1.0, 1e13), 'Of the nut flanks, K_c (2 pi / p)^2.',
                          required=True)
    damping = Parameter(1.5e5, 'N s/m', (0.0, 1e10), 'Of the flanks, d (2 pi / p)^2.', off=0.0,
                        required=True)
    deformation = Parameter(1.0, '', (0.0, 1.0), "Share of S' of eq. 11 that is taken.", off=0.0)

    @classmethod
    def springs(cls, values, stiffer, denser):
        """Return inertias, springs and dampers of motor, screw and table, the nut at its end."""
        p = SimpleNamespace(**values)
        turns, drive = 1.0 / p.ratio, p.efficiency * p.ratio
        fixed, along = softness.py_func(p)
        soft = fixed + along * 0.05 * 0.95 * p.span**2  # the screw is stiffest there
        series = 1.0 + p.deformation * p.stiffness * turns**2 * soft
        both = []
        for twist, flanks, more in ((1.0 / soft, p.stiffness, stiffer),
                                    (p.twist_damping, p.damping, denser)):
            pressed = max(0.0, turns * flanks / series + more / drive)
            both.append([[twist, -twist, 0.0],
                         [-twist, twist + pressed * turns, -pressed],
                         [0.0, -drive * pressed * turns, drive * pressed]])
        both[1][1][1] += p.screw_damping
        return [p.rotor_inertia, p.coupling_inertia + p.screw_inertia, p.load_inertia], *both

    @staticmethod
    def rest(p, torque):
        """Return the torsion (m) that carries a force on the table (N) at S = 0."""
        flank = p.ratio * p.ratio / p.stiffness + p.deformation * compliance(p, 0.0)
        return torque * flank / (p.efficiency * p.ratio * p.ratio)

    @staticmethod
    def pull(p, wind_up, rate):
        """Return the force on the table (N) at a torsion (m) and its rate (m/s), at S = 0."""
        series = 1.0 + p.deformation * p.stiffness * (1.0 / p.ratio**2) * compliance(p, 0.0)
        return p.efficiency * (p.stiffness * wind_up + p.damping * rate) / series

    @staticmethod
    def step(p, theta, on, x, current_torque, external, temperature, h):
        turns, drive = 1.0 / p.ratio, p.efficiency * p.ratio
        motor, load, time = x[MOTOR_ANGLE], x[LOAD_ANGLE], x[TIME]
        motor_speed, load_speed = x[MOTOR_SPEED], x[LOAD_SPEED]
        twist, twist_rate = x[MECHANISM], x[MECHANISM + 1]
        screw_speed = motor_speed - twist_rate

        # the screw, as long as it is between bearing and nut
        fixed, along = softness(p)
        taken, apart = p.deformation * (p.stiffness * turns * turns), reach(p, load)
        soft = fixed + along * apart
        # 1 + taken * soft, but from the table to its force is what every step waits for
        series = fused(taken * along, apart, 1.0 + taken * fixed)
        carried = twist / soft + p.twist_damping * twist_rate

        # the flanks of the nut
        driven = (motor - twist) * turns
        teeth = Teeth(motor, load, x[LOAD_DIRECTION], abs(load - x[LOAD_REVERSAL]), x[TORQUE],
                      driven)
        wind_up = driven - x[ZERO] - mesh_error(theta, on, x, teeth, h) - load
        half = 0.5 * max(mesh_clearance(theta, on, x, teeth, h), 0.0)  # in this order NaN stays
        wind_up -= min(max(-half, wind_up), half)
        touching = half == 0.0 or wind_up != 0.0
        rate = (screw_speed * turns - load_speed) if touching else 0.0
        pressed = turns * (p.stiffness * wind_up + p.damping * rate) / series
        pressed += mesh_torque(theta, on, x, WindUp(wind_up, rate, load), h) / drive
        force = drive * pressed
        x[TORQUE] = force

        # the screw's inertia
        resisted = carried - p.screw_damping * screw_speed - pressed
        screw_speed += h / (p.coupling_inertia + p.screw_inertia) * resisted

        # the motor shaft
        travel = abs(motor - x[MOTOR_REVERSAL])
        shaft = Shaft(motor, motor_speed, x[MOTOR_DIRECTION], carried, travel, x[CURRENT],
                      temperature, time)
        push = current_torque - carried + motor_torque(theta, on, x, shaft, h)
        way = 1.0 if motor_speed + h / p.rotor_inertia * push > 0.0 else -1.0
        shaft = Shaft(motor, motor_speed, way, carried, travel, x[CURRENT], temperature, time)
        budget = max(motor_friction(theta, on, x, shaft, h), 0.0)
        slide(x, MOTOR_ANGLE, MOTOR_DIRECTION, push, budget, p.rotor_inertia, h)
        x[MECHANISM + 1] = x[MOTOR_SPEED] - screw_speed
        x[MECHANISM] = twist + h * x[MECHANISM + 1]

        # the table
        travel = abs(load - x[LOAD_REVERSAL])
        shaft = Shaft(load, load_speed, x[LOAD_DIRECTION], force, travel, x[CURRENT],
                      temperature, time)
        push = force + (load_torque(theta, on, x, shaft, h) - external)
        way = 1.0 if load_speed + h / p.load_inertia * push > 0.0 else -1.0
        shaft = Shaft(load, load_speed, way, force, travel, x[CURRENT], temperature, time)
        budget = max(load_friction(theta, on, x, shaft, h), 0.0)
        slide(x, LOAD_ANGLE, LOAD_DIRECTION, push, budget, p.load_inertia, h)

        x[TIME] = time + h
