"""A servo with its digital controller as one sampled linear system."""

from __future__ import annotations

from collections.abc import Sequence

import control
import numpy as np
from scipy.linalg import expm

from ..physics import state
from ..physics.servo import Servo, ServoError
from ..recording.joined_samples import control_values, reference_of
from .jacobian import matrices_of, slopes
from .operating_point import Point, Still
from .state_space import check, dead_of, LinearForm, response_of, system_of, units_of

REFERENCES = ('reference_velocity', 'reference_position')
_SHOWN = ('motor_position', 'load_position')  # what a controller is shown
_POINTS = 20000  # of the opened loop's response
_CHANGE = 1e-7  # of a controller's memory and of what it is shown
_RUNS = 3  # samples in which a controller at rest takes up what it is shown


def closed_loop(servo: Servo, input: str, outputs: Sequence[str], point: Point,
                period: float) -> LinearForm:
    r"""
    Return the linear form of a servo under its controller, sampled every ``period`` s.

    The plant is its continuous form between held commands (exact, dead times of the command and
    of the encoders included), the controller the derivative of its law without any error:

    .. math:: x_{k+1} = A_d x_k + B_d u_k, \quad s_{k+1} = F s_k + G (r_k, y_k), \quad
              u_k = H s_k + K (r_k, y_k)

    ``input``: a reference, `voltage` (added to the controller's command) or `external_torque`.
    ``loop`` is the opened loop from the command to what the controller answers to it, its sign
    turned round, as margins are read. Holds while the command stays below its limit. Raises
    ServoError without controller.
    """
    if reference_of(servo) is None:
        raise ServoError(f'{servo.name}: a closed loop needs a controller; the servo file has '
                         f'none')
    check(servo, input, outputs, (*REFERENCES, 'voltage', 'external_torque'))
    still = Still(servo, point)
    drives = ('voltage', 'external_torque')
    all_outputs = (*outputs, *_SHOWN)
    plant = system_of(matrices_of(still, drives, all_outputs), drives,
                      (*outputs, 'shown_motor', 'shown_load'))
    plant = _held(plant, period, (still.dead.get('command', 0.0), 0.0))
    plant = _late(plant, period, [dead_of(still, name) for name in all_outputs])
    f, g, h, k = _law(servo, point, period)
    system, loop = _joined(plant, (f, g, h, k), input, list(outputs), period)
    return LinearForm(servo.name, input, tuple(outputs), system, dict.fromkeys(outputs, 0.0),
                      point, still.command, still.carried, still.left_out, units_of(servo), loop)


def margins(form: LinearForm) -> dict[str, float]:
    """
    Return gain margin (dB), phase margin (deg) and their frequencies (Hz) of a closed loop.

    Where the response of the opened loop crosses more than once, the smallest margin; a negative
    gain margin says how far the gain may fall. NaN where nothing is crossed.
    """
    highest = 0.5 / form.loop.dt
    frequency = np.geomspace(1e-5 * highest, highest, _POINTS)
    answer = response_of(form.loop, frequency)
    found = dict.fromkeys(('gain margin, dB', 'at, Hz', 'phase margin, deg', 'crossover, Hz'),
                          float('nan'))
    for name, size, key in (('phase', np.abs(answer) - 1.0, 'crossover, Hz'),
                            ('gain', answer.imag, 'at, Hz')):
        best = np.inf
        for i in np.flatnonzero(size[1:] * size[:-1] < 0.0):
            share = size[i] / (size[i] - size[i + 1])
            there = answer[i] + share * (answer[i + 1] - answer[i])
            if name == 'gain' and there.real >= 0.0:
                continue
            margin = (-20.0 * np.log10(abs(there)) if name == 'gain'
                      else (np.degrees(np.angle(there)) + 360.0) % 360.0 - 180.0)
            if abs(margin) < best:
                best = abs(margin)
                found['gain margin, dB' if name == 'gain' else 'phase margin, deg'] = float(margin)
                found[key] = float(frequency[i] + share * (frequency[i + 1] - frequency[i]))
    return found


def _held(plant: control.StateSpace, period: float, dead: Sequence[float]) -> control.StateSpace:
    """
    Sample a plant whose inputs are held and then arrive late, exactly.

    Astrom, Wittenmark: Computer-Controlled Systems, 1997, sec. 2.3.
    """
    n, m = plant.B.shape
    a = expm(plant.A * period)
    b = np.zeros((n, 0))
    waiting: list[tuple[int, np.ndarray]] = []
    for j in range(m):
        whole, rest = divmod(dead[j], period)
        column = plant.B[:, j:j + 1]
        old = expm(plant.A * (period - rest)) @ _integral(plant.A, rest) @ column
        new = _integral(plant.A, period - rest) @ column
        b = np.hstack([b, new if whole == 0.0 else 0.0 * new])
        if dead[j] > 0.0:
            waiting.append((j, np.hstack([0.0 * new if k < whole else new if k == whole else old
                                          for k in range(int(whole) + 2)])))
    d, c = plant.D.copy(), plant.C
    for j, taps in waiting:  # a row of commands on their way: taps[:, k] of that k samples ago
        depth = taps.shape[1] - 1
        grown = np.zeros((len(a) + depth, len(a) + depth))
        grown[:len(a), :len(a)] = a
        grown[:n, len(a):] = taps[:, 1:]
        grown[len(a) + 1:, len(a):-1] = np.eye(depth - 1)
        b = np.vstack([b, np.zeros((depth, m))])
        b[len(a), j] = 1.0
        c = np.hstack([c, np.zeros((len(c), depth))])
        c[:, -1] += d[:, j]  # what passes through at once arrives with the rest
        d[:, j] = 0.0
        a = grown
    names = [*plant.state_labels, *(f'command[-{i + 1}]' for i in range(len(a) - n))]
    return control.ss(a, b, c, d, period, states=names, inputs=plant.input_labels,
                      outputs=plant.output_labels, remove_useless_states=False)


