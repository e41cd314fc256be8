"""Whole recordings through a servo: arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count

import numpy as np

from .kernel import fresh_state, kernel_of
from .servo import Servo
from .state import (
    ADDED_COMMAND,
    CLOSED_LOOP,
    COUPLED_POSITION,
    EXTERNAL,
    FORCED_MOTION,
    INPUTS,
    LOAD_ANGLE,
    LOAD_DIRECTION,
    LOAD_REVERSAL,
    LOAD_SPEED,
    MODES,
    MOTOR_ANGLE,
    MOTOR_DIRECTION,
    MOTOR_REVERSAL,
    MOTOR_SPEED,
    OBSERVER,
    OUTPUTS,
    REFERENCE_POSITION,
    REFERENCE_VELOCITY,
    TEMPERATURE,
    VOLTAGE,
)

ROOM_TEMPERATURE = 20.0  # degC, where none is measured
UNMOVED = 1e15  # kg m2: a rotor that no torque moves


def inputs_of(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """
    Put the columns of a recording into the order of the kernel, shape (samples, len(INPUTS)).

    What is missing (NaN) of external torque, references, command, added command, coupled position
    and temperature becomes zero (or room temperature); measured positions stay NaN, which the
    kernel takes as not measured. There may be no coupled position and no added command.
    """
    nothing = np.zeros(len(columns[INPUTS[VOLTAGE]]))
    columns = {INPUTS[COUPLED_POSITION]: nothing, INPUTS[ADDED_COMMAND]: nothing, **columns}
    u = np.column_stack([np.asarray(columns[name], dtype=float) for name in INPUTS])
    for column in (VOLTAGE, REFERENCE_VELOCITY, REFERENCE_POSITION, EXTERNAL,
                   COUPLED_POSITION, ADDED_COMMAND):
        np.nan_to_num(u[:, column], copy=False, posinf=np.inf, neginf=-np.inf)
    warm = u[:, TEMPERATURE]
    warm[np.isnan(warm)] = ROOM_TEMPERATURE
    return np.ascontiguousarray(u)


def substeps_of(servo: Servo, period: float) -> tuple[int, float]:
    """Return (steps a sample, step in s), the step being at most that of the servo file."""
    substeps = max(1, int(np.ceil(period / servo.step - 1e-9)))
    return substeps, period / substeps


def initial_state(servo: Servo, motor: float = np.nan, load: float = np.nan,
                  torque: float = 0.0, load_speed: float = 0.0,
                  theta: np.ndarray | None = None, on: np.ndarray | None = None) -> np.ndarray:
    """
    Return the state in which a recording begins.

    Angles in rad as the encoders read (NaN: not measured, follows from the other one), ``torque``
    in N m on the load, speed in rad/s at the load. The zero of the torsion is set so that the
    state carries ``torque`` at rest: the zeros of two encoders are never the same.
    """
    kernel = kernel_of(servo)
    theta = servo.theta if theta is None else theta
    on = servo.switches if on is None else on
    ratio = theta[servo.slots()['mechanism.ratio'].start]
    motor, load = float(motor), float(load)
    if np.isnan(motor) and np.isnan(load):
        motor = load = 0.0
    motor = load * ratio if np.isnan(motor) else motor
    load = motor / ratio if np.isnan(load) else load
    x = fresh_state(kernel)
    x[MOTOR_ANGLE] = x[MOTOR_REVERSAL] = motor
    x[LOAD_ANGLE] = x[LOAD_REVERSAL] = load
    x[LOAD_SPEED], x[MOTOR_SPEED] = load_speed, load_speed * ratio
    if load_speed < 0.0:
        x[MOTOR_DIRECTION] = x[LOAD_DIRECTION] = -1.0
    kernel.align(theta, on, x, 0.0 if np.isnan(torque) else float(torque))
    return x


def simulate(servo: Servo, u: np.ndarray, period: float, x: np.ndarray,
             mode: str = 'measured_input', theta: np.ndarray | None = None,
             on: np.ndarray | None = None) -> np.ndarray:
    """
    Run a servo over inputs and return what its sensors read, shape (samples, len(OUTPUTS)).

    ``u`` as of :func:`inputs_of`, ``period`` in s, ``x`` the state to begin in, advanced in place.
    ``theta`` and ``on`` override values and switches of the servo. Raises KeyError for an unknown
    mode.
    """
    if mode not in MODES:
        raise KeyError(f'there is no mode {mode!r}; there are {list(MODES)}')
    if MODES[mode] == CLOSED_LOOP and not servo.controller.parameters:
        raise ValueError(f'{servo.name}: closed_loop needs a controller; the servo file has none')
    if MODES[mode] == OBSERVER and not servo.mechanism.correctable:
        raise ValueError(f'{servo.name}: observer needs a mechanism whose state can be pulled')
    substeps, h = substeps_of(servo, period)
    y = np.empty((len(u), len(OUTPUTS)))
    theta = led(servo, servo.theta if theta is None else theta, mode)
    kernel_of(servo).run(theta, servo.switches if on is None else on, x, u, y, substeps, h,
                         MODES[mode])
    return y


def led(servo: Servo, theta: np.ndarray, mode: str) -> np.ndarray:
    """
    Return the values with which the kernel runs in a mode.

    Where the motor's encoder leads the motor, nothing that acts on the rotor moves it: it has an
    inertia without bound. Raises ValueError for a mechanism that has no rotor to lead.
    """
    if MODES[mode] != FORCED_MOTION:
        return theta
    slot = servo.slots().get('mechanism.rotor_inertia')
    if slot is None or not servo.mechanism.correctable:
        raise ValueError(f'{servo.name}: forced_motion needs a mechanism with a rotor that can be '
                         'led')
    theta = theta.copy()
    theta[slot] = UNMOVED
    return theta


def simulate_many(servo: Servo, u: np.ndarray, period: float, x: np.ndarray,
                  thetas: Sequence[np.ndarray], ons: Sequence[np.ndarray] | None = None,
                  mode: str = 'measured_input', workers: int | None = None) -> np.ndarray:
    """
    Run a servo with several sets of values from the same state, on all cores.

    Returns shape (sets, samples, len(OUTPUTS)); ``x`` is left as it is.
    """
    ons = [servo.switches] * len(thetas) if ons is None else ons
    kernel_of(servo)

    def one(pair: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        return simulate(servo, u, period, x.copy(), mode, *pair)

    with ThreadPoolExecutor(workers or cpu_count()) as pool:
        return np.array(list(pool.map(one, zip(thetas, ons, strict=True))))
