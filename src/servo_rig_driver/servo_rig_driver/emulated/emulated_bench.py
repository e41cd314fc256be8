"""
The emulated rig without its bus: the same simulation, the same counts, the same wire format.

`Bench` answers one SYNC after the other; `run` makes a whole recording in one go.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..devices.pdo_table import FrameTable, load_frames
from . import rig_sampling as sampling
from .rig_file import RigSettings

COLUMNS = ('t', 'voltage', 'current_reference', 'current', 'motor_position', 'load_position',
           'torque', 'external_torque', 'reference_position', 'reference_velocity', 'temperature',
           'coupled_position')
MODES = {'off': sampling.OFF, 'voltage': sampling.VOLTAGE_MODE, 'current': sampling.CURRENT_MODE,
         'velocity': sampling.VELOCITY_MODE, 'position': sampling.POSITION_MODE}
_BLOCK = 1024
COMMANDS = 7

# column -> (node, name on the wire, column of an answer)
_MEASURED = {
    'voltage': ('drive', 'applied_voltage', sampling.VOLTAGE),
    'current_reference': ('drive', 'current_reference', sampling.CURRENT_REFERENCE),
    'current': ('drive', 'motor_current', sampling.CURRENT),
    'motor_position': ('drive', 'position_actual_value', sampling.MOTOR),
    'load_position': ('load_encoder', 'position_value', sampling.LOAD),
    'torque': ('torque_sensor', 'transmitted_torque', sampling.TORQUE),
    'external_torque': ('torque_sensor', 'external_torque', sampling.EXTERNAL_NOW),
    'temperature': ('torque_sensor', 'gearbox_temperature', sampling.TEMPERATURE),
}
_TEMPERATURE_EVERY = 10  # SYNCs, transmission type of its PDO
_REFERENCES = {'voltage': ('command_voltage', None), 'current': ('target_current', None),
               'velocity': ('target_velocity', 'reference_velocity'),
               'position': ('target_position', 'reference_position')}


class Bench:
    """One rig in time: ``answer`` at each SYNC, ``advance`` between two of them."""

    def __init__(self, rig: RigSettings, seed: int = 0, period: float = 1e-3) -> None:
        self.rig = rig
        self.period = period
        self.parameters = rig.parameters()
        self._physics = rig.physics
        self.state = self._physics.fresh_state(rig.values, seed)
        self.out = np.zeros(sampling.ANSWERS)
        self._command = np.zeros(COMMANDS)
        self._random = np.random.default_rng(seed)
        self._noise = np.zeros((0, sampling.NOISES))
        self._used = 0
        self._switches = list(rig.switches)

    @property
    def time(self) -> float:
        """Time of the simulation, s."""
        return float(self.state['time'][0])

    def noise(self, rows: int) -> np.ndarray:
        """Return standard normal noise for ``rows`` samples."""
        return self._random.standard_normal((rows, sampling.NOISES))

    def answer(self, mode: float, reference: float, external: float) -> np.ndarray:
        """
        Latch the sensors and take over a command, held until the next SYNC.

        The result, valid until the next call, is indexed by the constants of rig_sampling.py: rad,
        rad/s, N m, A, degC, V. ``reference`` is in V, A, rad/s or rad at the load by ``mode``.
        """
        if self._used == len(self._noise):
            self._noise, self._used = self.noise(_BLOCK), 0
        self._command[:3] = mode, reference, external
        self._physics.answer(self.parameters, self.state, self.period, self.rig.step,
                             self._command, self._noise[self._used], self.out)
        self._used += 1
        return self.out

    def advance(self, duration: float | None = None) -> None:
        """Let one period pass, or ``duration`` seconds, and do the switches that are due."""
        self._physics.advance(self.parameters, self.state,
                              self.period if duration is None else duration, self.rig.step)
        self._switch()

    def change(self, values: Mapping[str, float]) -> None:
        """Turn properties while the rig runs; raises RigFileError and changes nothing."""
        self.rig = self.rig.with_values(values)
        self.parameters = self.rig.parameters()

    def record(self, commands: np.ndarray) -> np.ndarray:
        """
        Return the answers (n, 9) to commands (n, 3): mode, reference, external torque.

        Further columns are those of rig_sampling.py's impedance mode, which some drives have.
        """
        out = np.empty((len(commands), sampling.ANSWERS))
        done = 0
        while done < len(commands):
            self._switch()
            rows = len(commands) - done
            if self._switches:
                until = np.ceil((self._switches[0].at - self.time) / self.period - 1e-6)
                rows = min(rows, max(1, int(until)))
            part = slice(done, done + rows)
            self._physics.record(self.parameters, self.state, self.period, self.rig.step,
                                 np.ascontiguousarray(commands[part], float), self.noise(rows),
                                 out[part])
            done += rows
        return out

    def _switch(self) -> None:
        while self._switches and self._switches[0].at <= self.time + 1e-9:
            self.change(self._switches.pop(0).values)


def run(rig: RigSettings, mode: str, reference: np.ndarray,
        external_torque: np.ndarray | float = 0.0, period: float = 1e-3, seed: int = 0,
        frames: FrameTable | None = None) -> dict[str, np.ndarray]:
    """
    Return a recording as columns (see COLUMNS) in SI units, as they arrive over the wire.

    ``reference`` (n,) is in V, A, rad/s or rad by ``mode``: voltage, current, velocity, position.
    ``external_torque``, N m, resists positive motion of the load. Raises ValueError for an unknown
    mode or values that are not finite.
    """
    frames = frames or load_frames(rig.dictionaries)
    commands = commands_of(mode, reference, external_torque, frames)
    answers = Bench(rig, seed, period).record(commands)
    return columns_of(rig, mode, commands, answers, period, frames)


def commands_of(mode: str, reference: np.ndarray, external_torque: np.ndarray | float,
                frames: FrameTable) -> np.ndarray:
    """Return set-points as the wire carries them, (n, 3); raises ValueError as run does."""
    if mode not in _REFERENCES:
        raise ValueError(f"mode '{mode}' is unknown; it is one of {list(_REFERENCES)}")
    reference = np.asarray(reference, float)
    external = np.broadcast_to(np.asarray(external_torque, float), reference.shape)
    if not (np.isfinite(reference).all() and np.isfinite(external).all()):
        raise ValueError('reference and external_torque must be finite')
    reference = frames.field('drive', _REFERENCES[mode][0]).quantise(reference)
    external = frames.field('torque_sensor', 'target_external_torque').quantise(external)
    return np.column_stack([np.full(len(reference), MODES[mode]), reference, external])


def columns_of(rig: RigSettings, mode: str, commands: np.ndarray, answers: np.ndarray,
               period: float, frames: FrameTable) -> dict[str, np.ndarray]:
    """Return commands (n, 3) and answers (n, 9) as the columns of a recording."""
    samples = len(commands)
    columns = {name: np.full(samples, np.nan) for name in COLUMNS}
    columns['t'] = np.arange(samples) * period
    for name, (node, on_wire, at) in _MEASURED.items():
        columns[name] = frames.field(node, on_wire).quantise(answers[:, at])
    held = np.arange(samples) // _TEMPERATURE_EVERY * _TEMPERATURE_EVERY
    columns['temperature'] = columns['temperature'][held]
    column = _REFERENCES[mode][1]
    if column:
        columns[column] = commands[:, 1]
    if rig.values.get('coupling.mass', 0.0) > 0.0:
        columns['coupled_position'][:] = rig.values['coupling.angle']
    return columns