def _integral(a: np.ndarray, over: float) -> np.ndarray:
    """Return the integral of exp(a t) from 0 to ``over``."""
    n = len(a)
    both = np.zeros((2 * n, 2 * n))
    both[:n, :n], both[:n, n:] = a, np.eye(n)
    return expm(both * over)[:n, n:]


def _late(plant: control.StateSpace, period: float, dead: Sequence[float]) -> control.StateSpace:
    """Let outputs be read late; between two samples lies a straight line, as sensors read."""
    a, b, c, d = plant.A, plant.B, plant.C.copy(), plant.D.copy()
    names = list(plant.state_labels)
    for i, late in enumerate(dead):
        if late <= 0.0:
            continue
        whole, rest = int(late / period), late / period - int(late / period)
        depth, n = whole + 1, len(a)
        taps = np.zeros(depth + 1)
        taps[whole], taps[whole + 1] = 1.0 - rest, rest
        a = np.block([[a, np.zeros((n, depth))], [np.zeros((depth, n)), np.eye(depth, k=-1)]])
        a[n, :n] = c[i, :n]
        b = np.vstack([b, np.zeros((depth, b.shape[1]))])
        b[n] = d[i]
        c = np.hstack([c, np.zeros((len(c), depth))])
        c[i] *= taps[0]
        c[i, n:] += taps[1:]
        d[i] *= taps[0]
        names += [f'{plant.output_labels[i]}[-{k + 1}]' for k in range(depth)]
    return control.ss(a, b, c, d, period, states=names, inputs=plant.input_labels,
                      outputs=plant.output_labels, remove_useless_states=False)


def _law(servo: Servo, point: Point, period: float) -> tuple[np.ndarray, ...]:
    """
    Return F, G, H, K of the controller.

    Inputs: position and speed reference, what is added to the command, both angles.
    """
    p, law = control_values(servo), servo.controller.law
    ratio = servo.values['mechanism.ratio']

    def answer(memory: np.ndarray, shown: np.ndarray) -> np.ndarray:
        after = memory.copy()
        command = law(p, after, *shown, ratio, period)
        return np.append(after, command)

    memory = np.zeros(state.CONTROLLER_SIZE)
    shown = np.array([point.angle, 0.0, 0.0, point.angle * ratio, point.angle])
    for _ in range(_RUNS):
        memory = answer(memory, shown)[:-1]
    size = len(memory)
    by_memory = slopes(lambda given: answer(given, shown), memory, range(size), [_CHANGE] * size)
    by_shown = slopes(lambda given: answer(memory, given), shown, range(len(shown)),
                      [_CHANGE] * len(shown))
    used = [j for j in range(size) if j != 0]  # the first only says that it has begun
    return (by_memory[np.ix_(used, used)], by_shown[used], by_memory[-1:, used], by_shown[-1:])


def _joined(plant: control.StateSpace, law: tuple[np.ndarray, ...], input: str,
            outputs: list[str], period: float):
    """Return the closed and the opened loop."""
    f, g, h, k = law
    n, m = len(plant.A), len(f)
    shown = plant.C[len(outputs):]
    b, through = plant.B[:, :1], plant.D[:len(outputs), :1]
    wanted, direct = plant.C[:len(outputs)], plant.D[:len(outputs)]
    on_readings, of_readings = k[:, 3:], g[:, 3:]
    names = [*plant.state_labels, *(f'controller[{i + 1}]' for i in range(m))]

    # the command, as it follows from the states and from what drives the loop
    command = np.hstack([on_readings @ shown, h])
    a = np.block([[plant.A, np.zeros((n, m))], [of_readings @ shown, f]])
    a[:n] += b @ command
    if input in REFERENCES:
        column = REFERENCES[::-1].index(input)
        drive = np.vstack([b * k[0, column], g[:, column:column + 1]])
        passed = through * k[0, column]
    else:
        column = ('voltage', 'external_torque').index(input)
        drive = np.vstack([plant.B[:, column:column + 1], np.zeros((m, 1))])
        passed = direct[:, column:column + 1]
    c = np.hstack([wanted, np.zeros((len(outputs), m))]) + through @ command
    closed = control.ss(a, drive, c, passed, period, states=names, inputs=[input],
                        outputs=outputs, remove_useless_states=False)
    opened = control.ss(np.block([[plant.A, np.zeros((n, m))], [of_readings @ shown, f]]),
                        np.vstack([b, np.zeros((m, 1))]), -command, [[0.0]], period, states=names,
                        inputs=['command'], outputs=['answer'], remove_useless_states=False)
    return closed, opened
