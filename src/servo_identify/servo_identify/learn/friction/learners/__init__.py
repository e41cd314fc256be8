"""Learners of friction on one interface, each imported when it is asked for."""

from __future__ import annotations

from importlib import import_module

from .learner import Learner

_WHERE = {
    'coulomb_viscous': 'classical_models', 'stribeck': 'classical_models',
    'dahl': 'classical_models', 'lugre': 'classical_models', 'sindy': 'sparse_regression',
    'feedforward': 'network_training', 'cnn': 'network_training', 'lstm': 'network_training',
    'transformer': 'network_training', 'physics_informed': 'physics_informed_training',
}


def names() -> list[str]:
    """Names of all learners, simplest first."""
    return list(_WHERE)


def learner(name: str) -> Learner:
    """Return a learner; raises ValueError with the names there are."""
    if name not in _WHERE:
        raise ValueError(f'there is no learner {name!r}; there are {names()}')
    return import_module(f'.{_WHERE[name]}', __package__).LEARNERS[name]
