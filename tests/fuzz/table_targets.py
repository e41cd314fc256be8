"""Tables: CSV, Parquet, NPZ, MAT and JSON."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from target import SERVO, Take, Target

READERS = ('servo_identify.data.tables',)


def _table(suffix: str, mapping: str = '') -> Take:
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
    return {'t': t, 'voltage': np.sin(9 * t), 'motor_position': t * t, 'load_position': t * t / 30}


def csv_seeds(folder: Path) -> list[bytes]:
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

TARGETS = (
    Target('csv', True, csv_seeds, _table('.csv'), (*READERS, 'servo_identify.data.csv_table',
                                              'servo_identify.data.csv_layout')),
    Target('parquet', False, _parquet_seeds, _table('.parquet'),
           (*READERS, 'servo_identify.data.parquet_memory')),
    Target('npz', False, _npz_seeds, _table('.npz'),
           (*READERS, 'servo_identify.data.numpy_file')),
    Target('mat', False, _mat_seeds, _table('.mat', MAPPING),
           (*READERS, 'servo_identify.data.mat_file')),
    Target('json', True, _json_seeds, _table('.json', MAPPING),
           (*READERS, 'servo_identify.data.json_file', 'servo_identify.data.json_shapes')),
)
