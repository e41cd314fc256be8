"""MuJoCo models, compiled by MuJoCo itself."""

from __future__ import annotations

from pathlib import Path
import re
from types import ModuleType
from typing import Any

from .joint import ModelError

_ROBOT = re.compile(rb'^\s*(?:<\?.*?\?>|<!--.*?-->|\s)*<robot\b', re.DOTALL)
"""How a URDF file begins."""


def mujoco_library() -> ModuleType:
    """Return the package mujoco; raises ModelError where it is not installed."""
    try:
        import mujoco
    except ImportError as problem:
        raise ModelError(f'this needs MuJoCo, and it cannot be imported ({problem}); install it: '
                         f'pip install mujoco') from None
    return mujoco


def compiled(path: Path | str) -> tuple[Any, list[str]]:
    """
    Return the model (MjModel) of an MJCF file, and what was left out to compile it.

    Defaults, includes, units and inferred masses are MuJoCo's own. Where files of meshes are
    missing, the shapes of bodies whose `inertial` is given are left out, since they change no
    mass. Raises ModelError.
    """
    mujoco = mujoco_library()
    if not Path(path).is_file():
        raise ModelError(f'{path}: there is no such file')
    if _ROBOT.search(Path(path).read_bytes()):  # MuJoCo would read it without its transmissions
        raise ModelError(f'{path}: is a URDF file; servo-twin from-urdf reads it')
    try:
        return mujoco.MjModel.from_xml_path(str(path)), []
    except ValueError as problem:
        said = ' '.join(str(problem).split())
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError:
        raise ModelError(f'{path}: MuJoCo cannot read it: {said}') from None
    if 'opening file' not in said and 'resource' not in said.lower():
        raise ModelError(f'{path}: MuJoCo cannot compile it: {said}')
    lacking = _without_shapes(mujoco, spec)
    if lacking:
        raise ModelError(f'{path}: MuJoCo cannot compile it: {said}; the masses of '
                         f'{_listed(lacking)} follow from their meshes: put the files where the '
                         f'model looks for them, or give these bodies an <inertial>')
    try:
        return spec.compile(), [f'shapes, since files are missing ({said}); the masses are those '
                                f'of the <inertial> of each body']
    except ValueError as problem:
        raise ModelError(f'{path}: MuJoCo cannot compile it: {said}; without its shapes: '
                         f'{" ".join(str(problem).split())}') from None


def compiled_text(text: str, origin: str) -> Any:
    """Return the model of MJCF or URDF text; raises ModelError, which names the origin."""
    mujoco = mujoco_library()
    try:
        return mujoco.MjModel.from_xml_string(text)
    except ValueError as problem:
        said = ' '.join(str(problem).split())
        raise ModelError(f'{origin}: MuJoCo cannot compile it: {said}') from None


def _without_shapes(mujoco: ModuleType, spec: Any) -> list[str]:
    """Take off a model what needs files; return the bodies whose masses would change."""
    shaped = {mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF}
    lacking = []
    for body in spec.bodies:
        for geom in [one for one in body.geoms if one.type in shaped]:
            if not body.explicitinertial and body.name != 'world':
                lacking.append(body.name or f'a body without a name in {body.parent.name!r}')
            _delete(spec, geom)
        for geom in body.geoms:
            geom.material = ''
    for kind in ('sensors', 'pairs', 'skins', 'flexes', 'materials', 'textures', 'meshes',
                 'hfields'):
        for one in list(getattr(spec, kind)):
            _delete(spec, one)
    for site in spec.sites:
        site.material = ''
    for tendon in spec.tendons:
        tendon.material = ''
    return sorted(set(lacking))


def _delete(spec: Any, one: Any) -> None:
    """Take an element off a model; before MuJoCo 3.3 the element does it."""
    if hasattr(spec, 'delete'):
        spec.delete(one)
    else:
        one.delete()


def _listed(names: list[str]) -> str:
    return ', '.join(repr(name) for name in names[:5]) + (
        f' and {len(names) - 5} more' if len(names) > 5 else '')
