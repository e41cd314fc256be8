"""The configuration files that are installed with the twin."""

from __future__ import annotations

from pathlib import Path

from ..physics.servo import ServoError
from .home_path import at_home
from .nearest_name import or_what


def shipped(name: str) -> Path:
    """Return a file below config/; raises ServoError where it is not installed."""
    folder = _share()
    if folder is None:
        raise ServoError(f'config/{name} is not installed: source env.sh, or name a file')
    path = folder / 'config' / name
    if not path.exists():
        known = sorted(file.stem for file in path.parent.glob('*.yaml'))
        raise ServoError(f'{path.stem!r} is neither a file nor shipped; '
                         f'{or_what(path.stem, known, "shipped are")}')
    return path


def servo_file(name_or_path: str | Path) -> Path:
    """
    Return the servo file that a person names: its path, or the name of a shipped one.

    A bare word (rv_bench, emps ...) is the name of a shipped file; with a folder or an ending it
    is a path. Commands, nodes and services all ask here; the recorder, which knows no twin, finds
    the same file by the same rule (servo_rig_driver.record.servo_name). Raises ServoError for a
    name that is not shipped and for a path that does not exist.
    """
    try:
        path = at_home(name_or_path)
    except ValueError as error:
        raise ServoError(str(error)) from None
    if not path.suffix and len(path.parts) == 1 and not path.is_file():
        return shipped(f'servos/{path.name}.yaml')
    if not path.is_file():
        why = 'it is a folder' if path.is_dir() else 'no such file'
        raise ServoError(f'{path}: cannot be read: {why}; give the path of one, or the '
                         f'name of a shipped one: {shipped_servos()}')
    return path


servo_at = servo_file


def shipped_servos() -> list[str]:
    """Return the names of the shipped servo files."""
    return sorted(file.stem for file in shipped('servos/rv_bench.yaml').parent.glob('*.yaml'))


def _share() -> Path | None:
    """Return the share folder of the package: by ROS's index, else where pip put it, or None."""
    try:
        from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
    except ImportError:
        around = (folder / 'share' / 'servo_twin' for folder in Path(__file__).resolve().parents)
        return next((one for one in around if (one / 'config').is_dir()), None)
    try:
        return Path(get_package_share_directory('servo_twin'))
    except PackageNotFoundError:
        return None
