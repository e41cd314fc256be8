"""Which variables of an FMU stand for what: the section `mechanism` of a servo file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite, isnan
from pathlib import Path
from types import MappingProxyType

from ..physics.effect import Parameter
from ..physics.fmu_calls import GIVEN
from ..physics.mechanisms.fmu import Fmu, STANDARD
from .fmu_file import FmuError, opened, OpenedFmu, Variable

GIVES = {'motor_torque': 'N m', 'external_torque': 'N m'}
TAKES = dict(zip(GIVEN, ('rad', 'rad/s', 'rad', 'rad/s', 'N m'), strict=True))
STARTS = dict(zip(GIVEN[:4], ('rad', 'rad/s', 'rad', 'rad/s'), strict=True))
SECTIONS = {'inputs': GIVES, 'outputs': TAKES, 'start': STARTS}
KEYS = ('file', 'sha256', *SECTIONS, 'parameters')
"""What the section may say of the FMU; all else are values of parameters."""

_WIDEST = 1e300


@dataclass(frozen=True)
class Link:
    """A quantity of the servo and the variable for it: servo = factor x FMU."""

    name: str
    variable: Variable
    factor: float


class _Mapped(Fmu):
    """An FMU mechanism with its file; what is mapped stands in the class of each file."""

    fmu: OpenedFmu
    inputs: tuple[Link, ...]
    outputs: tuple[Link, ...]
    starts: tuple[Link, ...]
    set_by: Mapping[str, Variable]

    @classmethod
    def running(cls, run, servo):
        """Return what begins, steps and watches the FMU around the compiled run."""
        from .fmu_run import Running
        return Running(run, cls, servo)


def mechanism_of(section: dict, folder: Path) -> type[Fmu]:
    """
    Return the mechanism of a servo file's section, whose KEYS are taken out of it.

    ``folder`` is where a relative file is looked for. The same FMU mapped alike is the same
    class. Raises FmuError.
    """
    said = {key: section.pop(key) for key in KEYS if key in section}
    for needed in ('file', 'inputs', 'outputs'):
        if needed not in said:
            raise FmuError(f'mechanism of type fmu: {needed!r} is missing')
    given = str(said['file'])
    path = Path(given) if Path(given).is_absolute() else folder / given
    fmu = opened(path)
    wanted = str(said.get('sha256') or fmu.digest)
    if not fmu.digest.startswith(wanted.lower()):
        raise FmuError(f'{path}: it is another FMU than the servo file was made with: sha256 is '
                       f'{fmu.digest[:16]}..., not {wanted[:16]}...')
    rows = []
    for key, known in SECTIONS.items():
        links = _mapping(said.get(key), key)
        for name in links:
            if name not in known:
                raise FmuError(f'mechanism.{key}: there is no {name!r}; there are {list(known)}')
        rows.append(tuple((name, *_variable_and_factor(links[name], f'{key}.{name}'))
                          for name in known if name in links))
    parameters = tuple((str(name), str(variable)) for name, variable in
                       _mapping(said.get('parameters'), 'parameters').items())
    return _mechanism(fmu, *rows, parameters)


def described(mechanism: type[Fmu]) -> dict:
    """Return the KEYS of a servo file's section that make this mechanism again."""
    said = {'file': str(mechanism.fmu.path), 'sha256': mechanism.fmu.digest}
    for key, links in (('inputs', mechanism.inputs), ('outputs', mechanism.outputs),
                       ('start', mechanism.starts)):
        said[key] = {link.name: link.variable.name if link.factor == 1.0 else
                     {'variable': link.variable.name, 'factor': link.factor} for link in links}
    said['parameters'] = {n: v.name for n, v in mechanism.set_by.items()}
    return said


