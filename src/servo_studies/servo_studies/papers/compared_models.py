"""
The models that are compared: from the data sheet to the hybrid, and the black box.

All are servo files run by the same compiled step, all learned from the same training recordings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from servo_identify.learn.current_loop import CurrentLoop, learned_current_loop, with_current_loop
from servo_identify.learn.free_run import refined
from servo_identify.learn.friction.presliding import (
    learned_presliding,
    Presliding,
    with_presliding,
)
from servo_identify.learn.friction.servo_friction import (
    learned_friction,
    LearnedFriction,
    with_friction,
)
from servo_identify.learn.networks.residual_network import (
    learned_residual,
    LearnedResidual,
    with_residual,
)
from servo_identify.learn.transmission.backlash_map import (
    learned_backlash,
    LearnedBacklash,
    with_backlash,
)
from servo_identify.learn.transmission.transmission_harmonics import (
    learned_error,
    LearnedError,
    with_error,
)
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed, Servo
from servo_twin.recording.recording import Recording

from .bench_recordings import SERVO

FRICTION = ('effects.coulomb.level', 'effects.viscous.slope', 'effects.stribeck.excess',
            'effects.stribeck.fade')
INERT = ('mechanism.load_inertia', 'mechanism.rotor_inertia', 'drive.torque_constant')
MOTOR_CELLS = 36  # of the motor's turn, which is sampled 16 times at the highest speed
FADE = {'effects.stribeck.fade': (1e-3, 1.0)}  # rad/s


@dataclass(frozen=True)
class Models:
    """The servos by name, in the order of the table, and what was learned on the way."""

    servos: dict[str, Servo]
    ladder: dict[str, Servo]
    friction: LearnedFriction
    backlash: LearnedBacklash
    error: LearnedError
    loop: CurrentLoop
    residual: LearnedResidual
    motor_friction: LearnedFriction
    presliding: Presliding


def data_sheet() -> Servo:
    """Return the shipped servo file: table 3 of the paper."""
    return servo_file.load(servo_at(SERVO))


def traditional(recordings: list[Recording], gap: float, error: LearnedError,
                told: Callable[[float], None] | None = None) -> Servo:
    """
    Return Stribeck friction, a fixed dead zone and second-order harmonics, fitted.

    The dead zone is the mean of the gaps that were measured, the harmonics are the first two
    orders of the turn. Friction is fitted first, then with inertias and torque constant, to the
    free runs over the training recordings: eq. 13 itself is made as large as it can be.
    """
    pair = [error.orders.index(o) if o in error.orders else None for o in (1, 2)]
    mean = [0j if i is None else 0.5 * (error.forward[i] + error.reverse[i]) for i in pair]
    servo = data_sheet().with_effects(
        Placed('stribeck', find('stribeck_friction'), 'load'),
        Placed('gap', find('backlash'), 'mesh'),
        Placed('turn_error', find('transmission_error'), 'mesh'),
        values={'effects.stribeck.excess': 3.0, 'effects.stribeck.fade': 0.05,
                'effects.gap.width': gap, 'effects.turn_error.order': 1.0,
                'effects.turn_error.cosine': tuple(c.real for c in mean),
                'effects.turn_error.sine': tuple(c.imag for c in mean),
                'effects.turn_error.cosine_change': (0.0, 0.0),
                'effects.turn_error.sine_change': (0.0, 0.0)})
    servo, _ = refined(servo, recordings, FRICTION, FADE, told=told)
    servo, _ = refined(servo, recordings, (*FRICTION, *INERT), FADE, told=told)
    return servo


def learned(recordings: Mapping[str, list[Recording]],
            told: Callable[[str], None] = lambda stage: None) -> Models:
    """Learn all models from the parts of the recordings that are for training."""
    open_loop = recordings['open_loop_training']
    sheet = data_sheet()
    told('current loop')
    loop = learned_current_loop(sheet, open_loop)
    told('friction networks')
    friction = learned_friction(sheet, recordings['friction'] + recordings['loads'])
    told('transmission error and backlash')
    error = learned_error(sheet, recordings['transmission_error'])
    backlash = learned_backlash(sheet, recordings['loads'])

    told('hybrid')
    plain = learned_friction(sheet, recordings['friction'])
    at_motor = learned_friction(sheet, recordings['friction'], 'motor', cells=MOTOR_CELLS)

    def assembled(at_load: LearnedFriction) -> Servo:
        servo = with_friction(with_friction(sheet, at_load), at_motor, 'motor_friction')
        return with_backlash(with_error(servo, error), backlash)

    ladder = {'data sheet, Coulomb and viscous friction': sheet}
    ladder['+ networks of friction and backlash, transmission error'] = assembled(plain)
    ladder['+ current loop'] = with_current_loop(assembled(plain), loop)
    loaded = with_current_loop(assembled(friction), loop)
    ladder['+ friction that grows with load'] = loaded
    presliding = learned_presliding(loaded, open_loop, told=lambda mean: told(
        f'presliding, mean R {mean:.4f}'))
    hybrid = with_presliding(loaded, presliding)
    ladder['+ presliding: the hybrid'] = hybrid

    told('traditional')
    classic = traditional(open_loop, float(backlash.gaps.mean()), error,
                          lambda mean: told(f'traditional, mean R {mean:.4f}'))
    told('residual network')
    residual = learned_residual(classic, open_loop)
    servos = {'traditional': classic, 'traditional + residual network':
              with_residual(classic, residual), 'hybrid': hybrid}
    return Models(servos, ladder, friction, backlash, error, loop, residual, at_motor,
                  presliding)
