"""What one does with recordings and a servo file: read, check, fit, diagnose."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.physics.servo import Servo, ServoError
from servo_twin.recording.recording import Recording

from ..data.contradictions import contradictions
from ..data.long_bags import looked_at
from ..data.mapping import read_mapping
from ..data.reading import read_mapped
from ..data.recording_check import check as check_data
from ..data.rows_in_turn import check_turns
from ..data.several_runs import long_enough, runs_of
from ..data.split_stamps import with_whole_stamps
from ..data.table_import import recording_of, with_left_out
from ..fit.output_error import fit as fit_output_error
from .answers import Answer, Checked, Fitted
from .frames import in_memory, table_in
from .recordings import named_apart, Recordings
from .servo_text import ServoFile

Machine = ServoFile | Servo | str | Path
"""A machine: what :func:`load_servo` returned, a servo, a path, or the name of a shipped file."""


def load_servo(name_or_path: str | Path) -> ServoFile:
    """
    Read a servo file by its path, or a shipped one by its name, such as ``rv_bench``.

    Raises ServoError (a ValueError) that names the file, the value, its limits and the choice.
    """
    if not isinstance(name_or_path, str | Path):
        raise TypeError('load_servo takes a path or the name of a shipped servo file; this is '
                        f'{type(name_or_path).__name__}')
    path = servo_at(name_or_path)
    return ServoFile(servo_file.load(path), path.read_text('utf8'), path)


def read(paths: str | Path | Mapping[str, Any] | Iterable[str | Path | Mapping[str, Any]],
         servo: Machine, mapping: str | Path | None = None, name: str = 'table',
         family: str = '') -> Recordings:
    """
    Read recordings: bags, tables, patterns of their names, or columns held in memory.

    ``paths`` is one name or several; or columns by name: a dictionary of arrays of shape
    (samples,), a frame (pandas, polars), an Arrow table, a structured array, an xarray Dataset.
    They are ``t`` in s (a column, the index or a coordinate) and the channels in SI units, or with
    the unit behind the name (``motor_position [deg]``). Angles, speeds and torques are positive
    the same way on both shafts. ``mapping`` is a mapping file for columns with other names.
    ``name`` and ``family`` are those of columns in memory; several of them are numbered.
    A bag may be longer than the memory: from 300 000 samples on its arrays cannot be changed and
    are pages of a file in the folder for temporary files, read as they are used.
    Raises TypeError for what is neither, ValueError or OSError that names the file or the column.
    """
    machine = _machine(servo)
    if not isinstance(mapping, str | Path | None):
        raise TypeError(f'mapping is {type(mapping).__name__}, it must be the path of a mapping '
                        'file')
    for word, value in (('name', name), ('family', family)):
        if not isinstance(value, str):
            raise TypeError(f'{word} is {type(value).__name__}, it must be a text')
    if hasattr(paths, 'collect') or hasattr(paths, 'read'):
        raise TypeError(f'read takes names of files or columns; this is {type(paths).__name__}: '
                        'collect() a lazy frame first, and give the name of an open file')
    if in_memory(paths):
        return Recordings(tuple(_held(paths, machine, mapping, name, family)))
    several: list[Any] = [paths] if isinstance(paths, str | Path) or not isinstance(
        paths, Iterable) else list(paths)
    if isinstance(paths, Iterable) and not several:
        raise ValueError('read was given no file and no columns: an empty list, as of a pattern '
                         'that no file has; give the pattern itself, and it says so')
    if several and all(map(in_memory, several)):
        numbered = {f'{name}_{number}': one for number, one in enumerate(several, 1)}
        return Recordings(tuple(run for called, one in numbered.items()
                                for run in _held(one, machine, mapping, called, family)))
    if not all(isinstance(one, str | Path) for one in several):
        raise TypeError('read takes names of files, or columns by name, such as '
                        "{'t': ..., 'current': ..., 'load_position': ...}; this is "
                        f'{type(paths).__name__}')
    if machine.path is None:
        raise ValueError(f'{machine.name} has no file; tables are read by one: save it and '
                         'load_servo it')
    return Recordings(tuple(read_mapped(several, machine.path, mapping)))


def check(data: Sequence[Recording], servo: Machine) -> Checked:
    """
    Hold recordings against a servo file before anything is fitted.

    Looks at units, signs, sampling, saturation and excitation. The answer prints one line a
    finding and is true where no finding is red. What is wrong with the recordings is a finding;
    raises TypeError for data that were not read, ServoError for a file that is no servo file.
    """
    several, = named_apart([_recordings(data)])
    return Checked(check_data(several, _machine(servo).servo))


def fit(data: Sequence[Recording], servo: Machine, free: Sequence[str] = (),
        *, despite_check: bool = False, **how: Any) -> Fitted:
    """
    Fit parameters of a servo file to recordings, by output error.

    ``free`` are paths of parameters; left out, all that have a tolerance in the servo file. The
    values found are in the units of the servo file, each with one standard error.
    ``how`` are the options of :func:`servo_identify.fit.output_error.fit`: mode, horizon, bounds,
    channels, robust, weights. Of recordings of more than 300 000 samples some parts are fitted
    (:mod:`.data.long_bags`). Raises ValueError for what cannot be fitted, and for red findings of
    :func:`check` unless ``despite_check``; TypeError for data that were not read, a text in place
    of several names, and an option that there is not.
    """
    machine = _machine(servo)
    for word, value in (('free', free), *how.items()):
        if word in ('free', 'channels'):
            _several(word, value)
    names = tuple(free) or tuple(machine.servo.tolerance)
    if not names:
        raise ServoError(f'{machine.name}: no parameter has a tolerance; name some as free')
    looked, = _looked_at(data)
    wrong = contradictions(looked, machine.servo, despite_check)
    estimate = fit_output_error(machine.servo, looked, names, **{'delays': True, **how})
    return Fitted(replace(estimate, warnings=(*wrong, *estimate.warnings)), machine)


def diagnose(data: Sequence[Recording], servo: Machine, *, accept: Sequence[Recording] = (),
             report: Sequence[Recording] = (), without: Sequence[str] = (),
             reach: Mapping[str, float] | None = None, despite_check: bool = False,
             progress: Callable[[str, float], None] | None = None) -> Answer:
    """
    Say where a twin departs from its rig, which effect is missing, how far the gap shrinks.

    ``accept`` and ``report`` are recordings held back to prove an effect and to measure the
    shrink; left out, the recordings are split. ``without`` names effects that are not considered.
    ``reach`` limits the next experiment: travel rad, speed rad/s, torque N m, amplitude V.
    Of recordings of more than 300 000 samples some parts are diagnosed, and the report says which.
    ``progress(stage, share)`` is told how far it is. Raises ValueError with a sentence for
    recordings that cannot be judged, and for red findings of :func:`check` unless
    ``despite_check``; TypeError for data that were not read and a text in place of several names.
    """
    from ..diagnose.diagnose import diagnose as diagnose_recordings
    from ..diagnose.mechanisms.every_hypothesis import check_without

    machine = _machine(servo)
    _several('without', without)
    check_without(without, machine.servo)
    more = {} if progress is None else {'tick': progress}
    screened, accepted, reported = _looked_at(data, accept, report)
    found = diagnose_recordings(screened, machine.servo, accepted, reported, tuple(without),
                                reach=reach, despite=despite_check, **more)
    return Answer(found, machine)


def _looked_at(*groups: Sequence[Recording]) -> list[list[Recording]]:
    """Return the parts of each group; a recording of two groups has the same parts in both."""
    listed = named_apart([_recordings(data) for data in groups])
    parts = {id(one): looked_at(one) for several in listed for one in several}
    return [[part for one in several for part in parts[id(one)]] for several in listed]


def _machine(servo: Machine) -> ServoFile:
    if isinstance(servo, ServoFile):
        return servo
    if isinstance(servo, Servo):
        return ServoFile(servo, servo_file.dumps(servo))
    if isinstance(servo, str | Path):
        return load_servo(servo)
    raise TypeError('a machine is what load_servo returned, a path or the name of a shipped servo '
                    f'file; this is {type(servo).__name__}')


def _recordings(data: Sequence[Recording]) -> list[Recording]:
    """Return recordings as a list; raises TypeError for what was not read yet."""
    several = [data] if isinstance(data, Recording) or not isinstance(data, Iterable) else (
        list(data))
    if all(isinstance(one, Recording) for one in several):
        return several
    raise TypeError(f'data is {type(data).__name__}, not recordings; read it first: '
                    'data = si.read(..., servo)')


def _several(word: str, names: Any) -> None:
    """Raise TypeError for a text where several names are wanted: its letters would be taken."""
    if isinstance(names, str):
        raise TypeError(f'{word} is a text, {names!r}, and takes several names: '
                        f'{word}=[{names!r}]')


def _held(columns: Mapping[str, Any], machine: ServoFile, mapping: str | Path | None, name: str,
          family: str) -> list[Recording]:
    """Return the recordings of columns in memory: one, or one for each episode."""
    table = table_in(columns, name)
    if not table.columns and not table.refused:
        raise ValueError(f'{name} has no columns: give them by name, such as '
                         "{'t': ..., 'current': ..., 'load_position': ...}")
    if not all(map(len, table.columns.values())):
        raise ValueError(f'{name} has no rows')
    plan = read_mapping(Path(mapping)) if mapping else None
    check_turns(table.path, table.columns)
    runs, left = long_enough(runs_of(with_whole_stamps(table)))
    facts = {'family': family} if family else {}
    return with_left_out([recording_of(run, machine.servo, machine.text, facts, plan)
                          for run in runs], left)
