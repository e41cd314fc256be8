"""One recording as the balances need it: its motion, its noise, and where nothing can be said."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import ROOM_TEMPERATURE
from servo_twin.recording.recording import Recording

from .unseen_mesh import wound_up
from .weak_form import Bump, count_of, noise_of

SPACINGS = (2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 25, 32)
MESH_NOISE = 0.05  # share of the torque at work that noise of the wind-up may be
BLOCK = 1.5  # s, what may be taken as independent of its neighbours
FEWEST_BLOCKS = 40  # of all recordings together: of short ones, blocks are shorter


@dataclass(frozen=True)
class Channels:
    """
    Readings of one recording, NaN where there is none, and what the bump makes of them.

    ``motor`` and ``load`` in rad, ``torque`` N m, ``current`` A; shape (samples,) each. ``wound``
    is by how much the twin winds up a mesh of which one shaft is measured, rad; zero of others.
    """

    motor: np.ndarray
    load: np.ndarray
    torque: np.ndarray
    current: np.ndarray
    wound: np.ndarray

    def as_rows(self) -> np.ndarray:
        """Shape (samples, 4), in the order in which a kernel's sensors read."""
        return np.column_stack((self.motor, self.load, self.torque, self.current))


@dataclass(frozen=True)
class Observation:
    """
    A recording with its bumps, its noise and its masks.

    ``bump`` weighs the balances of the shafts, ``mesh`` that of the transmission, ``fine`` the
    electrical ones, which need no derivative. ``noise`` is the standard deviation of one reading
    by channel, ``counts`` the count of an encoder (0: not in counts), ``block`` the seconds of a
    block.
    """

    recording: Recording
    channels: Channels
    bump: Bump
    mesh: Bump
    fine: Bump
    noise: dict[str, float]
    counts: dict[str, float]
    closed_loop: bool
    block: float

    @property
    def period(self) -> float:
        """Seconds from sample to sample."""
        return self.recording.period

    def has(self, name: str) -> bool:
        """Whether a channel was measured."""
        return bool(np.isfinite(getattr(self.channels, name)).any())

    def column(self, name: str, missing: float) -> np.ndarray:
        """Return a column of the recording with what is missing replaced."""
        column = self.recording[name]
        return np.where(np.isfinite(column), column, missing)

    @property
    def voltage(self) -> np.ndarray:
        """Command, V, shape (samples,)."""
        return self.column('voltage', 0.0)

    @property
    def external(self) -> np.ndarray:
        """External torque, N m, shape (samples,)."""
        return self.column('external_torque', 0.0)

    @property
    def temperature(self) -> np.ndarray:
        """Temperature, degC, shape (samples,)."""
        return self.column('temperature', ROOM_TEMPERATURE)


def observe(recordings: list[Recording], servo: Servo) -> list[Observation]:
    """Look at recordings of one machine with bumps as short as their noise allows."""
    noises = [_noises(r) for r in recordings]
    spacings, meshes = {}, {}
    for recording, noise in zip(recordings, noises, strict=True):
        needed = _spacing(recording, noise, servo)
        kind = recording.period, recording.family
        spacings[kind] = max(needed, spacings.get(kind, 0))
        needed = _mesh_spacing(recording, noise, servo)
        meshes[recording.period] = min(needed, meshes.get(recording.period, needed))
    together = sum(r.duration for r in recordings)
    block = float(np.clip(together / FEWEST_BLOCKS, 0.2, BLOCK))
    seen = []
    for recording, noise in zip(recordings, noises, strict=True):
        spacing = spacings[recording.period, recording.family]
        mesh = min(spacing, meshes[recording.period])
        columns = recording.columns
        channels = Channels(columns['motor_position'], columns['load_position'],
                            columns['torque'], columns['current'], wound_up(recording, servo))
        counts = {n: count_of(columns[n]) for n in ('motor_position', 'load_position')}
        loop = bool(servo.controller.parameters) and (
            recording.has('reference_position') or recording.has('reference_velocity'))
        seen.append(Observation(recording, channels, Bump(spacing, recording.period, 2 * spacing),
                                Bump(mesh, recording.period, 2 * mesh),
                                Bump(2, recording.period, 4), noise, counts, loop, block))
    return seen


def _noises(recording: Recording) -> dict[str, float]:
    return {name: noise_of(recording[name]) if recording.has(name) else np.nan
            for name in ('motor_position', 'load_position', 'torque', 'current', 'voltage')}


def _spacing(recording: Recording, noise: dict[str, float], servo: Servo) -> int:
    """Shortest bump whose acceleration noise is half a percent of the torque at work."""
    ratio = servo.values['mechanism.ratio']
    gain = servo.values['drive.torque_constant']
    current = recording['current'] if recording.has('current') else (
        recording['voltage'] * servo.values['drive.gain']
        / servo.values.get('drive.resistance', 1.0))
    torque = recording['torque'] if recording.has('torque') else ratio * gain * current
    scale = float(np.sqrt(np.nanmean(torque**2))) or 1.0
    motor_inertia = servo.values['mechanism.rotor_inertia'] * ratio**2
    load_inertia = servo.values['mechanism.load_inertia']
    for spacing in SPACINGS:
        bump = Bump(spacing, recording.period, 1)
        shaken = []
        if recording.has('motor_position'):
            inertia = motor_inertia
            if not recording.has('load_position'):
                inertia += load_inertia
            shaken.append(inertia / ratio * noise['motor_position'])
        if recording.has('load_position'):
            shaken.append(load_inertia * noise['load_position'])
        if not shaken or np.hypot.reduce(shaken) * bump.gain(2) < 0.005 * scale:
            break
    longest = max(2, int(0.12 / (6 * recording.period)))
    return min(spacing, longest)


def _mesh_spacing(recording: Recording, noise: dict[str, float], servo: Servo) -> int:
    """
    Shortest bump whose noise of the wind-up and its damping is small against the torque at work.

    With a torque sensor the transmission needs no acceleration, and a gap or a bent spring is
    seen the better the less of its law is blurred. Without one it needs the bump of the shafts.
    """
    stiffness = servo.values.get('mechanism.stiffness')
    if not stiffness or not all(recording.has(n) for n in (
            'motor_position', 'load_position', 'torque')):
        return SPACINGS[-1]
    torque = recording['torque']
    scale = float(np.sqrt(np.nanmean(torque**2))) or 1.0
    angles = np.hypot(noise['motor_position'] / servo.values['mechanism.ratio'],
                      noise['load_position'])
    damping = servo.values['mechanism.damping']
    for spacing in SPACINGS:
        bump = Bump(spacing, recording.period, 1)
        shaken = (stiffness * angles * bump.gain(0), damping * angles * bump.gain(1),
                  noise['torque'] * bump.gain(0))
        if np.hypot.reduce(shaken) < MESH_NOISE * scale:
            break
    return spacing
