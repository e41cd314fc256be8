"""One recording as the equations need it: its channels, its noise, its test functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil, nan

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import (
    initial_state,
    inputs_of,
    ROOM_TEMPERATURE,
    simulate,
)
from servo_twin.physics.state import OUTPUTS
from servo_twin.recording.recording import Recording

from ...data.coarse_counts import longest_spacing, SMOOTH_ENOUGH, SPACINGS
from ...data.encoder_count import count_of
from ...data.mistakes import unread
from ...data.signals import ANGLES
from ..decisions import FORM
from .noise import noises_of, of_encoders, one_count
from .test_function import TestFunction

FAST = 2  # samples of spacing of the electrical equations
SAWTOOTH = 0.3  # of a count, over the spacing squared: acceleration of a creeping shaft at worst
SMOOTH_TORSION = 0.05  # noise of the torsion times the stiffness, as a share of the same
BLOCK = 1.5  # s that count as independent of their neighbours
FEWEST_BLOCKS, MOST_BLOCKS = 40, 120  # of all recordings together; more only cost time
MOST_CENTRES = 12_000  # of an equation, of all recordings together; more only cost time


@dataclass(frozen=True)
class Measured:
    """
    A recording with its test functions, its noise and what was measured.

    ``shafts`` projects the equations of the shafts, ``gear`` that of the transmission, ``fast``
    the electrical ones, which need no derivative. ``noise`` is the standard deviation of one
    reading by channel, ``counts`` the count of an encoder (0: not in counts), ``block`` seconds.
    ``twist`` is how far the twin twists a transmission of which one shaft is measured, rad.
    """

    recording: Recording
    shafts: TestFunction
    gear: TestFunction
    fast: TestFunction
    noise: dict[str, float]
    counts: dict[str, float]
    looped: bool
    block: float
    twist: np.ndarray

    @property
    def period(self) -> float:
        """Seconds from sample to sample."""
        return self.recording.period

    @cached_property
    def channels(self) -> frozenset[str]:
        """Names of the measured columns."""
        return frozenset(n for n in self.recording.columns if self.recording.has(n))

    def test_function(self, equation: str) -> TestFunction:
        """Test function that projects an equation."""
        if equation == 'transmission':
            return self.gear
        return self.fast if equation in ('drive', 'controller') else self.shafts

    def column(self, name: str, missing: float) -> np.ndarray:
        """Return a column with what is missing replaced."""
        column = self.recording[name]
        return np.where(np.isfinite(column), column, missing)

    @property
    def temperature(self) -> np.ndarray:
        """Temperature, degC, shape (samples,)."""
        return self.column('temperature', ROOM_TEMPERATURE)


def measure(recordings: Sequence[Recording], servo: Servo,
            drive_current: Callable[[Recording], np.ndarray | None]) -> list[Measured]:
    """
    Prepare recordings of one machine, with test functions as short as their noise allows.

    ``drive_current(recording)`` returns what the drive makes of the command, A, or None.
    """
    noises = of_encoders([noises_of(r, drive_current(r)) for r in recordings])
    counts = one_count([{name: count_of(r[name]) for name in ANGLES} for r in recordings])
    shafts: dict[tuple[float, str], int] = {}
    gears: dict[float, int] = {}
    for recording, noise, count in zip(recordings, noises, counts, strict=True):
        kind = recording.period, recording.family
        shafts[kind] = max(_shaft_spacing(recording, noise, count, servo), shafts.get(kind, 0))
        needed = _gear_spacing(recording, noise, servo)
        gears[recording.period] = min(needed, gears.get(recording.period, needed))
    together = sum(r.duration for r in recordings)
    block = float(np.clip(together / FEWEST_BLOCKS, 0.2, max(BLOCK, together / MOST_BLOCKS)))
    spacings = []
    for recording in recordings:
        longest = shafts[recording.period, recording.family]
        spacings.append((longest, min(longest, gears[recording.period]), FAST))
    apart = [2 * _thinned(recordings, some) for some in zip(*spacings, strict=True)]
    prepared = []
    for recording, noise, count, some in zip(recordings, noises, counts, spacings, strict=True):
        period = recording.period
        # a controller works by its own rows: on resampled ones it would be blamed for the grid
        looped = bool(servo.controller.parameters) and not recording.resampled and (
            recording.has('reference_velocity') or _speed_of_reference(recording, servo))
        shaft, gear, fast = (TestFunction(spacing, period, spacing * each)
                             for spacing, each in zip(some, apart, strict=True))
        prepared.append(Measured(recording, shaft, gear, fast, noise, count, looped, block,
                                 twist_of(recording, servo, 2 * some[0])))
    return prepared


def _speed_of_reference(recording: Recording, servo: Servo) -> bool:
    """
    Tell whether a recorded reference position says its speed, where the controller asks for it.

    One that steps may have any: the speed since the last row is another than that to the next.
    """
    if not recording.has('reference_position'):
        return False
    if 'reference_velocity' in unread(servo):
        return True
    place = recording['reference_position'][np.isfinite(recording['reference_position'])]
    if not len(place) > 1:
        return False
    around, since = np.gradient(place), np.diff(place, prepend=place[:1])
    return bool(np.linalg.norm(since - around) <= FORM * np.linalg.norm(around))


def _thinned(recordings: Sequence[Recording], spacings: Sequence[int]) -> int:
    """Return of how many centres one is kept; they are two spacings from each other."""
    centres = sum(len(recording) / (2 * spacing)
                  for recording, spacing in zip(recordings, spacings, strict=True))
    return max(1, ceil(centres / MOST_CENTRES))


def _torque_at_work(recording: Recording, servo: Servo) -> float:
    values = servo.numbers
    if recording.has('torque'):
        torque = recording['torque']
    else:
        current = recording['current'] if recording.has('current') else (
            recording['voltage'] * values.get('drive.gain', 1.0)
            / values.get('drive.resistance', 1.0))
        torque = values['mechanism.ratio'] * values['drive.torque_constant'] * current
    return float(np.sqrt(np.nanmean(torque**2))) if np.isfinite(torque).any() else 0.0


def _shaft_spacing(recording: Recording, noise: dict[str, float], count: dict[str, float],
                   servo: Servo) -> int:
    """Shortest spacing whose noise of the inertial torque is small against the torque at work."""
    values = servo.numbers
    ratio, scale = values['mechanism.ratio'], _torque_at_work(recording, servo)
    rotor = values.get('mechanism.rotor_inertia', 0.0) * ratio**2
    load = values['mechanism.load_inertia']
    for spacing in SPACINGS:
        gain = TestFunction(spacing, recording.period, 1).gain(2)
        creeping = SAWTOOTH / (spacing * recording.period) ** 2
        shaken = []
        if recording.has('motor_position'):
            inertia = rotor + (0.0 if recording.has('load_position') else load)
            shaken.append(inertia / ratio * max(
                gain * noise['motor_position'], creeping * count['motor_position']))
        if recording.has('load_position'):
            inertia = load + (0.0 if recording.has('motor_position') else rotor)
            shaken.append(inertia * max(
                gain * noise['load_position'], creeping * count['load_position']))
        if not shaken or np.hypot.reduce(shaken) < SMOOTH_ENOUGH * scale:
            break
    return min(spacing, longest_spacing(recording.period))


def _gear_spacing(recording: Recording, noise: dict[str, float], servo: Servo) -> int:
    """
    Shortest spacing whose noise of the torsion is small against the torque at work.

    With a torque sensor the transmission needs no acceleration, and clearance is seen the better
    the less of it is blurred. Without one it needs the test function of the shafts.
    """
    values = servo.numbers
    stiffness = values.get('mechanism.stiffness')
    if not stiffness or not all(recording.has(n) for n in (
            'motor_position', 'load_position', 'torque')):
        return SPACINGS[-1]
    scale = _torque_at_work(recording, servo)
    angles = np.hypot(noise['motor_position'] / values['mechanism.ratio'],
                      noise['load_position'])
    for spacing in SPACINGS:
        test = TestFunction(spacing, recording.period, 1)
        shaken = (stiffness * angles * test.gain(0),
                  values.get('mechanism.damping', 0.0) * angles * test.gain(1),
                  noise['torque'] * test.gain(0))
        if np.hypot.reduce(shaken) < SMOOTH_TORSION * scale:
            break
    return spacing


def twist_of(recording: Recording, servo: Servo, samples: int,
             push: np.ndarray | float = 0.0) -> np.ndarray:
    """
    Return the torsion by the twin where one shaft of an elastic machine is measured, rad.

    A load that swings on its transmission is neither friction nor inertia. The twin, pulled to the
    measured shaft, knows where the other one is. Zero elsewhere. ``push`` as of :func:`pulled`.
    """
    has = [recording.has(f'{name}_position') for name in ('motor', 'load')]
    nothing = np.zeros(len(recording))
    if all(has) or not any(has) or not (
            servo.mechanism.compliant and servo.mechanism.correctable):
        return nothing
    motor, load, _ = pulled(recording, servo, samples, push)
    twist = motor / servo.numbers['mechanism.ratio'] - load
    return twist if np.isfinite(twist).all() else nothing


def pulled(recording: Recording, servo: Servo, samples: int,
           push: np.ndarray | float = 0.0) -> tuple[np.ndarray, ...]:
    """
    Return the angles of motor and load, rad, and the torque between, N m, of the twin.

    Each (samples,). The twin is pulled to the one shaft that is measured, and begins as fast as
    that does over its first ``samples``. ``push`` (samples,), N m, moves its load besides.
    """
    has = recording.has('motor_position')
    shaft = recording['motor_position' if has else 'load_position']
    begin = shaft[:max(3, samples)]
    speed = float(np.polyfit(np.arange(len(begin)) * recording.period, begin, 2)[1]) if np.all(
        np.isfinite(begin)) else 0.0
    first = (float(shaft[0]), nan) if has else (nan, float(shaft[0]))
    columns = {**recording.columns,
               'external_torque': np.nan_to_num(recording['external_torque']) - push}
    y = simulate(servo, inputs_of(columns), recording.period, initial_state(
        servo, *first, load_speed=speed / (servo.numbers['mechanism.ratio'] if has else 1.0)),
        'observer')
    return tuple(y[:, OUTPUTS.index(name)] for name in (
        'motor_position', 'load_position', 'torque'))
