"""Bags: our own, their metadata, and rosbag2 folders of any messages."""

from __future__ import annotations

from pathlib import Path
import shutil

import numpy as np
from table_targets import csv_seeds
from target import CONFIG, SAID, SERVO, Target


def _bag_seeds(folder: Path) -> list[bytes]:
    from servo_identify.data.table_import import import_table
    from servo_twin.bag import write_recording
    (folder / 'seed.csv').write_bytes(csv_seeds(folder)[0])
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
            text.replace(b'seed_bag_0.mcap', b'/etc/passwd'),
            b'rosbag2_bagfile_information: ' + b'[' * 50_000]


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


TARGETS = (
    Target('mcap', False, _bag_seeds, _take_mcap,
           ('servo_twin.bag.mcap_reading', 'servo_twin.bag.bag_reading',
            'servo_twin.bag.message_columns', 'servo_twin.bag.rig_samples')),
    Target('metadata', True, _metadata_seeds, _take_metadata,
           ('servo_twin.bag.message_sources', 'servo_twin.bag.metadata_file')),
    Target('messages', False, _sqlite_seeds, _take_foreign,
           ('servo_identify.data.messages', 'servo_twin.bag.message_sources')),
)