@lru_cache(maxsize=64)
def _mechanism(fmu: OpenedFmu, inputs, outputs, starts, parameters) -> type[Fmu]:
    names = [name for name, *_ in inputs], [name for name, *_ in outputs]
    if 'motor_torque' not in names[0]:
        raise FmuError(f'{fmu.path.name}: mechanism.inputs needs motor_torque')
    if not {'motor_angle', 'load_angle'} & set(names[1]):
        raise FmuError(f'{fmu.path.name}: mechanism.outputs needs motor_angle or load_angle')
    rows = {}
    for key, row in (('inputs', inputs), ('outputs', outputs), ('start', starts)):
        rows[key] = tuple(_link(fmu, key, name, variable, factor)
                          for name, variable, factor in row)
    declared, set_by = dict(STANDARD), {}
    for name, variable in parameters:
        where = f'mechanism.parameters.{name}'
        found = set_by[name] = fmu.variable(variable, where)
        if not name.isidentifier():
            raise FmuError(f'{where}: {name!r} is not a name (letters, digits, underscore)')
        if found.causality not in ('parameter', 'structuralParameter'):
            raise FmuError(f'{fmu.path.name}: {where}: {variable} is no parameter but of '
                           f'causality {found.causality}')
        declared[name] = _declared(name, found)
    anywhere = fmu.variable_step and {name for name, *_ in starts} == set(STARTS)
    body = {**declared, 'fmu': fmu, 'restartable': anywhere, 'inputs': rows['inputs'],
            'outputs': rows['outputs'], 'starts': rows['start'],
            'set_by': MappingProxyType(set_by), 'has_external': 'external_torque' in names[0],
            '__doc__': f'{fmu.path.name}: {fmu.identifier}, by {fmu.tool or "an unnamed tool"}.',
            '__module__': __name__}
    return type(fmu.identifier, (_Mapped,), body)


def _declared(name: str, variable: Variable) -> Parameter:
    """Return a parameter as the FMU declares it; ours, where the name is one of ours."""
    meaning = variable.description or f'{variable.name} of the FMU.'
    if name in STANDARD:
        ours = STANDARD[name]
        start = ours.default if variable.start is None else variable.start
        return Parameter(start, ours.unit, ours.bounds, ours.meaning)
    low = -_WIDEST if variable.low is None else variable.low
    high = _WIDEST if variable.high is None else variable.high
    return Parameter(variable.start or 0.0, variable.unit.replace('.', ' '), (low, high), meaning)


def _link(fmu: OpenedFmu, key: str, name: str, variable: str, factor: float | None) -> Link:
    where = f'mechanism.{key}.{name}'
    found = fmu.variable(variable, where)
    wanted = {'inputs': ('input',), 'outputs': ('output', 'local', 'calculatedParameter')}.get(key)
    if wanted and found.causality not in wanted:
        raise FmuError(f'{fmu.path.name}: {where}: {variable} is of causality {found.causality}, '
                       f'it must be {" or ".join(wanted)}')
    if factor is None:
        factor = 1.0
        unit = SECTIONS[key][name]
        if found.unit and not isnan(found.factor) and found.factor != 1.0:
            raise FmuError(f'{fmu.path.name}: {where}: {variable} is in {found.unit}, not in '
                           f'{unit}; map it as {{variable: {variable}, factor: '
                           f'{found.factor:.9g}}}')
    return Link(name, found, factor)


def _mapping(thing, where: str) -> dict:
    if thing is None:
        return {}
    if not isinstance(thing, dict):
        raise FmuError(f'mechanism.{where} must be a mapping of names to variables of the FMU, '
                       f'not {thing!r}')
    return thing


def _variable_and_factor(said, where: str) -> tuple[str, float | None]:
    """Read `variable` or `{variable, factor}`."""
    if not isinstance(said, dict):
        return str(said), None
    unknown = set(said) - {'variable', 'factor'}
    if unknown or 'variable' not in said:
        raise FmuError(f'mechanism.{where}: it takes the name of a variable, or '
                       f'{{variable, factor}}, not {said!r}')
    try:
        factor = float(said.get('factor', 1.0))
    except (TypeError, ValueError):
        factor = 0.0
    if factor == 0.0 or not isfinite(factor):
        raise FmuError(f'mechanism.{where}: factor = {said["factor"]!r} is not a number other '
                       f'than 0')
    return str(said['variable']), factor
