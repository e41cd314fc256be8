"""The effects there are: one file each in `effects/`, and in folders that users name."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
from pathlib import Path
import pkgutil
import sys
from types import ModuleType

from . import effects
from .effect import Effect

_FOREIGN: dict[str, type[Effect]] = {}


def names() -> list[str]:
    """Names of all effects, those of users included, sorted."""
    own = [module.name for module in pkgutil.iter_modules(effects.__path__)]
    return sorted({*own, *_FOREIGN})


def find(name: str) -> type[Effect]:
    """
    Return the effect of that name.

    Raises KeyError with the names there are.
    """
    if name in _FOREIGN:
        return _FOREIGN[name]
    if name not in names():
        raise KeyError(f'there is no effect {name!r}; there are {names()}')
    return _only_effect(importlib.import_module(f'{effects.__name__}.{name}'), name)


def register(folder: str | Path) -> list[str]:
    """
    Take in every effect file (``*.py``) of a user's folder and return their names.

    A file of the name of an effect that is there already is refused with ValueError, as is one
    that holds no effect of its file's name. Taking in the same folder twice is harmless.
    """
    folder = Path(folder).resolve()
    files = sorted(f for f in folder.glob('*.py') if not f.name.startswith('_'))
    if not files:
        raise ValueError(f'{folder}: there is no effect file (*.py) in it')
    taken = []
    for file in files:
        name = file.stem
        digest = hashlib.sha256(file.read_bytes()).hexdigest()[:12]
        module_name = f'servo_twin_effect_{name}_{digest}'
        known = _FOREIGN.get(name)
        if known is None and name in names():
            raise ValueError(f'{file}: an effect {name!r} is in the catalogue already')
        if known is None or known.__module__ != module_name:
            spec = importlib.util.spec_from_file_location(module_name, file)
            assert spec is not None and spec.loader is not None  # a .py file has both
            module = importlib.util.module_from_spec(spec)
            sys.modules[module_name] = module
            try:
                spec.loader.exec_module(module)
            except Exception as problem:
                del sys.modules[module_name]
                raise ValueError(f'{file}: {type(problem).__name__}: {problem}') from problem
            _FOREIGN[name] = _only_effect(module, name)
        taken.append(name)
    return taken


def registered() -> list[type[Effect]]:
    """Return the effects of users that were taken in, by name."""
    return [_FOREIGN[name] for name in sorted(_FOREIGN)]


def _only_effect(module: ModuleType, name: str) -> type[Effect]:
    for thing in vars(module).values():
        if isinstance(thing, type) and issubclass(thing, Effect) and thing.name == name:
            return thing
    raise ValueError(f'{module.__file__}: it must hold an effect class whose name is {name!r} '
                     f'in snake case')
