"""What recordings leave under a small catalogue, before anything is accepted."""

from dataclasses import replace

import numpy as np
from synthetic import PERIOD, sampled

from servo_identify.gap.balance import Balance
from servo_identify.gap.candidates import candidates_of, extend
from servo_identify.gap.library import build_library
from servo_identify.gap.observation import observe
from servo_identify.gap.screening import Screening
from servo_identify.gap.selection import Selection
from servo_identify.gap.shape_values import shape_values
from servo_identify.gap.stack import Stack
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.physics.catalogue import find, names
from servo_twin.physics.servo import Placed

BENCH = servo_file.load(servo_at('rv_bench'))
TIME = np.arange(int(8.0 / PERIOD)) * PERIOD
CHANNELS = ('motor_position', 'load_position', 'torque', 'current')


def with_effects(*effects):
    """Return the bench with further effects (name, site, values)."""
    placed = [Placed(f'e{i}', find(name), site) for i, (name, site, _) in enumerate(effects)]
    return BENCH.with_effects(*placed, values={
        f'effects.e{i}.{key}': value for i, (*_, values) in enumerate(effects)
        for key, value in values.items()})


def swinging(rig, seed, family='multisine', size=1.6):
    """Return a recording that stays within a part of a turn."""
    command = sum(size * np.sin(2.0 * np.pi * f * TIME + seed + 3.0 * f) for f in (0.35, 0.8, 2.1))
    return replace(sampled(rig, command, seed=seed), name=f'{family} {seed}', family=family)


def twice(rig, *known):
    """Return a screening of two recordings of a rig with a small catalogue."""
    return screened([swinging(rig, 1), swinging(rig, 2)], BENCH, *known)


def extended(servo, *known):
    """Return a servo with the candidates placed that a catalogue of a few effects has."""
    return extend(servo, ('motor', 'load'), CHANNELS, tuple(n for n in names() if n not in known))


def stacked(recordings, extended):
    """Return the balances of some recordings with an extended servo."""
    return Stack([Balance(extended.servo, seen, extended.given, extended.theta)
                  for seen in observe(recordings, extended.servo)], extended)


def screened(recordings, servo, *known):
    """Return a screening of some recordings with a catalogue of a few effects."""
    stack = stacked(recordings, extended(servo, *known))
    candidates = candidates_of(stack.extended, shape_values(stack, stack.base))
    return Screening(stack, build_library(stack, candidates, lambda share: None))


def chosen_of(screening):
    """Return the numbers of the causes that a screening asks for."""
    return Selection(screening).select(lambda share: None)


def names_of(screening, chosen):
    """Return the names of some candidates."""
    return [screening.library.candidates[c].name for c in chosen]
