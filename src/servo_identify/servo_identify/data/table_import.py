"""A table as a recording of the machine of a servo file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from servo_twin.description import servo_file
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .begins import begin_of
from .column_units import named_columns, time_of
from .current_command import with_command
from .even_grid import even
from .import_memory import check_memory
from .joining import HELD
from .listing import beside
from .mapping import Mapping as ColumnMapping
from .mapping import read_mapping
from .message_files import holds_messages
from .messages import read_messages
from .missing_texts import without_infinite
from .newest_first import oldest_first
from .packed import stem_of
from .plausibility import check_angles
from .raw_encoder import check_counts
from .several_runs import long_enough
from .stretch import ALL, Stretch
from .table import Table
from .tables import read_tables
from .time_units import unit_of_times

MANY = 0.3
"""Share of the rows without a number from which on a column may be sampled less often."""


def import_table(path: Path, servo: Path | None, *, mapping: Path | None = None,
                 family: str | None = None, replicate: int | None = None, note: str | None = None,
                 period: float = 0.0) -> Recording:
    """
    Return a table of one recording; raises ValueError for one of several.

    Arguments and errors are those of :func:`import_tables`.
    """
    found, *more = import_tables(path, servo, mapping=mapping, family=family, replicate=replicate,
                                 note=note, period=period)
    if more:
        raise ValueError(f'{path} holds {1 + len(more)} recordings, {found.name} to '
                         f'{more[-1].name}, and one is wanted here: `servo-identify import` makes '
                         'a bag of each')
    return found


def import_tables(path: Path, servo: Path | None, *, mapping: Path | None = None,
                  family: str | None = None, replicate: int | None = None,
                  note: str | None = None, period: float = 0.0, stretch: Stretch = ALL
                  ) -> list[Recording]:
    """
    Return the recordings of a table as :func:`import_runs` does; the first says what was left out.

    Arguments and errors are those of :func:`import_runs`.
    """
    found, left = import_runs(path, servo, mapping=mapping, family=family, replicate=replicate,
                              note=note, period=period, stretch=stretch)
    return with_left_out(found, left)


def import_runs(path: Path, servo: Path | None, *, mapping: Path | None = None,
                family: str | None = None, replicate: int | None = None, note: str | None = None,
                period: float = 0.0, stretch: Stretch = ALL
                ) -> tuple[list[Recording], dict[str, str]]:
    """
    Return the recordings of a table, mostly one, and which of its runs are too short.

    Of several, each has the name of its run behind that of the file, and their replicates count
    on. ``stretch`` is what is wanted of each. Without a servo file angles are not held against
    each other, and are in rad. What was changed or left out stands in a note, and what to mind in
    ``warnings``. Raises ValueError for a table whose columns, units, times or numbers cannot be
    those of a recording, and for one that the memory cannot hold; OSError for files that cannot
    be read.
    """
    machine = servo_file.load(servo) if servo else None
    plan = read_mapping(mapping) if mapping else None
    if not np.isfinite(period) or period < 0.0:
        raise ValueError(f'--period = {period} s, it must be positive')
    if path.exists():
        check_memory(path)
    text = servo.read_text('utf8') if servo else ''
    given = {name: value for name, value in
             (('family', family), ('replicate', replicate), ('note', note)) if value is not None}
    every = _tables(path, plan)
    _, left = long_enough(every)
    found = list[Recording]()
    for number, table in enumerate(every):
        if table.run in left:
            continue
        facts = (plan.describe(table) if plan else {}) | beside(path) | given
        if facts.get('replicate'):
            facts['replicate'] += number
        facts |= beside(path.with_name(f'{stem_of(path)}_{table.run}')) if table.run else {}
        found.append(recording_of(table, machine, text, facts, plan, period, stretch))
    return found, left


def with_left_out(found: Sequence[Recording], left: Mapping[str, str]) -> list[Recording]:
    """Return recordings of which the first says, as a warning, what was left out."""
    return [replace(found[0], warnings=(*found[0].warnings, *left.values())), *found[1:]]


def recording_of(table: Table, machine: Servo | None, servo_text: str, facts: Mapping[str, Any],
                 plan: ColumnMapping | None = None, period: float = 0.0, stretch: Stretch = ALL
                 ) -> Recording:
    """
    Return a table that was read as a recording of a machine, on an even grid.

    ``facts`` may hold family, replicate and note; ``plan`` says which column is which channel,
    without it they carry the names of channels; ``period`` in s, 0 takes it from the times. What
    was converted or left out stands in the note, and what to mind in the warnings as well.
    Raises ValueError as :func:`import_tables` does.
    """
    try:
        found, begin = _recording_of(table, machine, servo_text, facts, plan, period, stretch)
    except ValueError as problem:
        raise ValueError(f'{problem} ({table.run})' if table.run else str(problem)) from None
    name = f'{found.name}_{table.run}' if table.run else found.name
    return replace(found, name=stretch.named(name, begin, begin + found.duration))


def _recording_of(table: Table, machine: Servo | None, servo_text: str, facts: Mapping[str, Any],
                  plan: ColumnMapping | None, period: float, stretch: Stretch
                  ) -> tuple[Recording, float]:
    """Return the recording, and how many s after the first row it begins."""
    if not (plan and plan.columns['t'].get('negate')):
        table = oldest_first(table, plan.columns['t'].get('source', '') if plan else
                             time_of(table)[0])
    path, warnings, told = table.path, list(table.warnings), list[str]()
    columns = (plan.apply(table, machine, warnings) if plan
               else named_columns(table, machine, told))
    columns = with_command(columns, machine, warnings)
    told += told_begin(table, plan)
    seen = Seen()
    seen.add(columns)
    columns = without_infinite(columns)
    check_columns(path, seen, [*table.columns, *table.refused], warnings)
    if machine is not None:
        check_counts(path, columns, machine)
        check_angles(path, columns, machine)
    first = columns['t'][0]
    start, step, columns = even(path, columns, period or (plan.period if plan else 0.0), warnings,
                                stretch)
    return described(path, machine, servo_text, facts, told, warnings, start, step,
                     columns), float(start - first)


def told_begin(table: Table, plan: ColumnMapping | None) -> list[str]:
    """Return when the first row was taken, as a line of the note; none where nothing says it."""
    source, unit = plan.time if plan else time_of(table)
    begin = begin_of(table, source, unit) if source else ''
    return [f'the first row is of {begin}'] if begin else []


def described(path: Path, machine: Servo | None, servo_text: str, facts: Mapping[str, Any],
              told: list[str], warnings: list[str], start: float, step: float,
              columns: dict[str, np.ndarray]) -> Recording:
    """Return a recording with what is said of it; raises ValueError for a bad replicate."""
    if not 1e-6 <= step <= 1.0:
        unit = unit_of_times(step, start)
        warnings.append(f'a period of {step:.6g} s is unusual; is t in {unit or "s"}?')
    facts = dict(facts)
    if not 0 <= facts.get('replicate', 0) < 2**32:
        raise ValueError(f'replicate = {facts["replicate"]}, it must be 0 (not said) or more')
    facts['note'] = '\n'.join([facts.get('note', ''), *told, *warnings]).strip()
    return Recording(stem_of(path), step, columns, start=max(start, 0.0),
                     servo=machine.name if machine else '', servo_file=servo_text,
                     warnings=tuple(warnings), **facts)


def _tables(path: Path, plan: ColumnMapping | None) -> list[Table]:
    if not holds_messages(path):
        return read_tables(path, plan.rows if plan else '', plan.names if plan else ())
    if plan is None or 'source' not in plan.columns['t']:
        raise ValueError(f'{path}: a file of messages needs a mapping file (--mapping) whose time '
                         'has a source, such as /joint_states.stamp; config/imports has some, and '
                         f'`servo-identify init {path} -o S.yaml` writes one')
    return [read_messages(path, plan.sources(), plan.columns['t']['source'],
                          plan.sources(*HELD))]


class Seen:
    """What was seen of the columns of a table, part by part: rows, and what is no number."""

    def __init__(self) -> None:
        self.rows = 0
        self.finite: dict[str, int] = {}
        self.infinite: dict[str, tuple[int, int]] = {}  # how many rows, and the first of them
        self.absent: dict[str, tuple[int, int]] = {}
        self.begin: dict[str, int] = {}  # the first row with a number

    def add(self, columns: Mapping[str, np.ndarray]) -> None:
        """Look at the next rows."""
        for name, column in columns.items():
            self.finite[name] = self.finite.get(name, 0) + int(np.isfinite(column).sum())
            known = np.flatnonzero(np.isfinite(column))
            if len(known):
                self.begin.setdefault(name, self.rows + int(known[0]))
            for counts, none in ((self.infinite, np.isinf), (self.absent, np.isnan)):
                rows = np.flatnonzero(none(column))
                if len(rows):
                    before, first = counts.get(name, (0, self.rows + int(rows[0])))
                    counts[name] = before + len(rows), first
        self.rows += len(next(iter(columns.values()), ()))


def check_columns(path: Path, seen: Seen, headers: list[str], warnings: list[str]) -> None:
    """Raise ValueError for columns that make no recording; say what is missing in them."""
    have = [name for name, count in seen.finite.items() if count]
    if 't' not in have:
        raise ValueError(f'{path} has no column t; it has {headers}. ' + (
            'Which is which, a mapping file says (--mapping); `servo-identify init '
            f'{path} -o S.yaml` writes one' if path.exists() else
            "The time in s is 't'; columns with other names need a mapping file (mapping=)"))
    if 'motor_position' not in have and 'load_position' not in have:
        empty = [name for name in ('motor_position', 'load_position') if name in seen.finite]
        raise ValueError(f'{path}: no number stands in {" or ".join(empty)}' if empty else
                         f'{path} has neither motor_position nor load_position; it has {have}')
    if 'voltage' not in have:
        drives = ('the measured current drives the twin' if 'current' in have else
                  'two encoders alone tell the transmission between them' if {
                      'motor_position', 'load_position'} <= set(have) else
                  'a twin cannot be driven by this recording')
        warnings.append(f'there is no voltage, the command that the drive received: {drives}')
    for name in have:
        if name in seen.infinite and name != 't':
            count, first = seen.infinite[name]
            warnings.append(f'{name} is infinite in {count} row{"s" * (count != 1)}, the first is '
                            f'row {first + 1}: no number stands there, they are NaN')
        if name in seen.absent and name != 't':
            count, first = seen.absent[name]
            warnings.append(
                f'{name} begins in row {count + 1}; the rows before stay NaN'
                if count == seen.begin[name] else
                f'{name} is missing in {count} row{"s" * (count != 1)}, the first is row '
                f'{first + 1}; they stay NaN' + (
                    '. Where it is sampled less often: join: true in a mapping file'
                    if count > MANY * seen.rows else ''))
