"""
The servo file: one machine as YAML. The only place that knows how it is laid out.

A value is a bare number, a row of numbers, or a mapping ``{value, unit, source, std, bags}``; a
unit that is given must be the declared one, so that a file with other units is never misread.

`harmonic_drive: {model: NAME}` stands for the effects of a model of paper 004; values of its
effects may follow, by their names. It is a shorthand: what is written again are the effects.
"""

from __future__ import annotations

from dataclasses import replace
from keyword import iskeyword
from pathlib import Path
from reprlib import repr as brief

import yaml

from ..physics.catalogue import find, names
from ..physics.curve_ends import check_curves
from ..physics.element_names import split_name
from ..physics.harmonic_drive_models import harmonic_drive, HARMONIC_DRIVES
from ..physics.mechanisms.fmu import Fmu
from ..physics.servo import (
    CONTROLLERS,
    DRIVES,
    MECHANISMS,
    Placed,
    Provenance,
    SENSORS,
    Servo,
    ServoError,
    Value,
)
from ..physics.step_limit import check_step
from .given_values import left_out
from .nearest_name import or_what
from .strict_yaml import NotPlain, read_yaml
from .whole_file import write_whole

_SECTIONS = ('servo', 'travel', 'step', 'drive', 'mechanism', 'controller', 'observer', 'sensors',
             'harmonic_drive', 'effects', 'tolerance')
_TYPED = {'drive': DRIVES, 'mechanism': {**MECHANISMS, 'fmu': Fmu}, 'controller': CONTROLLERS}
MOST_TEXT = 1_000_000  # characters: some 3000 effects, read in half a minute
_DETAILS = ('value', 'unit', 'source', 'std', 'bags')


def load(path: str | Path) -> Servo:
    """
    Read a servo file. Raises ServoError, which names file, thing, value, limit and choice.

    It also raises where a value is missing that results hang on; of what else is left out,
    `given_values.defaults(servo)` lists the default that was taken.
    """
    try:
        with Path(path).open() as file:
            text = file.read(MOST_TEXT + 1)
    except (OSError, UnicodeDecodeError) as problem:
        raise ServoError(f'{path}: cannot be read: {problem}') from None
    return loads(text, str(path), Path(path).parent)


def loads(text: str, origin: str = 'servo file', folder: str | Path = '.',
          code: bool = True) -> Servo:
    """
    Read a servo from YAML text; raises ServoError.

    ``origin`` is named in errors; files that the text names are looked for in ``folder``. Without
    ``code`` a text that names an FMU is refused: nothing but an FMU brings code of its own.
    """
    if len(text) > MOST_TEXT:
        raise ServoError(f'{origin}: it is too long; a servo file has at most {MOST_TEXT} '
                         'characters')
    try:
        return _servo(_mapping(read_yaml(text), 'the file'), Path(folder), code)
    except NotPlain as problem:
        raise ServoError(f'{origin}: {problem}') from None
    except yaml.YAMLError as problem:
        raise ServoError(f'{origin}: not YAML: {problem}') from None
    except ServoError as problem:
        raise ServoError(f'{origin}: {problem}') from None


def dumps(servo: Servo) -> str:
    """Write a servo as YAML text that :func:`loads` reads back to an equal servo."""
    units = {path: servo.unit(path) for path, _ in servo.declarations()}

    def values(owner: str, parameters, indent: str) -> list[str]:
        return [f'{indent}{n}: {_value(servo, f"{owner}.{n}", units)}' for n in parameters]

    lines = [f'servo: {_inline(servo.name)}']
    if servo.linear:
        lines.append(f'travel: linear              # {of_linear(servo)}')
    lines.append(f'step: {servo.step!r}                # s')
    for section, registry in _TYPED.items():
        part = getattr(servo, section)
        kind = next(k for k, v in registry.items() if issubclass(part, v))
        lines += ['', f'{section}:', f'  type: {kind}', *_of_fmu(part),
                  *values(section, part.parameters, '  ')]
    lines += ['', 'observer:', f'  bandwidth: {_value(servo, "observer.bandwidth", units)}']
    lines += ['', 'sensors:' if servo.sensors else 'sensors: {}']
    for sensor in servo.sensors:
        lines.append(f'  {sensor.name}:')
        lines += values(f'sensors.{sensor.name}', sensor.parameters, '    ')
    lines += ['', 'effects:' if servo.effects else 'effects: {}']
    for placed in servo.effects:
        lines += [f'  {placed.name}:', f'    effect: {placed.effect.name}',
                  f'    at: {placed.site}']
        lines += values(f'effects.{placed.name}', placed.effect.parameters, '    ')
    lines += ['', 'tolerance:' if servo.tolerance else 'tolerance: {}']
    for path, (low, high) in servo.tolerance.items():
        lines.append(f'  {path}: [{low!r}, {high!r}]')
    return '\n'.join(lines) + '\n'


