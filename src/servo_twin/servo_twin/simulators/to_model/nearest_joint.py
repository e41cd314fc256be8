"""The joint of a simulator that comes nearest to a servo, and the error that this leaves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...physics.servo import Servo
from ...physics.state import OUTPUTS
from ..joint import Joint, SPOKEN, UNITS
from ..runs.joint_equation import equation_run
from ..runs.joint_excitation import Excitation, excitation_for
from ..runs.twin_run import twin_run
from .as_joint import joint_of_servo, Lost
from .nearest_friction import friction_at_rest, lossy, nearest_friction

_LOAD = OUTPUTS.index('load_position')
_BESIDE = {  # field: what it is, for formats that do not hold it
    'stiffness': 'spring at the load', 'lag': 'lag of the command',
    'delay': 'delay of the command',
}


@dataclass(frozen=True)
class Cost:
    """
    What is lost of a servo: ``what``, what stands for it, and what it does.

    ``moves`` is the rms by which the position changes where it is left out of the servo and
    nothing stands for it, rad; NaN where the servo cannot do without.
    """

    what: str
    nearest: str
    moves: float


@dataclass(frozen=True)
class Nearest:
    """
    A joint, what was lost, and how far it is off over an excitation.

    ``rms`` and ``most`` are those of the difference in position, rad, ``motion`` the rms of the
    servo's own position about its mean; ``by`` says what ran the joint.
    """

    joint: Joint
    lost: tuple[Cost, ...]
    excitation: Excitation
    remarks: tuple[str, ...]
    rms: float = float('nan')
    most: float = float('nan')
    motion: float = float('nan')
    by: str = ''


def nearest_joint(servo: Servo, name: str, form: str, period: float,
                  amplitude: float | None = None, frequency: float | None = None,
                  duration: float | None = None) -> Nearest:
    """
    Return the joint that a format can hold, before it is compared.

    What can go over goes over as it is. Torques that a simulator has no law for become dry and
    viscous friction by least squares over the excitation; it follows from the joint, unless given
    (rad or V, Hz, s). ``period`` (s) is that of the controller and of the samples. Raises
    ModelError.
    """
    joint, lost, remarks = joint_of_servo(servo, name)
    joint, more = _held(joint, form, remarks)
    at_shafts = lossy(servo, {one.effect for one in lost if one.effect})
    guess = joint
    if at_shafts:  # friction is not known yet, and the excitation must overcome it
        guess = replace(joint, friction=joint.friction + abs(friction_at_rest(servo, at_shafts)))
    excitation = excitation_for(guess, period, amplitude, frequency, duration)
    if at_shafts:
        found = nearest_friction(servo, at_shafts, excitation)
        joint = replace(joint, friction=max(0.0, joint.friction + found.dry),
                        damping=max(0.0, joint.damping + found.viscous),
                        stiction=found.stiction if form == 'isaac' else 0.0)
        remarks.append(f'dry and viscous friction stand also for {", ".join(at_shafts)}: they add '
                       f'{found.dry:.4g} {joint.unit("N m")} and {found.viscous:.4g} '
                       f'{joint.unit("N m s/rad")}, and leave {found.left:.4g} '
                       f'{joint.unit("N m")} rms of its torque')
    costs = (*_costs(servo, lost, excitation), *more)
    return Nearest(joint, costs, excitation, tuple(remarks))


def compared(servo: Servo, nearest: Nearest, by: str = '',
             run: Callable[[Joint, Excitation], np.ndarray] = equation_run) -> Nearest:
    """
    Return how far the joint is off the servo over the excitation.

    ``run`` gives its positions; ``by`` says who that is.
    """
    truth = twin_run(servo, nearest.excitation)[:, _LOAD]
    off = run(nearest.joint, nearest.excitation) - truth
    return replace(nearest, rms=float(np.sqrt(np.mean(off**2))), most=float(np.abs(off).max()),
                   motion=float(np.std(truth)),
                   by=by or 'the equation of the joint as the simulator documents it, integrated '
                            'here; the simulator itself was not run')


def report(nearest: Nearest) -> list[str]:
    """Return what went over, what was lost and the error, line by line."""
    joint = nearest.joint
    unit = joint.unit('rad')
    lines = ['What goes over:']
    for name, rotary in UNITS.items():
        value = getattr(joint, name)
        if value not in (0.0, float('inf')) and not (name == 'kf' and not joint.kd):
            spoken = SPOKEN.get(name, name.replace('_', ' '))
            lines.append(f'  {spoken}: {value:.6g} {joint.unit(rotary)}'.rstrip())
    lines += [f'  ({remark})' for remark in nearest.remarks]
    lines.append('What does not, and what stands for it:' if nearest.lost else
                 'Nothing is lost.')
    for one in nearest.lost:
        moves = '' if np.isnan(one.moves) else (
            f' (left out of the twin it moves the position by {one.moves:.3g} {unit} rms)')
        lines.append(f'  {one.what}: {one.nearest}{moves}')
    lines += [f'Error that this leaves: {nearest.rms:.3g} {unit} rms, {nearest.most:.3g} {unit} '
              f'at most, where the position has {nearest.motion:.3g} {unit} rms '
              f'({_share(nearest)}).',
              f'  Over {nearest.excitation.said(unit)}.', f'  The joint was run by {nearest.by}.']
    return lines


def _share(nearest: Nearest) -> str:
    return f'{100.0 * nearest.rms / nearest.motion:.2g} %' if nearest.motion else 'no motion'


def _held(joint: Joint, form: str, remarks: list[str]) -> tuple[Joint, list[Cost]]:
    """Return what a format holds of a joint, and what it does not; add remarks."""
    if form == 'mjcf':
        return joint, []
    costs = []
    for field, what in _BESIDE.items():
        value = getattr(joint, field)
        if value:
            costs.append(Cost(f'{what}, {value:g} {joint.unit(UNITS[field])}', 'none',
                              float('nan')))
    joint = replace(joint, damping=joint.damping + joint.back_emf, back_emf=0.0, lag=0.0,
                    delay=0.0, stiffness=0.0, rest=0.0)
    if form == 'urdf':
        remarks.append('URDF holds no armature: it is in the inertia of the link, which is right '
                       'while what carries the joint stands still')
        remarks.append('URDF holds no gains and no torque for a command: they stand here for '
                       'whoever writes the controller')
    else:
        remarks.append('inertia and gravity are those of the asset, which --format urdf writes')
    return joint, costs


def _costs(servo: Servo, lost: list[Lost], excitation: Excitation) -> list[Cost]:
    """Run the servo without each thing that is lost."""
    def position(of: Servo, off: tuple[str, ...] = ()) -> np.ndarray:
        on = np.array([placed.name not in off for placed in of.effects], dtype=np.bool_)
        return twin_run(of, excitation, on)[:, _LOAD]

    truth, costs = position(servo), []
    for one in lost:
        whole = position(servo, one.beside) if one.beside else truth
        if one.effect:
            other = position(servo, (one.effect,))
        elif one.without is not None:
            other = position(one.without)
        else:
            other = np.full(len(truth), np.nan)
        costs.append(Cost(one.what, one.nearest, float(np.sqrt(np.mean((other - whole) ** 2)))))
    return costs
