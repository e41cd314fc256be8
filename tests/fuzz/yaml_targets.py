"""Files of settings: servo, mapping, rig and driver YAML."""

from __future__ import annotations

from pathlib import Path

from target import CONFIG, every, Target


def _take_servo(content: bytes, folder: Path) -> object:
    from servo_twin.description.servo_file import load
    (folder / 'servo.yaml').write_bytes(content)
    return load(folder / 'servo.yaml')


def _take_mapping(content: bytes, folder: Path) -> object:
    from servo_identify.data.mapping import read_mapping
    (folder / 'mapping.yaml').write_bytes(content)
    return read_mapping(folder / 'mapping.yaml')


def _take_rig(content: bytes, folder: Path) -> object:
    from servo_rig_driver.emulated.rig_file import load_rig
    (folder / 'rig.yaml').write_bytes(content)
    return load_rig(folder / 'rig.yaml').parameters()


def _take_driver(content: bytes, folder: Path) -> object:
    """Make the device that a parameter file speaks of, and the emulated drive beside it."""
    from servo_rig_driver.devices.device import DeviceError
    from servo_rig_driver.devices.protocols import PROTOCOLS
    from servo_rig_driver.driver.driver_parameters import contradiction, DECLARED, limits
    from servo_rig_driver.driver.rig_health import RigHealth
    from servo_rig_driver.emulated.drives.by_protocol import driver_parameters
    (folder / 'driver.yaml').write_bytes(content)
    given = driver_parameters(folder / 'driver.yaml')
    of = {one.name: one.default for one in DECLARED}
    for name, value in given.items():  # ROS refuses other names and kinds by itself
        if type(value) is type(of.get(name)):
            of[name] = value
    if contradiction(of):
        return None
    limits(of)
    if of['protocol'] not in PROTOCOLS:
        raise DeviceError(of['protocol'])
    return PROTOCOLS[of['protocol']](of, RigHealth())


TARGETS = (
    Target('servo', True, every(CONFIG / 'servos', '*.yaml'), _take_servo,
           ('servo_twin.description.servo_file', 'servo_twin.description.strict_yaml')),
    Target('mapping', True, every(CONFIG / 'imports', '*.yaml'), _take_mapping,
           ('servo_identify.data.mapping',)),
    Target('rig', True, every(CONFIG / 'rigs', '*.yaml'), _take_rig,
           ('servo_rig_driver.emulated.rig_file',)),
    Target('driver', True, every(CONFIG / 'drivers', '*.yaml'), _take_driver,
           ('servo_rig_driver.emulated.drives.by_protocol', 'servo_rig_driver.devices.protocols')),
)
