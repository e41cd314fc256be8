"""
Rules of import that the layers of import-linter cannot state, read from the syntax of src/ alone.

Those are: imports by a name in a string, the standard library that physics may use, late imports
of torch, and who touches messages. Layers and circles stand in pyproject.toml.
"""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
import sys

PACKAGES = ('servo_rig_driver', 'servo_twin', 'servo_identify', 'servo_studies')
FORBIDDEN = {
    'servo_rig_driver': {'servo_twin', 'servo_identify', 'servo_studies'},
    'servo_twin': {'servo_rig_driver', 'servo_identify', 'servo_studies'},
    'servo_identify': {'servo_rig_driver', 'servo_studies'},
    'servo_studies': {'servo_rig_driver'},
}
PHYSICS_LIBRARIES = {'math', 'numpy', 'numba', 'servo_twin.physics'}
# Of the standard library, physics has no use for clocks, chance, processes and file formats.
BARRED_FROM_PHYSICS = {
    'asyncio', 'calendar', 'configparser', 'csv', 'datetime', 'http', 'json', 'logging',
    'multiprocessing', 'pickle', 'plistlib', 'random', 'sched', 'select', 'shelve', 'signal',
    'socket', 'sqlite3', 'struct', 'subprocess', 'time', 'timeit', 'tomllib', 'urllib', 'xml',
    'zipfile', 'zoneinfo'}


@dataclass(frozen=True)
class Import:
    """One import: where it stands, what it names, whether it is late, or by a string."""

    module: str
    line: int
    name: str
    lazy: bool
    by_string: bool

    def __str__(self) -> str:
        return f'{self.module}:{self.line} imports {self.name}'

    def is_of(self, package: str) -> bool:
        """Return whether package, or something in it, is what is imported."""
        return self.name == package or self.name.startswith(package + '.')


def modules(src: Path) -> Iterator[tuple[str, Path]]:
    """Yield the dotted name and the path of every module of the packages in src."""
    for package in PACKAGES:
        for path in sorted((src / package / package).rglob('*.py')):
            parts = path.relative_to(src / package).with_suffix('').parts
            yield '.'.join(parts), path


def imports_of(module: str, path: Path) -> Iterator[Import]:
    """Yield every import of a module: statements, and calls of import_module and __import__."""
    package = module.split('.')[:-1]
    pending = [(node, False) for node in ast.parse(path.read_text()).body]
    while pending:
        node, lazy = pending.pop()
        for name in _named_by(node, package):
            yield Import(module, node.lineno, name, lazy, isinstance(node, ast.Call))
        inside = lazy or isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        pending += [(child, inside) for child in ast.iter_child_nodes(node)]


def _named_by(node: ast.AST, package: list[str]) -> list[str]:
    match node:
        case ast.Import(names):
            return [alias.name for alias in names]
        case ast.ImportFrom(stem, names, level):
            above = package[:len(package) - level + 1] if level else []
            base = '.'.join([*above, *([stem] if stem else [])])
            # `from package import module` names a module as well as the package.
            return [f'{base}.{alias.name}' for alias in names]
        case ast.Call(ast.Name(function) | ast.Attribute(attr=function),
                      [ast.Constant(str(name)), *_]):
            return [name] if function in ('import_module', '__import__') else []
    return []


def violations(src: Path) -> list[str]:
    """Return every broken rule of the packages in src, each as one sentence."""
    found = []
    for module, path in modules(src):
        imports = list(imports_of(module, path))
        package = module.split('.')[0]
        in_physics = module.startswith('servo_twin.physics')
        is_node = any(entry.is_of('rclpy') for entry in imports)
        for entry in imports:
            found += [f'{entry}, and {package} must not know {other}'
                      for other in FORBIDDEN[package] if entry.by_string and entry.is_of(other)]
            if in_physics and not _suits_physics(entry):
                found.append(f'{entry}, and physics imports math, numpy, numba and itself')
            if entry.is_of('torch') and not (entry.lazy and 'train' in path.stem):
                found.append(f'{entry}, and only functions of training modules import torch')
            if entry.is_of('servo_twin_msgs') and not (is_node or _is_rim(module)):
                found.append(f'{entry}, and messages are for nodes, conversion and the bag')
    return sorted(found)


def _suits_physics(entry: Import) -> bool:
    if any(entry.is_of(library) for library in PHYSICS_LIBRARIES):
        return True
    root = entry.name.split('.')[0]
    return root in sys.stdlib_module_names and root not in BARRED_FROM_PHYSICS


def _is_rim(module: str) -> bool:
    return 'bag' in module.split('.')[:2] or module.endswith('.message_conversion')
