"""The user's servo file with what was found in it: comments kept, nothing else moved."""

from __future__ import annotations

from difflib import unified_diff
from io import StringIO

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from servo_twin.description import servo_file
from servo_twin.physics.element_names import split_name
from servo_twin.physics.servo import Placed, Servo, ServoError, Value

DIGITS = 6  # of a value that was found


def patched(text: str, given: Servo, found: Servo) -> str:
    """
    Return the text of a servo file with what ``found`` has and ``given`` has not.

    Writes the whole file where the text is laid out in a way that a patch cannot
    follow (harmonic_drive as a shorthand).
    """
    yaml = YAML()
    yaml.preserve_quotes, yaml.width = True, 10**6
    tree = yaml.load(text)
    known = {placed.name for placed in given.effects}
    for path, value in found.values.items():
        owner = path.split('.')
        if owner[0] == 'effects' and owner[1] not in known:
            continue
        if path not in given.values or given.values[path] != value:
            _put(tree, owner, _entry(found, path))
    if found.mechanism is not given.mechanism:
        tree['mechanism']['type'] = found.mechanism.name
    if found.step != given.step:
        tree['step'] = found.step
    for placed in found.effects:
        if placed.name not in known:
            _add(tree, placed, found)
    gone = [path for path in given.tolerance if path not in found.tolerance]
    for path in gone:
        for name in (path, split_name(path)[0]):  # one of a row may stand by the row
            if name in (tree.get('tolerance') or {}):
                del tree['tolerance'][name]
    stream = StringIO()
    yaml.dump(tree, stream)
    new = stream.getvalue()
    try:
        same = servo_file.loads(new)
    except ServoError:
        return servo_file.dumps(found)
    return new if set(same.values) == set(found.values) else servo_file.dumps(found)


def difference(before: str, after: str) -> str:
    """Return what a patched file has more, as a unified diff."""
    return ''.join(unified_diff(before.splitlines(True), after.splitlines(True), 'given.yaml',
                                'augmented.yaml', n=2))


def _entry(servo: Servo, path: str) -> CommentedMap:
    value, unit = servo.values[path], servo.unit(path)
    said = servo.provenance.get(path)
    entry = CommentedMap()
    entry.fa.set_flow_style()
    entry['value'] = _rounded(value)
    if unit:
        entry['unit'] = unit
    if said is not None and said.source:
        entry['source'] = said.source
    if said is not None and said.std is not None:
        entry['std'] = float(f'{said.std:.2g}')
    return entry


def _rounded(value: Value) -> CommentedSeq | float:
    if isinstance(value, tuple):
        row = CommentedSeq([float(f'{v:.{DIGITS}g}') for v in value])
        row.fa.set_flow_style()
        return row
    return float(f'{value:.{DIGITS}g}')


def _put(tree: CommentedMap, owner: list[str], entry: CommentedMap) -> None:
    """Put a value at a path, where the file has it as a bare number or as a mapping."""
    at = tree
    for key in owner[:-1]:
        if at.get(key) is None:
            at[key] = CommentedMap()
        at = at[key]
    at[owner[-1]] = entry


def _add(tree: CommentedMap, placed: Placed, servo: Servo) -> None:
    if not tree.get('effects'):
        tree['effects'] = CommentedMap()
    one = CommentedMap()
    one.fa.set_flow_style()
    one['effect'], one['at'] = placed.effect.name, placed.site
    for name in placed.effect.parameters:
        one[name] = _entry(servo, f'effects.{placed.name}.{name}')
    tree['effects'][placed.name] = one
