"""
What a machine does beyond its plant, compiled: terms at a port, and elements with memory.

A term is a product of up to three tabulated curves, each of one variable; those of one port are
summed up. A curve is any Python function (`fault_terms.py` tabulates it).
"""

from __future__ import annotations

from math import asinh, exp, floor, pi, sin, sqrt

from numba import njit
import numpy as np

VARIABLES = ('motor_angle', 'load_angle', 'motor_speed', 'load_speed', 'motor_rate', 'load_rate',
             'direction', 'flank', 'torque', 'driven_torque', 'current', 'command', 'time',
             'temperature_rise', 'contact', 'rest')
(MOTOR_ANGLE, LOAD_ANGLE, MOTOR_SPEED, LOAD_SPEED, MOTOR_RATE, LOAD_RATE, DIRECTION, FLANK, TORQUE,
 DRIVEN_TORQUE, CURRENT, COMMAND, TIME, RISE, CONTACT, REST) = range(len(VARIABLES))
PORTS = ('motor_friction', 'load_friction', 'motor_torque', 'load_torque', 'command',
         'gear_torque', 'motor_error', 'load_error', 'gap', 'gap_by_load', 'stiffness',
         'rotor_inertia', 'load_inertia', 'motor_reading', 'load_reading', 'torque_reading',
         'current_reading')
(MOTOR_FRICTION, LOAD_FRICTION, MOTOR_TORQUE, LOAD_TORQUE, COMMAND_ADDED, GEAR_TORQUE, MOTOR_ERROR,
 LOAD_ERROR, GAP, GAP_BY_LOAD, STIFFNESS, ROTOR_ADDED, LOAD_ADDED, MOTOR_READING, LOAD_READING,
 TORQUE_READING, CURRENT_READING) = np.arange(len(PORTS))  # no literals: compiled once for all
NODES, ELEMENTS = 1024, 12
SLIP_ELEMENTS, DAHL, ELASTOPLASTIC, RELAXING = 1, 2, 3, 4  # kinds of elements

# Terms are one row of numbers: where the terms of each port begin, and the end of the last; six of
# each term, the variables of up to three factors (-1: none) and where their tables begin; and each
# table: where it begins, cells per unit, warp, whether it repeats, and its nodes, over even cells
# of asinh(x / warp) or of x.


@njit(cache=True, error_model='numpy')
def look(laws, table, at):
    """Return the value of a table and its slope."""
    steep, warp = laws[table + 1], laws[table + 2]
    if warp > 0.0:
        steep /= sqrt(at * at + warp * warp)
        at = asinh(at / warp)
    cell = (at - laws[table]) * laws[table + 1]
    if laws[table + 3] > 0.0:
        cell -= NODES * floor(cell / NODES)
    else:
        cell = min(max(cell, 0.0), NODES - 1e-9)
    i = min(int(cell), NODES - 1)
    left, right = laws[table + 4 + i], laws[table + 5 + i]
    return left + (cell - i) * (right - left), (right - left) * steep


@njit(cache=True, error_model='numpy')
def total(laws, port, x):
    """Return the sum of the terms of a port, and its slope by their first variables."""
    value, slope = 0.0, 0.0
    if laws[port] == laws[port + 1]:
        return value, slope
    for n in range(int(laws[port]), int(laws[port + 1]), 6):
        product, rise = look(laws, int(laws[n + 3]), x[int(laws[n])])
        for j in range(1, 3):
            if laws[n + j] >= 0.0:
                factor = look(laws, int(laws[n + 3 + j]), x[int(laws[n + j])])[0]
                product *= factor
                rise *= factor
        value += product
        slope += rise
    return value, slope


# Elements with memory at the friction of motor (0) and load (1) and in the gear (2) are a row
# each: kind, height (N m, of the gear alone), power, then the reach (rad), weight and lapse (s; 0:
# never) of each element.
REACH, WEIGHT, LAPSE = 3, 3 + ELEMENTS, 3 + 2 * ELEMENTS


@njit(cache=True, error_model='numpy')
def held(memory, z):
    """Return what elements with memory hold, as a share of their height."""
    if memory[0] == SLIP_ELEMENTS or memory[0] == RELAXING:
        share = 0.0
        for i in range(ELEMENTS):
            share += memory[WEIGHT + i] * z[i]
        return share
    return z[0]


@njit(cache=True, error_model='numpy')
def tangent(memory, z, way):
    """Return how fast that share rises for a motion one way, 1/rad."""
    kind, power = memory[0], memory[2]
    if kind == SLIP_ELEMENTS or kind == RELAXING:
        rise = 0.0
        for i in range(ELEMENTS):
            if memory[WEIGHT + i] > 0.0 and (kind == RELAXING or z[i] * way < 1.0):
                rise += memory[WEIGHT + i] / memory[REACH + i]
        return rise
    along = z[0] * way
    if kind == DAHL:
        return max(1.0 - along, 0.0)**power / memory[REACH]
    slips = 0.0
    if along > power:
        slips = 0.5 + 0.5 * sin(pi * (min(along, 1.0) - 0.5 * (1.0 + power)) / (1.0 - power))
    return max(1.0 - slips * along, 0.0) / memory[REACH]


@njit(cache=True, error_model='numpy')
def stretch(memory, z, moved, h):
    """Let elements with memory follow a motion, rad, in a time, s."""
    kind = memory[0]
    if kind == SLIP_ELEMENTS or kind == RELAXING:
        for i in range(ELEMENTS):
            if memory[WEIGHT + i] > 0.0:
                z[i] += moved / memory[REACH + i]
                if kind == SLIP_ELEMENTS:
                    z[i] = min(max(z[i], -1.0), 1.0)
                elif memory[LAPSE + i] > 0.0:
                    z[i] *= exp(-h / memory[LAPSE + i])
    elif moved != 0.0:
        way = 1.0 if moved > 0.0 else -1.0
        z[0] = min(max(z[0] + moved * tangent(memory, z, way), -1.0), 1.0)
