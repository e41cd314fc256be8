"""
The twin run anew over recordings: the judge of every explanation.

A free run drifts, so the twin starts again from the measured motion about every :data:`HORIZON`
seconds, at the quietest instant near by; what its laws remember is carried over. What a slightly
other angle and speed at the start would explain is taken out of the error of an angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from servo_twin.physics import state
from servo_twin.physics.following import MOTION
from servo_twin.physics.kernel import kernel_of
from servo_twin.physics.simulate import initial_state, inputs_of, substeps_of

from .balance import Balance
from .spring import running, STIFFNESS

HORIZON = 0.4  # s, free run between two starts
CHANNELS = ('motor_position', 'load_position', 'torque', 'current', 'wind_up', 'command')


class Diverged(ValueError):
    """A twin whose simulation leaves the finite numbers."""


@dataclass(frozen=True)
class Run:
    """
    Errors of the twin over one recording, rig minus twin, by channel; and what they are made of.

    ``errors`` and ``twin`` have shape (samples,), NaN where not measured or before the first
    start.
    """

    errors: dict[str, np.ndarray]
    twin: dict[str, np.ndarray]
    blocks: np.ndarray


def resimulate(one: Balance, theta: np.ndarray, on: np.ndarray,
               horizon: float = HORIZON) -> Run:
    """
    Run the servo of ``one``, at some values and switches, over its recording; return its errors.

    The command is the measured one. Raises Diverged.
    """
    servo, seen, period = one.servo, one.seen, one.seen.period
    u = inputs_of(seen.recording.columns)
    ratio = one.value(theta, 'mechanism.ratio')
    reach = seen.bump.reach
    rows = one.corrected_motion(theta, on)
    load, speed, motor, motor_speed, torque = (rows[:, MOTION.index(name)] for name in (
        'load_angle', 'load_speed', 'motor_angle', 'motor_speed', 'torque'))
    servo, theta = running(servo, theta)
    substeps, h = substeps_of(servo, period)
    kernel = kernel_of(servo)
    compliant, felt = servo.mechanism.compliant, one.seen.has('torque')
    swings = compliant and not felt and one.seen.has('motor') and one.seen.has('load')
    if not np.isfinite(torque).any():
        torque = np.zeros(len(load))
    samples = len(u)
    y = np.full((samples, len(state.OUTPUTS)), np.nan)
    current = seen.channels.current
    starts = _starts(one, max(4, int(round(horizon / period))))
    zeros = []
    for k in starts[:: max(1, len(starts) // 25)]:
        x = initial_state(servo, motor[k - reach], load[k - reach], torque[k - reach],
                          speed[k - reach], theta, on)
        zeros.append(x[state.ZERO])
    zero = float(np.median(motor / ratio - load if swings else zeros))
    x = initial_state(servo, motor[0], load[0], torque[0], speed[0], theta, on)
    stiffness = theta[servo.slots()[STIFFNESS].start] if compliant else np.inf
    unwinding = np.gradient(torque, period) / stiffness
    for k, end in zip(starts, [*starts[1:], samples], strict=True):
        at = k - reach
        x[state.LOAD_ANGLE], x[state.LOAD_SPEED] = load[at], speed[at]
        x[state.MOTOR_SPEED] = motor_speed[at] if swings else (
            (speed[at] + unwinding[at]) * ratio)
        x[state.MOTOR_ANGLE] = motor[at]
        x[state.TIME] = k * period
        if np.isfinite(current[k]):
            x[state.CURRENT] = current[k]
        # with the zero kept, the wind-up that carries the measured torque places the motor
        kernel.align(theta, on, x, torque[at])
        if compliant and felt:
            x[state.MOTOR_ANGLE] += (zero - x[state.ZERO]) * ratio
        x[state.ZERO] = zero
        kernel.run(theta, on, x, u[k:end], y[k:end], substeps, h, state.MEASURED_INPUT)
    reach = int(starts[0])
    if not np.isfinite(y[reach:]).all():
        raise Diverged(f'{servo.name}: the simulation leaves the finite numbers on '
                       f'{seen.recording.name}; its step of {servo.step:g} s may be too long')
    twin = dict(zip(state.OUTPUTS, y.T, strict=True))
    twin['wind_up'] = twin['motor_position'] / ratio - twin['load_position']
    rig = {n: seen.recording[n] for n in CHANNELS if n not in ('wind_up', 'command')}
    rig['wind_up'] = rig['motor_position'] / ratio - rig['load_position']
    errors = {n: x - twin[n] for n, x in rig.items() if np.isfinite(x).any()}
    for name in ('motor_position', 'load_position'):
        if name in errors:
            errors[name] = _started_anew(errors[name], [*starts, samples])
    if 'wind_up' in errors:  # two encoders never have the same zero
        errors['wind_up'] = errors['wind_up'] - np.nanmedian(errors['wind_up'])
    if 'controller' in one.names:
        twin['command'] = one.command(theta, on)
        errors['command'] = seen.recording['voltage'] - twin['command']
        if servo.values.get('controller.ki'):  # the integral may have begun anywhere
            errors['command'] = errors['command'] - np.nanmedian(errors['command'])
    return Run(errors, twin, (np.arange(samples) * period / seen.block).astype(int))


def _starts(one: Balance, length: int) -> np.ndarray:
    """Samples to start from: every `length` or so, where speed and torque change least."""
    reach = one.seen.bump.reach
    change = np.abs(np.gradient(one.motion('load_acceleration')))
    torque = one.motion('torque')
    if np.isfinite(torque).any():
        rate = np.abs(np.gradient(torque))
        change = change / (np.mean(change) or 1.0) + rate / (np.mean(rate) or 1.0)
    # quiet throughout the bump that the start is read from
    change = np.convolve(change, np.ones(2 * reach + 1), 'same')
    size, starts = len(change), []
    for k in range(0, size, length):
        window = change[k:min(k + length // 2, size)]
        if len(window) >= length // 2:
            starts.append(reach + k + int(np.argmin(window)))
    return np.array(starts or [reach])


def _started_anew(error: np.ndarray, edges: list[int]) -> np.ndarray:
    """Take out of the error of an angle what its start may be off: a line between two starts."""
    error = error.copy()
    for first, last in zip(edges[:-1], edges[1:], strict=True):
        part = error[first:last]
        good = np.flatnonzero(np.isfinite(part))
        if len(good) > 3:
            part -= np.polyval(np.polyfit(good, part[good], 1), np.arange(len(part)))
    return error


@dataclass(frozen=True)
class Gap:
    """
    Gaps by channel over several recordings, from sums of squares by block.

    ``squares`` maps a channel to (blocks, 2): sum of squared errors and number of samples;
    ``floor`` to its noise, ``signal`` to how much it moves, in its unit. ``recording`` numbers
    the recordings of the blocks.
    """

    squares: dict[str, np.ndarray]
    floor: dict[str, float]
    signal: dict[str, float]
    recording: np.ndarray

    def rms(self, channel: str, blocks: np.ndarray | None = None) -> float:
        """Root mean square error of a channel, over some blocks."""
        part = self.squares[channel] if blocks is None else self.squares[channel][blocks]
        total = part.sum(axis=0)
        return float(np.sqrt(total[0] / max(total[1], 1.0)))

    def excess(self, channel: str, blocks: np.ndarray | None = None) -> float:
        """What of it is above the noise floor."""
        return float(np.sqrt(max(0.0, self.rms(channel, blocks)**2 - self.floor[channel]**2)))

    def total(self, reference: Gap, blocks: np.ndarray | None = None,
              excess: bool = True) -> float:
        """
        Return one number for all channels: root mean square of each against its own signal.

        Channels that the reference gap leaves at the noise floor do not count.
        """
        parts = []
        for channel in self.squares:
            if reference.excess(channel) > 0.3 * self.floor[channel]:
                size = self.excess(channel, blocks) if excess else self.rms(channel, blocks)
                parts.append(size / self.signal[channel])
        return float(np.sqrt(np.mean(np.square(parts)))) if parts else 0.0


def gap_of(runs: list[Run], balances: list[Balance]) -> Gap:
    """Collect runs over several recordings into gaps by channel."""
    squares, floor, signal = {}, {}, {}
    for channel in CHANNELS:
        parts, noises, moved = [], [], []
        for run, one in zip(runs, balances, strict=True):
            if channel not in run.errors:
                continue
            error = run.errors[channel]
            good = np.isfinite(error)
            count = int(run.blocks.max()) + 1
            with np.errstate(over='ignore'):  # a twin that runs away is infinitely far
                squares_of_blocks = np.bincount(run.blocks[good], error[good]**2, count)
            parts.append(np.column_stack((
                squares_of_blocks, np.bincount(run.blocks[good], minlength=count))))
            noises.append(_noise(one, channel))
            moved.append(_moved(one, channel))
        if parts:
            squares[channel] = np.concatenate(parts)
            floor[channel] = float(np.sqrt(np.mean(np.square(noises))))
            signal[channel] = float(np.sqrt(np.mean(np.square(moved)))) or 1.0
    blocks = [int(run.blocks.max()) + 1 for run in runs]
    families = np.argsort([one.seen.recording.family for one in balances], kind='stable')
    return Gap(squares, floor, signal, np.repeat(np.argsort(families), blocks))


def _noise(one: Balance, channel: str) -> float:
    noise = one.seen.noise
    if channel == 'wind_up':
        return float(np.hypot(noise['motor_position'] / one.servo.values['mechanism.ratio'],
                              noise['load_position']))
    if channel == 'command':
        return one.command_noise(one.servo.theta) / one.seen.fine.gain(0)
    return float(noise[channel])


def _moved(one: Balance, channel: str) -> float:
    """How much a channel moves beside a line: what its error is measured against."""
    if channel == 'wind_up':
        return float(np.std(one.motion('wind_up')))
    x = one.seen.recording['voltage' if channel == 'command' else channel]
    x = x[np.isfinite(x)]
    if channel in ('torque', 'current', 'command'):
        return float(np.sqrt(np.mean(x**2)))
    length = max(2, int(HORIZON / one.seen.period))
    whole = x[:len(x) // length * length].reshape(-1, length)
    at = np.arange(length) - 0.5 * (length - 1)
    slope = whole @ at / (at @ at)
    return float(np.sqrt(np.mean((whole - whole.mean(axis=1, keepdims=True)
                                  - slope[:, None] * at)**2)))


def shrink(before: Gap, after: Gap, blocks: np.ndarray | None = None) -> float:
    """Return 1 - after / before of the gap in excess of the noise floor."""
    first = before.total(before, blocks)
    return 1.0 - after.total(before, blocks) / first if first > 0.0 else 0.0


def drawn(before: Gap, after: Gap, seed: int = 0, draws: int = 400) -> np.ndarray:
    """
    Return by how much the shrink scatters: drawn anew, less what was seen, shape (draws,).

    Recordings are drawn, and blocks within each: another recording differs from these by more
    than its noise, by its family and its settings. Of two sets of as many recordings the same
    ones are drawn, in the order of their families; ``seed`` is that of the blocks.
    """
    which, within = np.random.default_rng(0), np.random.default_rng(seed)
    size = min(len(part) for part in before.squares.values())
    members = [np.flatnonzero(before.recording[:size] == n) for n in
               np.unique(before.recording[:size])]
    values = np.array([shrink(before, after, np.concatenate([
        within.choice(members[n], len(members[n]))
        for n in which.integers(0, len(members), len(members))])) for _ in range(draws)])
    # a ratio of sums over few blocks is skewed: the draws are centred
    return values - np.median(values)


def bootstrap(before: Gap, after: Gap, seed: int = 0, draws: int = 400) -> tuple[float, float]:
    """Return the 90 % interval of the shrink."""
    low, high = np.percentile(shrink(before, after) + drawn(before, after, seed, draws), (5, 95))
    return float(low), float(min(high, 1.0))
