"""
What is fuzzed: each target gives seeds and takes one spoilt input.

A target answers or raises one of ``SAID`` with a sentence: what a command prints as one line.
Anything else that comes out of it is a finding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
import io
from pathlib import Path
from random import Random
import shutil
import zipfile

import numpy as np

CONFIG = Path(__file__).resolve().parents[2] / 'config'
SERVO = CONFIG / 'servos' / 'dc_gearmotor.yaml'
EDS = Path(__file__).resolve().parents[2] / 'src/servo_rig_driver/servo_rig_driver/devices/eds'
SAID = (ValueError, OSError)


@dataclass(frozen=True)
class Target:
    """
    One thing that reads what comes from outside.

    ``seeds(folder)`` returns good inputs, ``take(content, folder)`` reads a spoilt one; ``folder``
    is its own to write in. ``modules`` are the parsers whose coverage counts.
    """

    name: str
    text: bool
    seeds: Callable[[Path], list[bytes]]
    take: Callable[[bytes, Path], object]
    modules: tuple[str, ...]


def _files(*paths: Path) -> Callable[[Path], list[bytes]]:
    return lambda folder: [path.read_bytes() for path in paths]


def _all(folder: str) -> Callable[[Path], list[bytes]]:
    return _files(*sorted((CONFIG / folder).glob('*.yaml')))


def _table(suffix: str, mapping: str = '') -> Callable[[bytes, Path], object]:
    def take(content: bytes, folder: Path) -> object:
        from servo_identify.data.table_import import import_table
        path = folder / f'table{suffix}'
        path.write_bytes(content)
        named = folder / 'mapping.yaml'
        named.write_text(mapping)
        return import_table(path, SERVO, mapping=named if mapping else None)
    return take


def _columns(count: int = 60) -> dict[str, np.ndarray]:
    t = 0.001 * np.arange(count)
    return {'t': t, 'voltage': np.sin(9 * t), 'motor_position': t * t, 'load_position': t * t / 9}


def _csv_seeds(folder: Path) -> list[bytes]:
    columns = _columns()
    made = []
    for between, point in ((',', '.'), (';', ','), ('\t', '.')):
        rows = [between.join(columns)] + [
            between.join(repr(float(v)).replace('.', point) for v in row)
            for row in zip(*columns.values(), strict=True)]
        made.append('\n'.join(rows).encode())
    return [*made, b'# said\n' + made[0].replace(b'motor_position', b'motor_position [deg]')]


def _parquet_seeds(folder: Path) -> list[bytes]:
    from pyarrow import parquet, Table
    made = []
    for compression in ('none', 'zstd', 'snappy'):
        parquet.write_table(Table.from_pydict(_columns()), folder / 'seed',
                            compression=compression)
        made.append((folder / 'seed').read_bytes())
    return made


def _npz_seeds(folder: Path) -> list[bytes]:
    made = []
    for save in (np.savez, np.savez_compressed):
        save(folder / 'seed.npz', **_columns())
        made.append((folder / 'seed.npz').read_bytes())
    np.savez_compressed(folder / 'bomb.npz', **_columns(), zeros=np.zeros(10**7))
    return [*made, (folder / 'bomb.npz').read_bytes()]


def _mat_seeds(folder: Path) -> list[bytes]:
    from scipy.io import savemat
    made = []
    for compress in (False, True):
        savemat(folder / 'seed.mat', {**_columns(), 'gain': 3.0, 'said': 'x'},
                do_compression=compress)
        made.append((folder / 'seed.mat').read_bytes())
    savemat(folder / 'four.mat', _columns(), format='4')
    return [*made, (folder / 'four.mat').read_bytes()]


def _json_seeds(folder: Path) -> list[bytes]:
    import json
    columns = {name: values.tolist() for name, values in _columns(12).items()}
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return [json.dumps(columns).encode(), json.dumps(rows).encode(),
            json.dumps({'entries': rows, 'mass': 2.0}).encode()]


MAPPING = ('time: {source: t}\ncolumns:\n  voltage: {source: voltage}\n'
           '  motor_position: {source: motor_position}\n'
           '  load_position: {source: load_position}\n')


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


def _take_eds(content: bytes, folder: Path) -> object:
    from servo_rig_driver.devices.pdo_table import load_frames
    for one in (EDS / 'rv_bench').glob('*.eds'):
        shutil.copy(one, folder / one.name)
    (folder / 'drive.eds').write_bytes(content)
    return load_frames(str(folder))


def _take_packet(content: bytes, folder: Path) -> object:
    from servo_rig_driver.can_bus.unix_frames import from_bytes
    from servo_rig_driver.devices.pdo_table import load_frames
    from servo_rig_driver.devices.sdo import write_response
    global _frames
    _frames = _frames or load_frames('rv_bench')
    for identifier, data in from_bytes(content):
        write_response(data)
        frame = _frames.by_id.get(identifier)
        if frame is not None:
            values = frame.decode(data)
            assert all(isinstance(value, int | float) for value in values.values())


_frames = None


def _packet_seeds(folder: Path) -> list[bytes]:
    from servo_rig_driver.can_bus.unix_frames import to_bytes
    from servo_rig_driver.devices.pdo_table import load_frames
    frames = load_frames('rv_bench')
    one = [to_bytes(frame.cob_id, bytes(frame.length)) for frame in frames.values()]
    return [*one, b''.join(one), to_bytes(0x581, bytes([0x80, 0x60, 0x60, 0, 1, 2, 3, 4]))]


def _sdo_seeds(folder: Path) -> list[bytes]:
    return [bytes.fromhex(one) for one in (
        '010840001000 00000000', '02084041600000000000', '0108 23061000 e8030000',
        '0108 2B171000 64000000', '0108 21061000 08000000', '0108 0001020304050607',
        '0108 6000000000000000', '0108 80001000 00000000', '0308 40001A02 00000000')]


def _take_sdo(content: bytes, folder: Path) -> object:
    """Give the nodes of the emulated rig requests: an id, a length and the bytes, each."""
    from servo_rig_driver.devices.pdo_table import load_frames
    from servo_rig_driver.emulated.object_server import Objects
    global _frames
    _frames = _frames or load_frames('rv_bench')
    answers: list = []
    objects = Objects(_frames, answers.extend, lambda *_: 0, lambda *_: None)
    while len(content) > 2:
        size = content[1] % 9
        objects.take(0x600 + content[0] % 8, content[2:2 + size], 0.0)
        content = content[2 + size:]
    assert all(len(data) == 8 for _, data in answers)


def _bag_seeds(folder: Path) -> list[bytes]:
    from servo_identify.data.table_import import import_table
    from servo_twin.bag import write_recording
    (folder / 'seed.csv').write_bytes(_csv_seeds(folder)[0])
    recording = import_table(folder / 'seed.csv', SERVO)
    shutil.rmtree(folder / 'seed_bag', ignore_errors=True)
    write_recording(folder / 'seed_bag', recording)
    return [next((folder / 'seed_bag').glob('*.mcap')).read_bytes()]


def _take_mcap(content: bytes, folder: Path) -> object:
    from servo_twin.bag import read_changes, read_predictions, read_recording
    path = folder / 'one.mcap'
    path.write_bytes(content)
    for also in (read_predictions, read_changes):
        try:
            also(path)
        except SAID as said:
            assert str(said)
    return read_recording(path)


def _metadata_seeds(folder: Path) -> list[bytes]:
    _bag_seeds(folder)
    text = (folder / 'seed_bag' / 'metadata.yaml').read_bytes()
    return [text, text.replace(b'seed_bag_0.mcap', b'../one.mcap'),
            text.replace(b'seed_bag_0.mcap', b'/etc/passwd')]


def _take_metadata(content: bytes, folder: Path) -> object:
    from servo_twin.bag import read_recording
    bag = folder / 'bag'
    if not bag.exists():
        _bag_seeds(folder)
        (folder / 'seed_bag').rename(bag)
    (bag / 'metadata.yaml').write_bytes(content)
    return read_recording(bag)


def _sqlite_seeds(folder: Path) -> list[bytes]:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import get_typestore, Stores
    store = get_typestore(Stores.ROS2_JAZZY)
    kinds, made = store.types, []
    for plugin, suffix in ((StoragePlugin.SQLITE3, 'db3'), (StoragePlugin.MCAP, 'mcap')):
        shutil.rmtree(folder / 'foreign', ignore_errors=True)
        with Writer(folder / 'foreign', version=9, storage_plugin=plugin) as writer:
            joints = writer.add_connection('/joint_states', 'sensor_msgs/msg/JointState',
                                           typestore=store)
            command = writer.add_connection('/command', 'std_msgs/msg/Float64', typestore=store)
            for k in range(40):
                at = 10**18 + k * 10**6
                stamp = kinds['builtin_interfaces/msg/Time'](sec=10**9, nanosec=k * 10**6)
                header = kinds['std_msgs/msg/Header'](stamp=stamp, frame_id='')
                joint = kinds['sensor_msgs/msg/JointState'](
                    header=header, name=['joint'], position=np.array([0.1 * k]),
                    velocity=np.array([]), effort=np.array([]))
                writer.write(joints, at, store.serialize_cdr(joint, 'sensor_msgs/msg/JointState'))
                writer.write(command, at, store.serialize_cdr(
                    kinds['std_msgs/msg/Float64'](data=float(k)), 'std_msgs/msg/Float64'))
        made.append(next((folder / 'foreign').glob(f'*.{suffix}')).read_bytes())
        shutil.copy(folder / 'foreign' / 'metadata.yaml', folder / f'{suffix}.yaml')
    return made


def _take_foreign(content: bytes, folder: Path) -> object:
    from servo_identify.data.table_import import import_table
    if not (folder / 'db3.yaml').exists():
        _sqlite_seeds(folder)
    suffix = 'db3' if content[:6] == b'SQLite' else 'mcap'
    bag = folder / 'other'
    shutil.rmtree(bag, ignore_errors=True)
    bag.mkdir()
    shutil.copy(folder / f'{suffix}.yaml', bag / 'metadata.yaml')
    (bag / f'foreign.{suffix}').write_bytes(content)
    text = (bag / 'metadata.yaml').read_text().replace('foreign_0.mcap', 'foreign.mcap')
    (bag / 'metadata.yaml').write_text(text)
    return import_table(bag, SERVO, mapping=CONFIG / 'imports' / 'joint_state.yaml')


DESCRIPTION = b"""<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="{1}">
<CoSimulation modelIdentifier="m" canGetAndSetFMUstate="true"/>
<ModelVariables><ScalarVariable name="a" valueReference="1" causality="input"><Real start="0"/>
</ScalarVariable></ModelVariables><ModelStructure/></fmiModelDescription>"""


def _fmu_seeds(folder: Path) -> list[bytes]:
    made = []
    for names in ({'binaries/linux64/m.so': b'none'}, {}, {'../../slip': b'x'},
                  {'binaries/linux64/m.so': b'none', '/slip': b'x'},
                  {'binaries/linux64/m.so': b'none', '../../../slip': b'x'},
                  {'binaries/linux64/m.so': b'none', 'bomb': bytes(10**7)}):
        memory = io.BytesIO()
        with zipfile.ZipFile(memory, 'w', zipfile.ZIP_DEFLATED) as archive:
            archive.writestr('modelDescription.xml', DESCRIPTION)
            for name, content in names.items():
                archive.writestr(name, content)
        made.append(memory.getvalue())
    return [*made, DESCRIPTION]


def _take_fmu(content: bytes, folder: Path) -> object:
    from servo_twin.fmu.fmu_file import opened
    if content[:5] == b'<?xml':  # a spoilt description in a sound archive
        with zipfile.ZipFile(folder / 'made.fmu', 'w') as archive:
            archive.writestr('modelDescription.xml', content)
            archive.writestr('binaries/linux64/m.so', b'none')
    else:
        (folder / 'made.fmu').write_bytes(content)
    with redirect_stderr(io.StringIO()):
        return opened(folder / 'made.fmu')


def _take_robot(reader: str, suffix: str) -> Callable[[bytes, Path], object]:
    def take(content: bytes, folder: Path) -> object:
        from servo_twin.cli import main
        path = folder / f'robot{suffix}'
        path.write_bytes(content)
        (folder / 'out.yaml').unlink(missing_ok=True)
        return _answered(main, [reader, str(path), '--joint', 'elbow', '-o',
                                str(folder / 'out.yaml')])
    return take


def _answered(main: Callable[[list[str]], int], words: list[str]) -> int:
    out, told = io.StringIO(), io.StringIO()
    try:
        with redirect_stdout(out), redirect_stderr(told):
            status = main(words)
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 2
    assert status in (0, 1, 2), status
    assert status == 0 or told.getvalue().strip() or out.getvalue().strip(), 'says nothing'
    assert 'Traceback' not in told.getvalue()
    if status:
        raise ValueError(told.getvalue() or out.getvalue())
    return status


COMMANDS = {
    'servo_twin': ('replay', 'linearise', 'from-mjcf', 'from-urdf', 'export', 'parameters'),
    'servo_identify': ('import', 'info', 'check', 'online', 'play', 'sinusoid'),
}


_WORDS = ('spoilt.yaml', 'spoilt.csv', 'rv_bench', 'dc_gearmotor', '--servo', '-o', 'out',
          '--mode', '--set', '--json', '-', '--from', '--joint', '--mapping', '--help', 'nan',
          '-1', '', '--', '--family', '--replicate', '10**9', '--input', '--output', 'a=b', '/',
          '.', 'mechanism.ratio=nan', '\udcff')


def _take_line(content: bytes, folder: Path) -> object:
    from importlib import import_module
    random = Random(content)
    program = random.choice(sorted(COMMANDS))
    (folder / 'spoilt.yaml').write_bytes(content)
    (folder / 'spoilt.csv').write_bytes(content)
    words = [random.choice(COMMANDS[program])]
    choice = [*_WORDS, content[:40].decode('latin1').replace('\x00', '')]
    words += [random.choice(choice) for _ in range(random.randrange(7))]
    words = [str(folder / word) if word.startswith(('spoilt', 'out')) else word for word in words]
    return _answered(import_module(f'{program}.cli').main, words)


TARGETS = {target.name: target for target in (
    Target('servo', True, _all('servos'), _take_servo,
           ('servo_twin.description.servo_file', 'servo_twin.description.strict_yaml')),
    Target('mapping', True, _all('imports'), _take_mapping, ('servo_identify.data.mapping',)),
    Target('rig', True, _all('rigs'), _take_rig, ('servo_rig_driver.emulated.rig_file',)),
    Target('eds', True, _files(EDS / 'rv_bench' / 'drive.eds'), _take_eds,
           ('servo_rig_driver.devices.object_dictionary', 'servo_rig_driver.devices.pdo_table')),
    Target('packet', False, _packet_seeds, _take_packet,
           ('servo_rig_driver.can_bus.unix_frames', 'servo_rig_driver.devices.sdo')),
    Target('sdo', False, _sdo_seeds, _take_sdo, ('servo_rig_driver.emulated.object_server',)),
    Target('csv', True, _csv_seeds, _table('.csv'), ('servo_identify.data.tables',)),
    Target('parquet', False, _parquet_seeds, _table('.parquet'), ('servo_identify.data.tables',)),
    Target('npz', False, _npz_seeds, _table('.npz'), ('servo_identify.data.tables',)),
    Target('mat', False, _mat_seeds, _table('.mat', MAPPING), ('servo_identify.data.tables',)),
    Target('json', True, _json_seeds, _table('.json', MAPPING), ('servo_identify.data.tables',)),
    Target('mcap', False, _bag_seeds, _take_mcap,
           ('servo_twin.bag.mcap_reading', 'servo_twin.bag.bag_reading',
            'servo_twin.bag.message_columns')),
    Target('metadata', True, _metadata_seeds, _take_metadata, ('servo_twin.bag.message_sources',)),
    Target('messages', False, _sqlite_seeds, _take_foreign,
           ('servo_identify.data.messages', 'servo_twin.bag.message_sources')),
    Target('fmu', False, _fmu_seeds, _take_fmu, ('servo_twin.fmu.fmu_file',)),
    Target('urdf', True, _files(CONFIG / 'robots' / 'arm.urdf'), _take_robot('from-urdf', '.urdf'),
           ('servo_twin.simulators.from_model.urdf_model',)),
    Target('mjcf', True, _files(CONFIG / 'robots' / 'arm.xml'), _take_robot('from-mjcf', '.xml'),
           ('servo_twin.simulators.from_model.mujoco_joint',)),
    Target('line', True, lambda folder: [b'rv_bench --servo', b'[1, 2]: x'], _take_line,
           ('servo_twin.cli', 'servo_identify.cli')),
)}


def cases(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield (target, file) of what was found before."""
    for path in sorted(folder.glob('*/*')):
        yield path.parent.name, path
