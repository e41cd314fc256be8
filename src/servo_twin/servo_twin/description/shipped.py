"""The configuration files that are installed with the twin."""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError

from ..physics.servo import ServoError


def shipped(name: str) -> Path:
    """Return a file below config/; raises ServoError where it is not installed."""
    try:
        path = Path(get_package_share_directory('servo_twin')) / 'config' / name
    except PackageNotFoundError:
        raise ServoError(f'config/{name} is not installed: source env.sh, or name a '
                         f'file') from None
    if not path.exists():
        known = sorted(file.stem for file in path.parent.glob('*.yaml'))
        raise ServoError(f'{path.stem!r} is neither a file nor shipped; shipped are {known}')
    return path


def servo_at(given: str) -> Path:
    """Return the servo file at a path, or the shipped one of that name (rv_bench, emps ...)."""
    path = Path(given)
    return path if path.suffix or path.exists() else shipped(f'servos/{given}.yaml')
