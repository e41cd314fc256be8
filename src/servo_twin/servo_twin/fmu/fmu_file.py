"""An FMU on disk: is it one that the twin can run here, and what are its variables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
import hashlib
import os
from pathlib import Path
import shutil
import sys
from types import MappingProxyType
import zipfile

from ..physics.kernel import cache_folder
from ..physics.servo import MechanismFailure, ServoError

_FLOATS = ('Real', 'Float64')


class FmuError(ServoError):
    """An FMU that cannot be used, or that failed: names the file, the thing and the choice."""


class FmuFailure(MechanismFailure, FmuError):
    """An FMU that failed while it ran."""


@dataclass(frozen=True)
class Variable:
    """A real scalar variable of an FMU; ``start`` and bounds are None where it says nothing."""

    name: str
    reference: int
    causality: str
    variability: str
    unit: str
    factor: float  # SI for one of its unit; NaN where the unit is not told in base units
    start: float | None
    low: float | None
    high: float | None
    description: str


@dataclass(frozen=True, eq=False)
class OpenedFmu:
    """
    An FMU that can run on this machine, unpacked.

    ``version`` is 2 or 3; ``returns`` says whether it can go back to an earlier state, ``single``
    that only one instance may be in a process, ``variable_step`` that its step may change.
    """

    path: Path
    digest: str
    version: int
    folder: Path
    identifier: str
    guid: str
    returns: bool
    single: bool
    variable_step: bool
    internal_step: float | None
    tool: str
    variables: Mapping[str, Variable]

    def variable(self, name: str, asked: str) -> Variable:
        """Return a variable; raises FmuError that lists the names near it."""
        if name in self.variables:
            return self.variables[name]
        lower = {known.lower(): known for known in self.variables}
        near = [lower[n] for n in get_close_matches(name.lower(), lower, 6, 0.5)]
        choice = f'near it are {near}' if near else f'it has {list(self.variables)[:12]}'
        raise FmuError(f'{self.path.name}: {asked}: there is no real scalar variable {name!r}; '
                       f'{choice}')


def opened(path: Path) -> OpenedFmu:
    """
    Open an FMU, unpacking it once into the folder of compiled things.

    Raises FmuError: not there, not an FMU, of another version, for model exchange only, or
    without a binary for this machine.
    """
    try:
        content = path.read_bytes()
    except OSError as problem:
        raise FmuError(f'{path}: cannot be read: {problem.strerror}') from None
    return _opened(path.resolve(), hashlib.sha256(content).hexdigest())


@lru_cache(maxsize=16)
def _opened(path: Path, digest: str) -> OpenedFmu:
    if not zipfile.is_zipfile(path):
        raise FmuError(f'{path}: it is not an FMU (not a zip archive)')
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    if 'modelDescription.xml' not in names:
        raise FmuError(f'{path}: it is not an FMU (it holds no modelDescription.xml)')
    import fmpy
    try:
        described = fmpy.read_model_description(str(path), validate=False)
    except Exception as problem:  # of the parser, of many kinds
        raise FmuError(f'{path}: its modelDescription.xml cannot be read: {problem}') from None
    version = {'2': 2, '3': 3}.get(str(described.fmiVersion)[:1])
    if version is None:
        raise FmuError(f'{path}: it is of FMI {described.fmiVersion}; FMI 2.0 and 3.0 can be used')
    runs = described.coSimulation
    if runs is None:
        raise FmuError(f'{path}: it is for model exchange only; export it for co-simulation, so '
                       f'that it brings its own solver')
    place = fmpy.platform if version == 2 else fmpy.platform_tuple
    binary = f'binaries/{place}/{runs.modelIdentifier}{fmpy.sharedLibraryExtension}'
    if binary not in names:
        there = sorted({n.split('/')[1] for n in names if n.startswith('binaries/') and n[9:]})
        sources = any(n.startswith('sources/') and n.endswith('.c') for n in names)
        more = '; it has sources: `fmpy compile` makes a binary of them' if sources else ''
        raise FmuError(f'{path}: it has no binary for this machine ({place}); it has '
                       f'{there or "none"}{more}')
    print(f'{path}: the code of this FMU is run in this process', file=sys.stderr)
    return OpenedFmu(
        path, digest, version, _unpacked(path, digest), runs.modelIdentifier, described.guid,
        bool(runs.canGetAndSetFMUstate),
        bool(runs.canBeInstantiatedOnlyOncePerProcess),
        bool(runs.canHandleVariableCommunicationStepSize),
        getattr(runs, 'fixedInternalStepSize', None), described.generationTool or '',
        MappingProxyType(_variables(described)))


def _unpacked(path: Path, digest: str) -> Path:
    """Unpack an FMU beside the compiled kernels, whole or not at all; return the folder."""
    import fmpy

    folder = cache_folder() / f'fmu_{digest[:24]}'
    if not folder.is_dir():
        draft = folder.with_suffix(f'.{os.getpid()}')
        try:
            fmpy.extract(str(path), str(draft))
            draft.rename(folder)
        except Exception as problem:
            if not folder.is_dir():  # another process may have been first
                raise FmuError(f'{path}: it cannot be unpacked: {problem}') from None
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    return folder


def _variables(described) -> dict[str, Variable]:
    units = {unit.name: unit.baseUnit for unit in described.unitDefinitions}

    def number(said) -> float | None:
        try:
            return float(str(said).split()[0])
        except (ValueError, IndexError):
            return None

    found = {}
    for v in described.modelVariables:
        if v.type not in _FLOATS or v.dimensions:
            continue
        kind = v.declaredType
        unit = v.unit or (kind.unit if kind else None) or ''
        base = units.get(unit)
        factor = float(base.factor) if base is not None and not base.offset else float('nan')
        low, high = (getattr(v, side) or (getattr(kind, side) if kind else None)
                     for side in ('min', 'max'))
        found[v.name] = Variable(
            v.name, v.valueReference, v.causality or 'local', v.variability or 'continuous', unit,
            factor, number(v.start), number(low), number(high), v.description or '')
    return found
