"""Fits as jobs: what one needs is named by paths, so that any worker that sees them can do it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from glob import glob
from pathlib import Path
import sys
from typing import Any

import yaml

from servo_twin.description import servo_file
from servo_twin.description.nearest_name import or_what
from servo_twin.physics.servo import Servo

from ..data.contradictions import contradictions
from ..data.reading import read_looked_at
from ..data.stretch import ALL, Stretch
from ..fit.estimate import Estimate
from ..fit.fit_choices import INPUT_OF, LEARNED, WEIGHTS
from ..fit.output_error import fit, Progress


@dataclass(frozen=True)
class Settings:
    """How a fit is made; the options of `servo-identify fit` and the keys of a file of jobs."""

    free: tuple[str, ...] = ()
    learn: str = 'physical'
    mode: str = 'measured_input'
    horizon: float | None = None
    weights: str = 'residual'
    delays: bool = True
    beyond_tolerance: bool = False
    robust: bool = False
    namespace: str | None = None
    mapping: str | None = None
    stretch: Stretch = ALL
    despite_check: bool = False

    def __post_init__(self) -> None:
        for name, choices in (('learn', LEARNED), ('mode', tuple(INPUT_OF)), ('weights', WEIGHTS)):
            if getattr(self, name) not in choices:
                raise ValueError(f'{name} = {getattr(self, name)!r}; there are {list(choices)}')
        if self.free and self.learn != 'physical':
            raise ValueError(f'free parameters are for learn = physical, not {self.learn}')


@dataclass(frozen=True)
class Job:
    """One fit: a servo file to begin with, bags, settings."""

    servo: Path
    bags: tuple[Path, ...]
    settings: Settings = Settings()


@dataclass(frozen=True)
class Answer:
    """What a job found: the servo, and either an estimate or what learning said."""

    servo: Servo
    estimate: Estimate | None = None
    said: tuple[str, ...] = ()


def run(job: Job, progress: Callable[[Progress], None] | None = None) -> Answer:
    """
    Read the files of a job, fit or learn.

    Raises ValueError for what cannot be fitted, and for red findings of the check of the data,
    unless it goes on ``despite_check``.
    """
    how, servo = job.settings, servo_file.load(job.servo)
    recordings = read_looked_at(job.bags, job.servo, how.mapping, how.namespace,
                                stretch=how.stretch)
    for recording in recordings:
        for warning in recording.warnings:
            print(f'{recording.name}: {warning}', file=sys.stderr)
    wrong = contradictions(recordings, servo, how.despite_check)
    if how.learn != 'physical':
        from ..learn.learned_effects import learn
        learned, said = learn(how.learn, servo, recordings)
        return Answer(learned, said=(*wrong, *said))
    free = how.free or tuple(servo.tolerance)
    if not free:
        raise ValueError(f'{job.servo}: no parameter has a tolerance; name some as free')
    estimate = fit(servo, recordings, free, mode=how.mode, horizon=how.horizon,
                   tolerance=not how.beyond_tolerance, delays=how.delays, robust=how.robust,
                   weights=how.weights, progress=progress)
    estimate = replace(estimate, warnings=(*wrong, *estimate.warnings))
    return Answer(estimate.servo, estimate)


def each(servo: Path, bags: Sequence[Path], settings: Settings) -> dict[str, Job]:
    """Return one job for each bag, named after it; same names are numbered."""
    jobs: dict[str, Job] = {}
    for bag in bags:
        name, number = bag.stem, 2
        while name in jobs:
            name, number = f'{bag.stem}_{number}', number + 1
        jobs[name] = Job(servo.resolve(), (bag.resolve(),), settings)
    return jobs


def read_jobs(path: Path, common: Mapping[str, Any] | None = None) -> dict[str, Job]:
    """
    Read a file of jobs.

    It says::

        settings: {mode: measured_input}    # of all fits; may be left out
        fits:
          press_7:                          # the name of what is written
            servo: servos/press.yaml        # paths are relative to this file
            bags: [bags/press_7/*]          # a pattern stands for all that it matches
            free: [mechanism.load_inertia]  # and other settings of this fit alone
            stretch: [600, 660]             # s of each bag; left out: all
            despite_check: true             # fit also where the check finds something red

    ``common`` settings stand behind those of the file. Raises ValueError naming what is wrong.
    """
    told = yaml.safe_load(path.read_text())
    if not isinstance(told, dict) or not isinstance(told.get('fits'), dict) or not told['fits']:
        raise ValueError(f"{path}: there is no mapping 'fits' with a servo and bags by name")
    _known(path, 'the file', told, ('settings', 'fits'))
    known = tuple(f.name for f in fields(Settings))
    shared = {**(common or {}), **(told.get('settings') or {})}
    jobs = {}
    for name, row in told['fits'].items():
        where = f'fits.{name}'
        if not isinstance(row, dict) or not row.get('servo') or not row.get('bags'):
            raise ValueError(f"{path}: {where} needs 'servo' and 'bags'")
        if Path(str(name)).name != str(name):
            raise ValueError(f'{path}: {where}: the name becomes that of a file')
        _known(path, where, {**shared, **row}, ('servo', 'bags', *known))
        chosen = {**shared, **{k: v for k, v in row.items() if k in known}}
        try:
            settings = Settings(**{**chosen, 'free': tuple(chosen.get('free') or ()),
                                   'stretch': _stretch(chosen.get('stretch', ALL))})
        except ValueError as problem:
            raise ValueError(f'{path}: {where}: {problem}') from None
        given = row['bags'] if isinstance(row['bags'], list) else [row['bags']]
        bags = [bag for pattern in given for bag in _matching(path, where, str(pattern))]
        jobs[str(name)] = Job((path.parent / row['servo']).resolve(), tuple(bags), settings)
    return jobs


def _stretch(told: Any) -> Stretch:
    try:
        begin, end = map(float, told)
    except (TypeError, ValueError):
        raise ValueError(f'stretch = {told!r}; write two instants in s, such as '
                         '[600, 660]') from None
    return Stretch(begin, end)


def _known(path: Path, where: str, row: Mapping[str, Any], known: Sequence[str]) -> None:
    for key in row:
        if key not in known:
            raise ValueError(f'{path}: {where} has the key {key!r}; {or_what(key, known)}')


def _matching(path: Path, where: str, pattern: str) -> list[Path]:
    found = sorted(glob(str(path.parent / pattern)))
    if not found:
        raise ValueError(f'{path}: {where}: no bag matches {pattern}')
    return [Path(one).resolve() for one in found]
