"""
The five models of a harmonic drive that paper 004 compares, each a named set of effects.

A set stands on the linear model of the paper (section II E): two inertias, a linear spring with
its damping, viscous friction on both shafts. What a model says beyond that are its effects, by
names that all sets share, so that one set is exchanged for another. Their values are typical of a
small harmonic drive, 100:1, some 30 N m; the servo file gives those of the machine.

Choices where the paper leaves one: Hashimoto's Coulomb friction acts at the motor, as in eq. 3;
Taghirad's effective inertia is that of the motor side, for the load is measured beside it; the
ratio N + 1 of eq. 7 is the ratio of the mechanism.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .catalogue import find
from .servo import Placed, Servo, ServoError, Value


@dataclass(frozen=True)
class Member:
    """One effect of a set: its name there, effect, site, and values typical of a small drive."""

    name: str
    effect: str
    site: str
    values: Mapping[str, Value] = field(default_factory=dict)

    @property
    def placed(self) -> Placed:
        """The effect at its place."""
        return Placed(self.name, find(self.effect), self.site)


@dataclass(frozen=True)
class HarmonicDrive:
    """A model of a harmonic drive: ``name`` in servo files, title for people, its effects."""

    name: str
    title: str
    source: str
    members: tuple[Member, ...]


_ERROR: dict[str, Value] = {'order': 2.0, 'cosine': (5e-5, 1e-5), 'sine': (5e-5, 1e-5)}

HARMONIC_DRIVES = {one.name: one for one in (
    HarmonicDrive(
        'hashimoto_kiyosawa', 'Hashimoto and Kiyosawa',
        'paper 004 eq. 3: Coulomb friction, stiffening spring', (
            Member('wave_generator', 'coulomb_friction', 'motor', {'level': 0.012}),
            Member('spring', 'stiffening_spring', 'mesh', {'rise': 2e6}))),
    HarmonicDrive(
        'ghorbel_gandhi', 'Ghorbel and Gandhi',
        'paper 004 eq. 4: LuGre friction that depends on position, kinematic error', (
            Member('wave_generator', 'presliding_friction', 'motor', {
                'level': 0.01, 'excess': 0.005, 'breakaway': 0.02, 'fade': 5.0, 'lag': 1e-4}),
            Member('wave_generator_turn', 'position_dependent_friction', 'motor', {
                'order': 2.0, 'cosine': (1e-3,), 'sine': (1e-3,)}),
            Member('kinematic_error', 'kinematic_error', 'mesh', _ERROR))),
    HarmonicDrive(
        'ghorbel_dhaouadi', 'Ghorbel and Dhaouadi',
        'paper 004 eq. 5: dry and static friction, nonlinear spring with dissipation', (
            Member('wave_generator', 'coulomb_friction', 'motor', {'level': 0.01}),
            Member('wave_generator_static', 'stribeck_friction', 'motor', {
                'excess': 0.005, 'fade': 5.0}),
            Member('spring', 'nonlinear_stiffness', 'mesh', {
                'cubic': 0.0, 'soft': 3e3, 'reach': 4e-4}),
            Member('loop', 'dissipative_hysteresis', 'mesh', {
                'level': 0.4, 'rate': 5e-3, 'reach': 1e-3}))),
    HarmonicDrive(
        'taghirad', 'Taghirad',
        'paper 004 eq. 6: friction of wave generator, gear mesh and output bearing apart', (
            Member('wave_generator', 'coulomb_friction', 'motor', {'level': 0.008}),
            Member('wave_generator_static', 'stribeck_friction', 'motor', {
                'excess': 0.005, 'fade': 5.0}),
            Member('gear_mesh', 'load_dependent_friction', 'motor', {
                'share': 0.05, 'back_driven': 0.0}),
            Member('output_bearing', 'coulomb_friction', 'load', {'level': 0.3}),
            Member('output_bearing_static', 'stribeck_friction', 'load', {
                'excess': 0.1, 'fade': 0.05}))),
    HarmonicDrive(
        'tjahjowidodo', 'Tjahjowidodo, Al-Bender and Van Brussel',
        'paper 004 eq. 7: cubic spring, torsional hysteresis, friction of the output bearing', (
            Member('spring', 'nonlinear_stiffness', 'mesh', {
                'cubic': 3e9, 'soft': 0.0, 'reach': 4e-4}),
            Member('loop', 'hysteresis', 'mesh', {'level': 0.6, 'travel': 3e-4}),
            Member('output_bearing', 'presliding_friction', 'load', {
                'level': 1.2, 'excess': 0.5, 'breakaway': 2e-4, 'fade': 0.05, 'lag': 1e-3}))),
)}
"""The models by name."""

NAMES = frozenset(m.name for one in HARMONIC_DRIVES.values() for m in one.members)
"""Names that effects of these sets have in a servo."""


def harmonic_drive(name: str) -> HarmonicDrive:
    """Return a model by name; raises ServoError that names what there is."""
    if name not in HARMONIC_DRIVES:
        raise ServoError(f'there is no harmonic drive {name!r}; there are {list(HARMONIC_DRIVES)}')
    return HARMONIC_DRIVES[name]


def with_harmonic_drive(servo: Servo, name: str | None) -> Servo:
    """
    Return the servo with the effects of another model in place of those it has.

    None leaves the linear model. Values are those of the set. Raises ServoError.
    """
    members = harmonic_drive(name).members if name is not None else ()
    values: dict[str, Value] = {}
    for member in members:
        values |= member.placed.paths(member.values)
    return servo.without_effects(lambda placed: placed.name in NAMES).with_effects(
        *(member.placed for member in members), values=values)
