"""How parameters and effects are declared: once, with unit, bounds and meaning."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
import re
from types import MappingProxyType
from typing import Any, ClassVar


@dataclass(frozen=True)
class Parameter:
    """
    One declared number (or row of numbers) of an effect, a drive, a mechanism or a controller.

    ``off`` is the value at which what the parameter stands for vanishes; a parameter that has one
    is an amplitude, one without is a shape (a width, an order, a time constant). ``grid`` holds
    the values of a shape that are worth trying when it is unknown. A ``row`` parameter holds as
    many numbers as its servo file gives it; ``default`` is then a tuple. ``required`` says that
    results hang on the value, so that a servo file must give it: that of another machine misleads.
    ``told`` says that a default that was taken is worth telling; what is so by nature is not.
    """

    default: float | tuple[float, ...]
    unit: str
    bounds: tuple[float, float]
    meaning: str
    off: float | None = None
    grid: tuple[float, ...] = ()
    required: bool = False
    told: bool = True
    name: str = field(default='', compare=False)

    def __set_name__(self, owner: type, name: str) -> None:
        object.__setattr__(self, 'name', name)

    @property
    def row(self) -> bool:
        """Whether the parameter is a row of numbers."""
        return isinstance(self.default, tuple)

    def refuse(self, value: float) -> str | None:
        """Say what is wrong with a single value, or return None."""
        low, high = self.bounds
        if not low <= value <= high:  # also true for NaN
            return f'{value:g} {self.unit}'.rstrip() + f' is outside [{low:g}, {high:g}]'
        return None


def snake(name: str) -> str:
    """Turn a class name into the name that servo files use."""
    return re.sub(r'(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])', '_', name).lower()


class Declared:
    """Anything with declared parameters; a subclass that declares some is final."""

    name: ClassVar[str] = ''
    parameters: ClassVar[Mapping[str, Parameter]] = MappingProxyType({})

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        for parent in cls.__mro__[1:]:
            if parent.__dict__.get('parameters'):
                raise TypeError(f'{parent.__name__} is final: write a sibling of it instead')
        own = {k: v for k, v in cls.__dict__.items() if isinstance(v, Parameter)}
        cls.name = snake(cls.__name__)
        cls.parameters = MappingProxyType(own)


class Effect(Declared):
    """
    Something that an ideal servo does not do.

    A subclass of one of the ports of :mod:`.ports`, in a file of its own. It declares parameters,
    ``memory`` (how many numbers it remembers from step to step), ``source``, and the static
    ``law(p, s, motion, h)``. Of these ``p`` holds its parameters by name; ``s`` is its memory, an
    array of shape (memory,), zero at the start, updated in place; ``motion`` is what its port
    shows it; ``h`` is the time since the law was last asked, s. The law is compiled by numba:
    scalars and math only. ``candidate`` says whether a diagnosis may propose it: not a learned
    one, nor plain rounding.
    """

    source: ClassVar[str] = ''
    memory: ClassVar[int] = 0
    candidate: ClassVar[bool] = True
    sites: ClassVar[tuple[str, ...]] = ()
    port: ClassVar[str] = ''
    combine: ClassVar[str]
    motion: ClassVar[Any]
    law: ClassVar[Callable[..., float]]

    @classmethod
    def amplitudes(cls) -> tuple[str, ...]:
        """Names of the parameters with a value at which they vanish."""
        return tuple(n for n, p in cls.parameters.items() if p.off is not None)

    @classmethod
    def hangs(cls, p: Any) -> tuple[float, float] | None:
        """Return an inertia (kg m2) that it hangs on the load and its spring (N m/rad), if any."""
        return None

    @classmethod
    def variables(cls) -> frozenset[str]:
        """Names of what its law reads of the motion that its port shows it."""
        return frozenset(cls.law.__code__.co_names).intersection(cls.motion._fields)

    @classmethod
    def shapes(cls) -> tuple[str, ...]:
        """Names of the parameters that have no value at which they vanish."""
        return tuple(n for n, p in cls.parameters.items() if p.off is None)