def of_linear(servo: Servo) -> str:
    """Say what the units of a linear axis are."""
    return ('the load is in m, N and kg, the motor turns' if servo.turning else
            'a linear motor: all is in m, N and kg')


def _of_fmu(part: type) -> list[str]:
    """Return the lines that say which FMU a mechanism is and what of it is what."""
    if not issubclass(part, Fmu):
        return []
    from ..fmu.fmu_variables import described
    return [f'  {key}: {_inline(said)}' for key, said in described(part).items()]


def save(servo: Servo, path: str | Path) -> None:
    """Write a servo file, whole or not at all."""
    write_whole(path, dumps(servo))


def _inline(thing) -> str:
    text = yaml.safe_dump(thing, default_flow_style=True, width=10**6, sort_keys=False)
    return text.strip().removesuffix('...').strip()


def _value(servo: Servo, path: str, units: dict[str, str]) -> str:
    value = servo.values[path]
    detail = {'value': list(value) if isinstance(value, tuple) else value}
    if units[path]:
        detail['unit'] = units[path]
    said = servo.provenance.get(path, Provenance())
    if said.source:
        detail['source'] = said.source
    if said.std is not None:
        detail['std'] = float(said.std)
    if said.bags:
        detail['bags'] = list(said.bags)
    return _inline(detail)


def _mapping(thing, where: str) -> dict:
    if thing is None:
        return {}
    if not isinstance(thing, dict):
        raise ServoError(f'{where} must be a mapping of names to values, not {brief(thing)}')
    return thing


def _choice(given, choices, where: str):
    if isinstance(given, int | float) and not isinstance(given, bool):
        raise ServoError(f'{where}: {given} stands where a name is due; a comma parts values: '
                         'write a decimal point, as in 2.5')
    if not isinstance(given, str) or given not in choices:
        raise ServoError(f'{where}: there is no {given!r}; {or_what(given, choices)}')
    return given


def _servo(tree: dict, folder: Path, code: bool) -> Servo:  # noqa: C901  (one section each)
    for section in tree:
        _choice(section, _SECTIONS, 'section')
    for needed in ('servo', 'drive', 'mechanism'):
        if needed not in tree:
            raise ServoError(f'section {needed!r} is missing')
    values: dict[str, Value] = {}
    details: dict[str, dict] = {}

    def take(owner: str, section: dict, parameters) -> None:
        for name, given in section.items():
            if name not in parameters:
                raise ServoError(f'{owner} has no parameter {name!r}; '
                                 f'{or_what(name, parameters, "it has")}')
            path = f'{owner}.{name}'
            if isinstance(given, dict):
                for key in given:
                    _choice(key, _DETAILS, path)
                if 'value' not in given:
                    raise ServoError(f'{path}: the value is missing; it may have {_DETAILS}')
                details[path] = given
                given = given['value']
            if isinstance(given, bool) or given is None:
                raise ServoError(f'{path} = {given!r} is not a number')
            values[path] = given

    chosen = {}
    for section, registry in _TYPED.items():
        body = dict(_mapping(tree.get(section), section))
        kind = body.pop('type', 'none' if section == 'controller' else None)
        chosen[section] = registry[_choice(kind, registry, f'{section}.type')]
        if chosen[section] is Fmu:
            if not code:
                raise ServoError('mechanism.type = fmu: the code of an FMU is run only where a '
                                 'servo file is named; give it by --servo')
            from ..fmu.fmu_variables import mechanism_of
            chosen[section] = mechanism_of(body, folder)
        take(section, body, chosen[section].parameters)
    take('observer', _mapping(tree.get('observer'), 'observer'), ('bandwidth',))
    sensors = []
    for name, body in _mapping(tree.get('sensors'), 'sensors').items():
        sensors.append(SENSORS[_choice(name, SENSORS, 'sensors')])
        take(f'sensors.{name}', _mapping(body, f'sensors.{name}'), sensors[-1].parameters)
    effects, typical = [], {}
    gear = _mapping(tree.get('harmonic_drive'), 'harmonic_drive')
    if gear:
        model = harmonic_drive(_choice(gear.get('model'), HARMONIC_DRIVES, 'harmonic_drive.model'))
        members = {member.name: member for member in model.members}
        for name, body in gear.items():
            if name != 'model':
                member = members[_choice(name, members, f'harmonic_drive of {model.name}')]
                take(f'effects.{name}', _mapping(body, f'harmonic_drive.{name}'),
                     member.placed.effect.parameters)
        for member in model.members:
            effects.append(member.placed)
            typical |= member.placed.paths(member.values)
    for name, body in _mapping(tree.get('effects'), 'effects').items():
        if not str(name).isidentifier() or iskeyword(str(name)):
            raise ServoError(f'effects: {name!r} is not a name (letters, digits, underscore)')
        body = dict(_mapping(body, f'effects.{name}'))
        effect = find(_choice(body.pop('effect', name), names(), f'effects.{name}.effect'))
        site = body.pop('at', effect.sites[0] if len(effect.sites) == 1 else None)
        _choice(site, effect.sites, f'effects.{name}.at')
        effects.append(Placed(name, effect, site))
        take(f'effects.{name}', body, effect.parameters)

    travel = _choice(tree.get('travel', 'rotary'), ('rotary', 'linear'), 'travel')
    servo = Servo(str(tree['servo']), chosen['drive'], chosen['mechanism'], chosen['controller'],
                  tuple(sensors), tuple(effects), typical | values,
                  step=_number(tree.get('step', 1e-4)), linear=travel == 'linear')
    servo = _of_units(servo, {path: detail['unit'] for path, detail in details.items()
                              if detail.get('unit') is not None})
    servo = replace(servo, provenance=_provenance(details),
                    tolerance=_tolerance(servo, _mapping(tree.get('tolerance'), 'tolerance')))
    check_curves(servo)
    check_step(servo)
    taken = left_out(servo, values, typical) | ({} if 'step' in tree else {'step': servo.step})
    return replace(servo, left_out=taken)


