"""Learners of friction on one interface, each imported when it is asked for."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .friction_learner import Learner

_WHERE = {
    'coulomb_viscous': 'classical_models', 'stribeck': 'classical_models',
    'dahl': 'classical_models', 'lugre': 'classical_models', 'sindy': 'sparse_regression',
    'feedforward': 'network_training', 'cnn': 'network_training', 'lstm': 'network_training',
    'transformer': 'network_training', 'physics_informed': 'physics_informed_training',
}


def names() -> list[str]:
    """Names of all learners, simplest first."""
    return list(_WHERE)


def lacking(name: str) -> str:
    """Return the library that a learner needs and that is not installed; '' where none is."""
    needed = {'sparse_regression': 'pysindy', 'network_training': 'torch',
              'physics_informed_training': 'torch'}.get(_WHERE[name])
    return needed if needed and find_spec(needed) is None else ''


def learner(name: str) -> Learner:
    """Return a learner; raises ValueError with the names there are, or with what it lacks."""
    if name not in _WHERE:
        raise ValueError(f'there is no learner {name!r}; there are {names()}')
    if missing := lacking(name):
        raise ValueError(f'learner {name!r} needs {missing}, which is not installed: run '
                         "`make training`, or `pip install 'servo_identify[learn]'`")
    return import_module(f'.{_WHERE[name]}', __package__).LEARNERS[name]
