"""What comes over the bus, and the files that say what its frames mean."""

from __future__ import annotations

from functools import cache
import logging
from pathlib import Path
import shutil

from target import every, files, ROOT, Take, Target

DEVICES = ROOT / 'src/servo_rig_driver/servo_rig_driver/devices'
EDS = DEVICES / 'eds'


@cache
def _table():
    from servo_rig_driver.devices.pdo_table import load_frames
    return load_frames('rv_bench')


def _take_eds(content: bytes, folder: Path) -> object:
    """Read a spoilt dictionary, and have its frames say and hear something."""
    from servo_rig_driver.devices.canopen_rig import RigFrames
    from servo_rig_driver.devices.pdo_table import load_frames
    for one in (EDS / 'rv_bench').glob('*.eds'):
        shutil.copy(one, folder / one.name)
    (folder / 'drive.eds').write_bytes(content)
    frames = load_frames(str(folder))
    for frame in frames.values():
        frame.decode(bytes(range(frame.length)))
        frame.pack([1.0] * len(frame.fields), clamp=True)
    return RigFrames(frames).carried()


@cache
def _objects():
    from servo_rig_driver.emulated.object_server import Objects
    logging.getLogger('canopen').setLevel(logging.CRITICAL)  # it says much of each bad request
    answers: list = []
    return Objects(_table(), answers.extend, lambda *_: 0, lambda *_: None), answers


def _take_packet(content: bytes, folder: Path) -> object:
    from servo_rig_driver.can_bus.unix_frames import EXPIRY, expiry_of, from_bytes
    from servo_rig_driver.devices.sdo import write_response
    frames = _table()
    for identifier, data in from_bytes(content[EXPIRY.size:] if expiry_of(content) else content):
        write_response(data)
        frame = frames.by_id.get(identifier)
        if frame is not None:
            values = frame.decode(data)
            assert all(isinstance(value, int | float) for value in values.values())


def _packet_seeds(folder: Path) -> list[bytes]:
    from servo_rig_driver.can_bus.unix_frames import EXPIRES, EXPIRY, to_bytes
    frames = _table()
    one = [to_bytes(frame.cob_id, bytes(frame.length)) for frame in frames.values()]
    expiring = EXPIRY.pack(EXPIRES, 7, 1) + one[0]
    aborted = to_bytes(0x581, bytes([0x80, 0x60, 0x60, 0, 1, 2, 3, 4]))
    return [*one, b''.join(one), expiring, aborted]


def _sdo_seeds(folder: Path) -> list[bytes]:
    return [bytes.fromhex(one) for one in (
        '010840001000 00000000', '02084041600000000000', '0108 23061000 e8030000',
        '0108 2B171000 64000000', '0108 21061000 08000000', '0108 0001020304050607',
        '0108 6000000000000000', '0108 80001000 00000000', '0308 40001A02 00000000')]


def _take_sdo(content: bytes, folder: Path) -> object:
    """Give the nodes of the emulated rig requests: an id, a length and the bytes, each."""
    objects, answers = _objects()
    answers.clear()
    while len(content) > 2:
        size = content[1] % 9
        objects.take(0x600 + content[0] % 8, content[2:2 + size], 0.0)
        content = content[2 + size:]
    assert all(len(data) == 8 for _, data in answers)


def _drive(protocol: str, name: str) -> Take:
    """Return what makes a drive by a spoilt table, and has it say and hear all it can."""
    def take(content: bytes, folder: Path) -> object:
        from servo_rig_driver.devices.drive_master import DriveState, Order
        from servo_rig_driver.devices.pdo_table import FrameError
        from servo_rig_driver.devices.protocols import PROTOCOLS
        from servo_rig_driver.driver.driver_parameters import DECLARED
        from servo_rig_driver.driver.rig_health import RigHealth
        from servo_rig_driver.driver.setpoints import Mode, Setpoint
        (folder / name).write_bytes(content)
        of = {one.name: one.default for one in DECLARED}
        of |= {'device.table': str(folder / name), 'device.ratio': 9.0, 'device.kd': 1.0,
               'device.torque_constant': 0.1}
        drive, _ = PROTOCOLS[protocol](of, RigHealth())
        said = [*drive.query(), *drive.off()]
        for state in (DriveState.SWITCH_ON_DISABLED, DriveState.OPERATION_ENABLED):
            drive._state = state
            for order in Order:
                for mode in (Mode.CURRENT, Mode.VELOCITY, Mode.POSITION):
                    said += drive.ask(0, order, Setpoint(0, mode, 0.5, None), 0)
        said += [(number, bytes(8)) for number in range(64)]
        for identifier, data in said:
            try:
                drive.take(identifier, data, 0)
            except FrameError:
                continue
        return said
    return take


TARGETS = (
    Target('eds', True, files(EDS / 'rv_bench' / 'drive.eds'), _take_eds,
           ('servo_rig_driver.devices.object_dictionary', 'servo_rig_driver.devices.pdo_table')),
    Target('dbc', True, every(DEVICES / 'tables', '*.dbc'), _drive('odrive', 'drive.dbc'),
           ('servo_rig_driver.devices.dbc_messages', 'servo_rig_driver.devices.odrive')),
    Target('mit_table', True, every(DEVICES / 'tables', '[cr]*.yaml'), _drive('mit', 'model.yaml'),
           ('servo_rig_driver.devices.mit_table', 'servo_rig_driver.devices.bit_frames',
            'servo_rig_driver.devices.mit_mode')),
    Target('moteus_table', True, files(DEVICES / 'tables' / 'moteus.yaml'),
           _drive('moteus', 'moteus.yaml'),
           ('servo_rig_driver.devices.moteus_registers', 'servo_rig_driver.devices.moteus')),
    Target('packet', False, _packet_seeds, _take_packet,
           ('servo_rig_driver.can_bus.unix_frames', 'servo_rig_driver.devices.sdo')),
    Target('sdo', False, _sdo_seeds, _take_sdo, ('servo_rig_driver.emulated.object_server',)),
)
