"""Makes the emulated drive that a driver's parameter file speaks to: both ends by one file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import yaml

from ...devices.device import DeviceError
from ...devices.drive_settings import DriveSettings
from ...devices.mit_table import load_mit_table
from ...devices.moteus_registers import MoteusTable
from ...devices.odrive import load_odrive
from ...devices.tables import MALFORMED
from ...plain_yaml import read_yaml
from ..emulated_bench import Bench
from .mit_mode import EmulatedMit
from .moteus import EmulatedMoteus
from .odrive import EmulatedOdrive
from .one_drive import OneDrive, Send

CANOPEN = 'canopen'
DRIVES: Mapping[str, tuple[Callable[..., OneDrive], Callable[[str], Any]]] = {
    'odrive': (EmulatedOdrive, load_odrive),
    'mit': (EmulatedMit, load_mit_table),
    'moteus': (EmulatedMoteus, MoteusTable),
}


def driver_parameters(path: str | Path) -> dict[str, Any]:
    """
    Return the parameters of a driver file by their dotted names, as ROS reads them.

    Raises DeviceError for a file that is none.
    """
    try:
        content = read_yaml(Path(path).read_text(encoding='utf-8'))
        given = {}
        for node in content.values():
            given.update(_flat(node['ros__parameters']))
        return given
    except (OSError, yaml.YAMLError, RecursionError, *MALFORMED) as error:
        raise DeviceError(f'{path} is no parameter file of the driver: {error!r}') from error


def _flat(section: Mapping[str, Any], before: str = '') -> dict[str, Any]:
    flat = {}
    for key, value in section.items():
        if isinstance(value, Mapping):
            flat.update(_flat(value, f'{before}{key}.'))
        else:
            flat[f'{before}{key}'] = value
    return flat


def emulated_drive(of: Mapping[str, Any], bench: Bench, send: Send) -> OneDrive | None:
    """
    Return the drive that these parameters speak to; None for CANopen nodes.

    Gear and torque constant are those of the machine; ids, table and watchdog are read off the
    parameters. Raises DeviceError.
    """
    protocol = of.get('protocol', CANOPEN)
    if protocol == CANOPEN:
        return None
    if protocol not in DRIVES:
        raise DeviceError(f"protocol = '{protocol}' is unknown; it is one of "
                          f'{[CANOPEN, *DRIVES]}')
    values = bench.rig.values
    settings = DriveSettings(
        int(of.get('device.id', 1)), int(of.get('device.host', 0)), values['machine.ratio'],
        values['machine.torque_constant'], 1.0, watchdog=float(of.get('device.watchdog', 0.1)))
    kind, load = DRIVES[protocol]
    return kind(bench, load(of.get('device.table', '')), settings, send)
