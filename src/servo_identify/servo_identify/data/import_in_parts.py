"""
A long table as a bag, part by part: read once for what is to be known of it, once for its samples.

This serves a CSV or Parquet file of numbers alone, and messages in the order of their stamps, all
with times that rise. Of those whose times are not even the times alone are held. All others are
held whole, as table_import.py has it; what comes out is the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
import tempfile

import numpy as np

from servo_twin.bag import RecordingWriter
from servo_twin.description import servo_file
from servo_twin.recording.recording import Recording

from .between_rows import BetweenRows
from .column_units import named_columns
from .csv_layout import TEXTS
from .csv_table import numbers_in_parts
from .current_command import with_command
from .even_grid import Between, fits, follows, grid_of, own_period
from .joining import HELD
from .listing import beside
from .mapping import Mapping, read_mapping
from .message_files import holds_messages
from .messages_in_parts import long_messages, NotInOrder
from .missing_texts import without_infinite
from .on_disk import OnDisk
from .plausibility import check_angles
from .raw_encoder import check_counts
from .rows_in_turn import in_turn
from .run_labels import may_hold_runs
from .split_stamps import pairs_of
from .table import from_arrow, Table
from .table_import import check_columns, described, Seen, told_begin

ROWS = 100_000  # that are held at once, about
LOOKED_AT = 100_000  # rows at least by which angles are held against each other
_BLOCK = 1 << 20  # bytes of text; Arrow reads some thirty of them ahead

Columns = dict[str, np.ndarray]


class NotPlain(Exception):
    """A table that is to be held whole."""


def import_in_parts(path: Path, servo: Path, bag: Path, block_size: int, *,
                    mapping: Path | None = None, family: str | None = None,
                    replicate: int | None = None, note: str | None = None,
                    period: float = 0.0) -> Recording:
    """
    Write a table as a bag and return its recording, without samples.

    Raises NotPlain where the table has to be held whole, ValueError as import_table() does.
    """
    machine = servo_file.load(servo)
    plan = read_mapping(mapping) if mapping else None
    if plan and ('every' in plan.columns['t'] or plan.join or plan.drive_on or plan.rows or any(
            {'zero', 'wraps'} & set(steps) for steps in plan.columns.values())):
        raise NotPlain
    facts = (dict(plan.recording) if plan else {}) | beside(path)
    facts |= {name: value for name, value in
              (('family', family), ('replicate', replicate), ('note', note)) if value is not None}
    if any('{' in str(value) for value in facts.values()):
        raise NotPlain
    folder = bag.absolute().parent
    with (_parts_of(path, plan, folder) as tables,
          tempfile.TemporaryFile(dir=folder) as file):
        told, warnings = list[str](), list[str]()

        def parts() -> Iterator[Columns]:
            for table in tables():
                if (may_hold_runs(table.columns) or pairs_of(table.columns)
                        or in_turn(table.columns)):  # of the whole it is said
                    raise NotPlain
                again, minded = list[str](), list(table.warnings)
                columns = plan.apply(table, machine, again) if plan else named_columns(
                    table, machine, again)
                yield with_command(columns, machine, minded)
                again += told_begin(table, plan)
                if not told:
                    told.extend(again)
                if not warnings:
                    warnings.extend(minded)

        times = OnDisk(file, 'd')
        between_rows = BetweenRows()
        seen, some = _looked_over(parts(), times, between_rows)
        check_columns(path, seen, list(seen.finite), warnings)
        check_counts(path, some, machine)
        check_angles(path, some, machine)
        start, = times.part(0, 1)
        wanted = period or (plan.period if plan else 0.0)
        own = _even_period(times, seen.rows, wanted)
        step, samples = wanted or own, _untimed(parts())
        if not own:
            time = times.part()
            step, _ = grid_of(path, time, wanted, warnings, between_rows.sentence())
            between = Between(time, step)
            between.tell_holes(warnings)
            samples = _resampled(samples, between)
        head = described(path, machine, servo.read_text('utf8'), facts, told, warnings,
                         float(start), step, {})
        coupled = bool(seen.finite.get('coupled_position'))
        with RecordingWriter(bag, block_size, coupled=coupled) as written:
            for part in _in_blocks(samples, block_size):
                written.add(replace(head, columns=part.columns, sequence=part.sequence,
                                    start=head.start + part.sequence * head.period))
    return head


def _looked_over(parts: Iterator[Columns], times: OnDisk, between_rows: BetweenRows
                 ) -> tuple[Seen, Columns]:
    """Return what was seen, and some rows from all over; keep the times."""
    seen, last, stride = Seen(), -np.inf, 1
    kept: dict[str, list[np.ndarray]] = {}
    for columns in parts:
        time = columns.get('t')
        if time is None or not (np.diff(time, prepend=last) > 0.0).all():
            raise NotPlain
        times.extend(time)
        last = time[-1]
        rows = seen.rows
        seen.add(columns)
        columns = without_infinite(columns)
        for name, column in columns.items():
            kept.setdefault(name, []).append(column[-rows % stride::stride])
        between_rows.add(columns)
        if sum(map(len, kept['t'])) > 2 * LOOKED_AT:
            stride *= 2
            kept = {name: [np.concatenate(pieces)[::2]] for name, pieces in kept.items()}
    if seen.rows < 2 or not np.isfinite(last):
        raise NotPlain
    return seen, {name: np.concatenate(pieces) for name, pieces in kept.items()}


def _even_period(times: OnDisk, rows: int, wanted: float) -> float:
    """Return the period, s, that times follow as they are, 0 where they are to be resampled."""
    (start,), (last,) = times.part(0, 1), times.part(rows - 1, 1)
    own = own_period(start, last, rows)
    follow = fits(own, wanted, rows) and all(
        follows(times.part(first, ROWS), start, own, first) for first in range(0, rows, ROWS))
    return own if follow else 0.0


def _untimed(parts: Iterator[Columns]) -> Iterator[Columns]:
    """Yield the parts without their times."""
    for columns in parts:
        del columns['t']
        yield without_infinite(columns)


def _resampled(parts: Iterator[Columns], between: Between) -> Iterator[Columns]:
    """Yield the samples of an even grid as soon as the rows around them are there."""
    held: Columns = {}
    row = first = 0  # numbers of the first row that is held, and of the next sample
    for columns in parts:
        held = _joined(held, columns)
        end = between.known(row + _rows(held))
        if end > first:
            yield between.values(held, row, first, end)
            first = end
        if first < between.samples:
            over = between.row(first) - row
            held, row = {name: column[over:] for name, column in held.items()}, row + over


def _joined(before: Columns, columns: Columns) -> Columns:
    return {name: np.concatenate([before[name], column]) if before else column
            for name, column in columns.items()}


def _rows(columns: Columns) -> int:
    return len(next(iter(columns.values()), ()))


def _in_blocks(parts: Iterator[Columns], size: int) -> Iterator[Recording]:
    """Yield the rows in pieces that fill blocks, but for the last one, with their numbers."""
    rest: Columns = {}
    number = 0
    for columns in parts:
        rest = _joined(rest, columns)
        whole = _rows(rest) // size * size
        if whole:
            yield Recording('', 1.0, {name: column[:whole] for name, column in rest.items()},
                            sequence=number)
            rest, number = {name: column[whole:] for name, column in rest.items()}, number + whole
    if _rows(rest):
        yield Recording('', 1.0, rest, sequence=number)


@contextmanager
def _parts_of(path: Path, plan: Mapping | None, folder: Path
              ) -> Iterator[Callable[[], Iterator[Table]]]:
    """Give what yields the parts of a file, each time it is called."""
    if not holds_messages(path):
        yield lambda: _tables(path, plan)
        return
    if plan is None or 'source' not in plan.columns['t']:
        raise NotPlain
    try:
        with long_messages(path, plan.sources(), plan.columns['t']['source'],
                           plan.sources(*HELD), folder) as messages:
            yield lambda: messages.tables(ROWS)
    except NotInOrder:
        raise NotPlain from None


def _tables(path: Path, plan: Mapping | None) -> Iterator[Table]:
    """Yield the parts of a file of numbers alone."""
    from pyarrow import ArrowException, parquet, types
    from pyarrow import Table as Arrow

    try:
        if path.suffix.lower() == '.parquet':
            with parquet.ParquetFile(path) as file:
                if not all(types.is_floating(one.type) or types.is_integer(one.type)
                           for one in file.schema_arrow):
                    raise NotPlain
                for batch in file.iter_batches(ROWS):
                    yield from_arrow(path, Arrow.from_batches([batch]))
        elif path.suffix.lower() in TEXTS:
            for part in numbers_in_parts(path, plan.names if plan else (), _BLOCK):
                yield from_arrow(path, part)
        else:
            raise NotPlain
    except (ArrowException, OSError):
        raise NotPlain from None  # what is wrong is said where it is read whole
