"""
The names of the front door, each loaded when it is first asked for.

`fit` and `diagnose` are packages as well as functions: `si.fit(data, servo)` calls
:func:`.calls.fit`, and `servo_identify.fit.estimate` stays the module that it is.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any

NAMES = {
    'load_servo': '.calls', 'read': '.calls', 'check': '.calls', 'fit': '.calls',
    'diagnose': '.calls', 'ServoFile': '.servo_text', 'Recordings': '.recordings',
    'Checked': '.answers', 'Fitted': '.answers', 'Answer': '.answers',
}
"""What the front door offers, and the module of this package that has it."""

_ALSO_PACKAGES = ('fit', 'diagnose')


class FrontDoor(ModuleType):
    """The package `servo_identify`, whose names are loaded when they are asked for."""

    def __getattr__(self, name: str) -> Any:
        if name == '__version__':
            return _version()
        if name in _ALSO_PACKAGES:
            return import_module(f'{self.__name__}.{name}')
        if name in NAMES:
            return getattr(import_module(NAMES[name], __package__), name)
        raise AttributeError(f'{self.__name__} has no {name!r}; it has {list(NAMES)}')

    def __setattr__(self, name: str, value: Any) -> None:
        # The import system comes by here with each package below this one.
        if name in _ALSO_PACKAGES and type(value) is ModuleType:
            value.__class__ = CallablePackage
        super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *NAMES, '__version__'})


class CallablePackage(ModuleType):
    """A package that is also the function of the same name in :mod:`.calls`."""

    def __call__(self, *args: Any, **more: Any) -> Any:
        """Call the function of the front door; see :mod:`.calls`."""
        return self._function(*args, **more)

    @property
    def __doc__(self) -> str:  # type: ignore[override]
        """Signature and docstring of the function, for `help` and the `?` of a notebook."""
        from inspect import getdoc, signature

        function = self._function
        return f'{function.__name__}{signature(function)}\n\n{getdoc(function)}'

    @property
    def __wrapped__(self) -> Any:
        """The function that a call reaches; `help` and `inspect.signature` look here."""
        return self._function

    @property
    def _function(self) -> Any:
        calls = import_module('.calls', __package__)
        return getattr(calls, self.__name__.rpartition('.')[2])


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version('servo_identify')
    except PackageNotFoundError:
        return '0+not.installed'
