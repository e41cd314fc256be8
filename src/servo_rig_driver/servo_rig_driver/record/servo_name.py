"""Finds a servo file as servo_twin.description.shipped does, and the name that it gives."""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
import yaml

from ..home_path import at_home


def servo_file(name_or_path: str | Path) -> Path:
    """
    Return the servo file at a path, or the shipped one of that name.

    A bare word is a name; with a folder or an ending it is a path. Raises ValueError for a name
    that is not shipped, a path that does not exist and ~ of nobody. The rig's side
    imports nothing of the twin, so the rule stands here once more; a test holds both to each
    other.
    """
    path = at_home(name_or_path)
    named = not path.suffix and len(path.parts) == 1 and not path.is_file()
    try:
        folder = Path(get_package_share_directory('servo_twin')) / 'config' / 'servos'
    except PackageNotFoundError:
        if named:
            raise ValueError(f'servo file {path.name!r}: servo_twin, which ships servo files, is '
                             'not installed; give a path') from None
        folder = Path()
    found = folder / f'{path.name}.yaml' if named else path
    if not found.is_file():
        known = sorted(file.stem for file in folder.glob('*.yaml'))
        raise ValueError(f'{path}: cannot be read: no such file; give the path of one, or the '
                         f'name of a shipped one: {known}')
    return found


def servo_text(name_or_path: str) -> tuple[str, str]:
    """
    Return the path of a servo file and what stands in it; both are empty where none is named.

    Raises ValueError, as servo_file() does, also for a file that holds no text.
    """
    if not name_or_path:
        return '', ''
    path = servo_file(name_or_path)
    try:
        return str(path), path.read_text('utf8')
    except UnicodeDecodeError as error:
        raise ValueError(f'servo_file {path} is no text in UTF-8: {error.reason} at byte '
                         f'{error.start}') from None
    except OSError as error:
        raise ValueError(f'servo_file {path} cannot be read: {error.strerror}') from None


def servo_name(path: str, content: str) -> str:
    """Return the name that a servo file gives, or else the file's own."""
    try:
        fields = yaml.safe_load(content) if content else {}
    except yaml.YAMLError as error:
        raise ValueError(f'servo_file {path} is no YAML: {error}') from None
    named = fields.get('servo') if isinstance(fields, dict) else None
    return named if isinstance(named, str) else Path(path).stem
