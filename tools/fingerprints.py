"""What each stage of the set-up depends on, as one hash a stage."""

import hashlib
import json
from pathlib import Path

STAMP = Path('.venv') / 'workspace.stamp'
# Files of a package that only a build brings into the installed workspace.
BUILT_FROM = ('setup.py', 'setup.cfg', 'package.xml', 'CMakeLists.txt')


def _digest(*parts: str | bytes) -> str:
    sha = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        sha.update(len(data).to_bytes(8, 'big') + data)
    return sha.hexdigest()


def environment_print(root: Path, python: str, version: str, sourced: str) -> str:
    """Return the hash of what a virtual environment is tied to: place, interpreter, ROS."""
    return _digest(str(root), python, version, sourced)


def packages_print(root: Path, environment: str) -> str:
    """Return the hash of the environment and of every requirements file."""
    files = sorted((root / 'requirements').glob('*.txt'))
    return _digest(environment, *(part for path in files
                                  for part in (path.name, path.read_bytes())))


def build_print(root: Path, packages: str) -> str:
    """Return the hash of the installed packages, of how to build and of the sources built."""
    parts: list[str | bytes] = [packages, (root / 'tools' / 'stages.py').read_bytes()]
    for path in sorted((root / 'src').rglob('*')):
        name = path.relative_to(root)
        if path.is_file() and (path.name in BUILT_FROM or 'servo_twin_msgs' in name.parts):
            parts += [str(name), path.read_bytes()]
    for folder in (root / 'config', *sorted((root / 'src').glob('*/launch'))):
        parts += [str(path.relative_to(root)) for path in sorted(folder.rglob('*'))
                  if path.is_file()]
    return _digest(*parts)


def read_stamp(root: Path) -> dict[str, str]:
    """Return the hash of each finished stage; empty where nothing is set up."""
    try:
        stamp = json.loads((root / STAMP).read_text())
    except (OSError, ValueError):
        return {}
    return stamp if isinstance(stamp, dict) else {}


def write_stamp(root: Path, stamp: dict[str, str]) -> None:
    """Store the hash of each finished stage, in one move."""
    new = root / STAMP.with_suffix('.new')
    new.write_text(json.dumps(stamp, indent=1))
    new.replace(root / STAMP)
