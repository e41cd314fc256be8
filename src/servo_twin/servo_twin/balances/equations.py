r"""
The balance equations of a servo as filters over its channels, and what noise they let pass.

Every balance but `controller` is linear in the channels, so running the same filters over the
rig's and the twin's channels and taking the difference is running them over rig minus twin.
What both are given alike, the external torque, cancels. Speeds and accelerations are central
differences behind one smoothing window, so that all terms see the same window and delay.

=============== ==================================================================================
drive           current drive :math:`i - K_a u`; voltage drive
                :math:`K_v u - R i - L\,di/dt - k_e\,\omega_m`; current amplifier likewise, its
                gain in the place of ohms, while neither limit ends it
motor           :math:`K_m i - J_m\dot\omega_m - T/N`
transmission    :math:`\theta_m/N - \theta_l - T/K`; without torque sensor
                :math:`T = J_l\dot\omega_l`, without friction
load            :math:`T - J_l\dot\omega_l`
controller      command minus the control law on what the rig measured (:mod:`.controller_law`)
sensor          :math:`\omega_m/N - \omega_l - \dot T/K`, the last term with a torque sensor
torque_balance  :math:`N K_m i - N J_m\dot\omega_m - J_l\dot\omega_l`; without torque sensor
=============== ==================================================================================

A drive with loops of its own has no drive balance: its current follows from its own memory. Of a
screw, coupling and screw turn with the rotor, and N in the torque balance has its efficiency in.
Where the current is not measured, motor and torque balance take what the drive makes of the
command at once. Source: section 'Where' of the method of the diagnosis; paper 000 eq. 1, 2.
"""

from __future__ import annotations

from math import exp, hypot

import numpy as np

from ..physics.drives import winding
from ..physics.servo import Servo
from ..physics.state import OUTPUTS
from ..recording.joined_samples import reference_of
from ..recording.recording import BALANCES
from .controller_law import impulse_responses

MOTOR, LOAD, TORQUE, CURRENT, VOLTAGE = range(len(OUTPUTS))
CONTROL = len(OUTPUTS)  # the row of the controller's difference, behind the channels


def balance_taps(servo: Servo, period: float, half: int) -> np.ndarray:
    """Return the weights of each channel in each balance, shape (7, channels, 2 half + 1)."""
    v, parts = servo.values, {sensor.channel for sensor in servo.sensors}
    both = {'motor_position', 'load_position'} <= parts
    ratio = v['mechanism.ratio']
    rotor = sum(v.get(f'mechanism.{part}_inertia', 0.0) for part in ('rotor', 'coupling', 'screw'))
    load = v.get('mechanism.load_inertia')
    given_on = ratio * v.get('mechanism.efficiency', 1.0)
    stiffness = v.get('mechanism.stiffness') or np.inf  # none, or not told
    constant = v['drive.torque_constant']
    gain, resistance = winding(v)
    smooth, here, speed, speed_up, held, earlier, given = _windows(servo, period, half)
    taps = np.zeros((len(BALANCES), CONTROL + 1, 2 * half + 1))
    named = dict(zip(BALANCES, taps, strict=True))

    def shaft(balance: str, motor_side: np.ndarray, load_side: np.ndarray) -> None:
        """Take the angles of both shafts, or one for both where one is not measured."""
        if 'motor_position' not in parts:
            named[balance][LOAD] += ratio * motor_side + load_side
        elif 'load_position' not in parts:
            named[balance][MOTOR] += motor_side + load_side / ratio
        else:
            named[balance][MOTOR] += motor_side
            named[balance][LOAD] += load_side

    def current(balance: str, scale: float) -> None:
        """Take the current times ``scale``, or what the drive makes of the command."""
        if 'current' in parts:
            named[balance][CURRENT] = scale * held
        elif resistance:
            named[balance][VOLTAGE] = scale * gain / resistance * given
            back = scale * v['drive.back_emf'] / resistance * speed
            shaft(balance, -back, 0.0 * back)
        elif 'drive.gain' in v:
            named[balance][VOLTAGE] = scale * gain * given

    if 'current' in parts:
        if resistance:
            named['drive'][CURRENT] = -resistance * here
            named['drive'][CURRENT] -= v['drive.inductance'] * speed
            named['drive'][VOLTAGE] = gain * earlier
            if parts & {'motor_position', 'load_position'}:
                shaft('drive', -v['drive.back_emf'] * speed, 0.0 * speed)
        elif 'drive.gain' in v:
            named['drive'][CURRENT] = here
            named['drive'][VOLTAGE] = -gain * earlier
    if 'torque' in parts:
        if 'motor_position' in parts or np.isinf(stiffness):
            current('motor', constant)
            named['motor'][TORQUE] = -smooth / ratio
            shaft('motor', -rotor * speed_up, 0.0 * speed_up)
        if 'load_position' in parts or np.isinf(stiffness):
            named['load'][TORQUE] = smooth
            shaft('load', 0.0 * speed_up, -load * speed_up)
    elif parts & {'motor_position', 'load_position'}:
        current('torque_balance', given_on * constant)
        shaft('torque_balance', -given_on * rotor * speed_up, -load * speed_up)
    if both:
        named['transmission'][MOTOR] = here / ratio
        named['transmission'][LOAD] = -here
        named['sensor'][MOTOR] = speed / ratio
        named['sensor'][LOAD] = -speed
        if 'torque' in parts:
            named['transmission'][TORQUE] = -here / stiffness
            named['sensor'][TORQUE] = -speed / stiffness
        else:
            named['transmission'][LOAD] -= load * speed_up / stiffness
    if reference_of(servo):
        named['controller'][CONTROL] = here
    return taps


