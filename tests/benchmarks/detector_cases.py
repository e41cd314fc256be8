"""
Rigs, motions and changes on which the change detector is judged.

A motion is a working cycle: moves at a limited speed and acceleration between stations, rests
between them, on half of the moves a load. In a `cycle` the stations come again and again, in a
`free` motion each is drawn anew. The rig meets the change while it moves; a sensor that sticks or
slips is spoilt in what it sent.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
import zlib

import numpy as np

from servo_rig_driver.emulated import emulated_bench
from servo_rig_driver.emulated.rig_file import load_rig, Switch
from servo_twin.recording.recording import Recording

PERIOD = 1e-3  # s
RAMP = 20.0  # s that a slow change takes
RAMP_STEP = 0.1  # s


@dataclass(frozen=True)
class Machine:
    """How a rig works: half range, speed and acceleration at the load, load torque in N m."""

    mode: str
    reach: float
    speed: float
    acceleration: float
    load: float


MACHINES = {
    'rv_plain': Machine('velocity', 1.5, 0.8, 4.0, 20.0),
    'rv_bench': Machine('velocity', 1.5, 0.8, 4.0, 20.0),
    'geared_dc': Machine('velocity', 3.0, 6.0, 40.0, 0.05),
    'ema_bench': Machine('position', 0.6, 0.6, 3.0, 0.1),
    'dc_gearmotor': Machine('velocity', 3.0, 6.0, 40.0, 0.03),
}


@dataclass(frozen=True)
class Change:
    """
    What changes: ``path`` of the rig times ``factor`` plus ``added``; ``place`` it is in.

    Without a path ``column`` is spoilt: it sticks where ``added`` is 0, else it slips by so much.
    ``balances``: the equations that the change enters directly. ``rigs``: where it exists.
    """

    name: str
    place: str
    balances: tuple[str, ...]
    path: str = ''
    factor: float = 1.0
    added: float = 0.0
    column: str = ''
    rigs: tuple[str, ...] = tuple(MACHINES)


_RV = ('rv_plain', 'rv_bench')
_SENSED = (*_RV, 'geared_dc')
_TWO = (*_SENSED, 'ema_bench')
_DC = ('geared_dc', 'dc_gearmotor')
_PLAYS = ('rv_bench', 'geared_dc', 'ema_bench')
_LOAD, _MOTOR = ('load', 'torque_balance'), ('motor', 'torque_balance')
_ANGLE = ('transmission', 'sensor')

CHANGES = (
    Change('load friction +30 %', 'load', _LOAD, 'friction.load_level', 1.3,
           rigs=(*_SENSED, 'dc_gearmotor')),
    Change('motor friction +30 %', 'motor', _MOTOR, 'friction.motor_level', 1.3),
    Change('load inertia +15 %', 'load', _LOAD, 'machine.load_inertia', 1.15, rigs=_SENSED),
    Change('backlash doubled', 'transmission', _ANGLE, 'mesh.backlash', 2.0, rigs=_PLAYS),
    Change('stiffness -20 %', 'transmission', _ANGLE, 'machine.stiffness', 0.8, rigs=_TWO),
    Change('transmission error tripled', 'transmission', _ANGLE, 'error.tooth', 3.0, rigs=_PLAYS),
    Change('torque constant -10 %', 'motor', _MOTOR, 'machine.torque_constant', 0.9,
           rigs=(*_RV, 'ema_bench')),
    Change('torque and EMF constant -10 %', 'motor', (*_MOTOR, 'drive'),
           'machine.torque_constant', 0.9, rigs=_DC),
    Change('resistance +15 %', 'drive', ('drive',), 'drive.resistance', 1.15, rigs=_DC),
    Change('drive gain -5 %', 'drive', ('drive',), 'withheld.drive_gain', added=-0.05,
           rigs=(*_RV, 'ema_bench')),
    Change('torque sensor off', 'sensor', ('motor', 'load', *_ANGLE), column='torque',
           added=1.0, rigs=_SENSED),
    Change('load encoder slips', 'sensor', ('load', *_ANGLE), column='load_position', added=1.0,
           rigs=_SENSED),
    Change('current sensor +5 %', 'sensor', ('drive', *_MOTOR), 'withheld.current_sensor_gain',
           added=0.05),
    Change('torque sensor sticks', 'sensor', ('motor', 'load', *_ANGLE), column='torque',
           rigs=_SENSED),
    Change('load encoder sticks', 'sensor', ('load', *_ANGLE), column='load_position',
           rigs=_SENSED),
    Change('current sensor sticks', 'sensor', ('drive', *_MOTOR), column='current'),
)


def motion(machine: Machine, seconds: float, seed: int, free: bool
           ) -> tuple[np.ndarray, np.ndarray]:
    """Return the speed (rad/s) and the load torque (N m) of a motion, one value a PERIOD."""
    random = np.random.default_rng(seed)
    stations = random.uniform(-machine.reach, machine.reach, 5)
    speed, load, here, move = [], [], 0.0, 0
    while sum(map(len, speed)) * PERIOD < seconds:
        there = random.uniform(-machine.reach, machine.reach) if free else stations[move % 5]
        rest = round(random.uniform(0.2, 0.8) / PERIOD)
        ramp = _ramp(there - here, machine)
        speed.append(np.concatenate([ramp, np.zeros(rest)]))
        load.append(np.full(len(speed[-1]), machine.load if move % 2 else 0.0))
        here, move = here + float(ramp.sum()) * PERIOD, move + 1
    count = round(seconds / PERIOD)
    return np.concatenate(speed)[:count], np.concatenate(load)[:count]


def _ramp(way: float, machine: Machine) -> np.ndarray:
    """Return the speed of one move: up, on and down, without a jump of acceleration."""
    top = min(machine.speed, (abs(way) * machine.acceleration / 2.0) ** 0.5)
    if top == 0.0:
        return np.zeros(0)
    rise = 2.0 * top / machine.acceleration
    time = np.arange(round((abs(way) / top + rise) / PERIOD)) * PERIOD
    return np.sign(way) * top * np.minimum(_eased(time / rise),
                                           _eased((time[-1] - time) / rise))


def _eased(share: np.ndarray) -> np.ndarray:
    share = np.clip(share, 0.0, 1.0)
    return 0.5 - 0.5 * np.cos(np.pi * share)


def played(rig_name: str, seconds: float, seed: int, change: Change | None = None,
           at: float = 0.0, slow: bool = False) -> Recording:
    """Return what the rig sent in ``seconds`` of a motion, with a change ``at`` an instant, s."""
    machine, rig = MACHINES[rig_name], load_rig(rig_name)
    speed, load = motion(machine, seconds, zlib.crc32(f'{rig_name} {seed}'.encode()), seed % 2 > 0)
    switched = change is not None and bool(change.path)
    if switched:
        rig = replace(rig, switches=_switches(change, rig.values[change.path], at, slow))
    reference = np.cumsum(speed) * PERIOD if machine.mode == 'position' else speed
    columns = emulated_bench.run(rig, machine.mode, reference, load, PERIOD, seed)
    if change is not None and not switched:
        begin = round(at / PERIOD)
        late = columns[change.column][begin:]
        if change.added:
            size = 2.0 * rig.values['mesh.gap'] if change.column == 'load_position' else (
                0.1 * machine.load)
            late += size * _share(np.arange(len(late)) * PERIOD, slow)
        else:
            late[:] = late[0]
    return Recording(rig_name, PERIOD, {n: c for n, c in columns.items() if n != 't'},
                     family='cycle', replicate=1, servo=rig_name)


def _share(time: np.ndarray, slow: bool) -> np.ndarray:
    """Return how much of a change is there, 0 to 1, so long after it began."""
    return np.clip(time / RAMP, 0.0, 1.0) if slow else np.ones(len(time))


def _switches(change: Change, was: float, at: float, slow: bool) -> tuple[Switch, ...]:
    time = np.arange(0.0, RAMP + RAMP_STEP / 2, RAMP_STEP) if slow else np.zeros(1)
    becomes = was * change.factor + change.added
    return tuple(Switch(at + t, {change.path: was + (becomes - was) * s})
                 for t, s in zip(time, _share(time, slow), strict=True))
