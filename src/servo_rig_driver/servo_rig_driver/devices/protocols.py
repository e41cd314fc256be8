"""Makes the device that a driver's parameters name; the one place that knows all protocols."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ..driver.rig_health import RigHealth
from ..driver.rig_watch import RigWatch
from .canopen_device import CanopenDevice
from .device import Device
from .drive_settings import DriveSettings
from .mit_mode import MitMode
from .mit_table import load_mit_table
from .moteus import Moteus
from .moteus_registers import MoteusTable
from .object_dictionary import NODE_IDS
from .odrive import load_odrive, Odrive
from .on_request import OnRequest
from .pdo_table import load_frames

Made = tuple[Device, RigWatch]
_ANSWER = 'answer'


def drive_settings(of: Mapping[str, Any]) -> DriveSettings:
    """Return the settings of one drive by the driver's parameters; raises DeviceError."""
    return DriveSettings(
        of['device.id'], of['device.host'], of['device.ratio'], of['device.torque_constant'],
        of['device.rest_speed'], of['device.kp'], of['device.kd'], of['device.brake'],
        of['device.watchdog'], of['retry_period'], of['joint_names'][-1])


def _canopen(of: Mapping[str, Any], health: RigHealth) -> Made:
    table = load_frames(of['dictionaries'], {name: of[f'nodes.{name}'] for name in NODE_IDS})
    watch = RigWatch({number: name for name, number in table.ids.items()}, health,
                     of['heartbeat_timeout'])
    return CanopenDevice(table, watch, round(of['sync_period'] * 1e9), of['retry_period'],
                         of['nodes.driver']), watch


def _one_drive(kind: Callable[..., OnRequest], load: Callable[[str], Any]
               ) -> Callable[[Mapping[str, Any], RigHealth], Made]:
    def make(of: Mapping[str, Any], health: RigHealth) -> Made:
        watch = RigWatch({of['device.id']: 'drive'}, health, of['heartbeat_timeout'], _ANSWER)
        return kind(load(of['device.table']), drive_settings(of), watch), watch
    return make


PROTOCOLS: Mapping[str, Callable[[Mapping[str, Any], RigHealth], Made]] = {
    'canopen': _canopen,
    'odrive': _one_drive(Odrive, load_odrive),
    'mit': _one_drive(MitMode, load_mit_table),
    'moteus': _one_drive(Moteus, MoteusTable),
}
"""By the parameter `protocol`; each raises DeviceError, DictionaryError or FrameError."""