def _number(given) -> float:
    try:
        return float(given)
    except (TypeError, ValueError):
        raise ServoError(f'step = {given!r} is not a number of seconds') from None


def _of_units(servo: Servo, given: dict[str, object]) -> Servo:
    """
    Judge all units that a file gives.

    The motor of a linear axis turns or not as the unit of its ratio says, or else as most of the
    units do: files of before had the motor of each linear axis in m, N and kg.
    """
    def wrong(one: Servo) -> dict[str, str]:
        return {path: one.unit(path) for path, unit in given.items()
                if unit not in _units(one, path)}

    if servo.linear:
        ways = (servo, replace(servo, turning=not servo.turning))
        servo = min(ways, key=lambda one: ('mechanism.ratio' in wrong(one), len(wrong(one))))
    problems = [f'{path}: the unit is {given[path]!r}, it must be {right!r}'
                for path, right in wrong(servo).items()]
    if problems:
        hint = ('. Where the motor of a linear axis turns, the ratio is in rad/m and the motor in '
                'rad, N m and kg m2; a linear motor has a ratio of 1 without unit'
                if servo.linear else '')
        raise ServoError('; '.join(problems) + hint)
    return servo


def _units(servo: Servo, path: str) -> tuple[str, ...]:
    """Return the units that a value may have: its own, and what files of before say for it."""
    right = servo.unit(path)
    before = {'1/rad': '1/m'} | ({'rad/s': 'm/s'} if path.startswith('observer.') else {})
    return (right, before.get(right, right)) if servo.linear else (right,)


def _provenance(details: dict[str, dict]) -> dict[str, Provenance]:
    provenance = {}
    for path, detail in details.items():
        std, bags = detail.get('std'), detail.get('bags', [])
        if not (std is None or isinstance(std, (int, float)) and std >= 0.0):
            raise ServoError(f'{path}: std = {std!r} is not a number of zero or more')
        if not isinstance(bags, list):
            raise ServoError(f'{path}: bags = {bags!r} is not a list of names')
        said = Provenance(str(detail.get('source', '')), None if std is None else float(std),
                          tuple(str(b) for b in bags))
        if said != Provenance():
            provenance[path] = said
    return provenance


def _tolerance(servo: Servo, given: dict) -> dict[str, tuple[float, float]]:
    """
    Turn `10 %` or `[low, high]` into bounds.

    Of a row a share is that of each of its numbers; `path[i]` is one of them. A number that is
    zero has no share.
    """
    bounds = {}
    for name, much in given.items():
        path, index = split_name(str(name))
        if path not in servo.values:
            raise ServoError(f'tolerance: there is no parameter {path!r}; '
                             f'{or_what(path, servo.values)}')
        row, share = servo.values[path], isinstance(much, str) and much.strip().endswith('%')
        several = [name]
        if isinstance(row, tuple) and index is None:
            if not share:
                raise ServoError(f'tolerance of {path} = {much!r}: it is a row of {len(row)} '
                                 'values, which have a range each; give a share like 10 %, or '
                                 f'{path}[0]: [low, high]')
            several = [f'{path}[{i}]' for i, value in enumerate(row) if value]
        for one in several:
            if one in bounds:
                raise ServoError(f'tolerance of {one} is given twice: of the row and of its own')
            bounds[one] = _bounds(one, servo.number(one), much, share)
    return bounds


def _bounds(name: str, value: float, much: object, share: bool) -> tuple[float, float]:
    """Return between what a value lies that may be off by so much."""
    try:
        if share:
            width = abs(value) * float(much.strip()[:-1]) / 100.0
            low, high = value - width, value + width
        else:
            low, high = (float(edge) for edge in much)
    except (TypeError, ValueError):
        raise ServoError(f'tolerance of {name} = {much!r} is neither a share like 10 % nor '
                         f'[low, high]') from None
    if not low <= value <= high:
        raise ServoError(f'tolerance of {name}: [{low:g}, {high:g}] does not hold its value '
                         f'{value:g}')
    return low, high