def _windows(servo: Servo, period: float, half: int) -> tuple[np.ndarray, ...]:
    """
    Return the windows, each of length 2 half + 1, as weights from the oldest to the newest sample.

    ``here``: a biweight window g, whose second difference is that of a least-squares parabola
    (Savitzky, Golay 1964). ``speed``, ``speed_up``: central differences of g. ``smooth``: g over a
    torque that runs straight from sample to sample, as the second difference of an angle sees it.
    ``held``: the same of a current that a drive with the time constant L/R brings to its end value
    within each sample. ``earlier``: g one sample back, for what the drive holds until here.
    ``given``: the command as ``held`` takes the current that follows it at once.
    """
    inner = np.arange(-(half - 1), half) / half
    g = (1.0 - inner**2) ** 2
    g /= g.sum()
    lag = servo.values.get('drive.inductance', 0.0) / servo.values.get('drive.resistance', 1.0)
    ahead = 1.0
    if lag > 1e-6 * period:
        ahead = 1.0 / (1.0 - exp(-period / lag)) - lag / period
    around = {
        'smooth': (1 / 6, 4 / 6, 1 / 6), 'here': (0, 1, 0),
        'speed': (-0.5 / period, 0, 0.5 / period),
        'speed_up': (1 / period**2, -2 / period**2, 1 / period**2),
        'held': ((1.0 - ahead) / 2, 0.5, ahead / 2), 'earlier': (1, 0, 0), 'given': (0.5, 0.5, 0),
    }
    return tuple(np.convolve(g, row) for row in around.values())


def balance_noise(servo: Servo, period: float, taps: np.ndarray) -> np.ndarray:
    """Return the standard deviation that white noise of the sensors gives each balance, (7,)."""
    floor = np.zeros(len(BALANCES))
    for channel, name in enumerate(OUTPUTS):
        used = taps[:, channel].any(axis=1)
        noise = servo.noise(name)
        if name == 'voltage':
            noise = np.nan_to_num(noise)  # without a say, the command is known exactly
        floor[used] = np.hypot(floor[used], noise * np.linalg.norm(taps[used, channel], axis=1))
    row = BALANCES.index('controller')
    if taps[row, CONTROL].any():
        window = taps[row, CONTROL]
        floor[row] = np.nan_to_num(servo.noise('voltage')) * np.linalg.norm(window)
        answers = impulse_responses(servo, period, 4 * len(window))
        for name, answer in zip(('motor_position', 'load_position'), answers, strict=True):
            if np.isfinite(answer).all() and answer.any():
                ripple = np.linalg.norm(np.convolve(answer, window))
                floor[row] = hypot(floor[row], servo.noise(name) * ripple)
    return np.where(taps.any(axis=(1, 2)), floor, np.nan)
