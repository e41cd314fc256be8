"""A machine of the third rig: its plant, its sensors, and the effects in its servo file."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .fault_terms import Change, Scale
from .plant import Plant


@dataclass(frozen=True)
class Known:
    """An effect that the servo file has: right, or within the share that is tolerated."""

    name: str
    effect: str
    site: str
    values: dict[str, Any]
    tolerance: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Machine:
    """A class of machines, or one of them."""

    name: str
    about: str
    plant: Plant
    torque: float                # N m at the load, rated
    speed: float                 # rad/s at the load, highest
    acceleration: float          # rad/s2 at the load
    travel: float                # rad to either side
    period: float                # s
    step: float                  # s, of the integrator
    tolerance: dict[str, float]  # share of each property of the plant
    noise: dict[str, float]      # of each sensor that it has, before the counts
    jitter: float                # s
    families: tuple[str, ...]
    seconds: float = 10.0        # of a recording
    rigid: bool = False
    hung: tuple[float, float] = (6.0, 15.0)
    plain: tuple[Known, ...] = ()
    rich: tuple[Known, ...] = ()
    known: tuple[Known, ...] = field(default=())

    @property
    def channels(self) -> tuple[str, ...]:
        """What it measures beside the command."""
        return tuple(self.noise)

    @property
    def has(self) -> frozenset[str]:
        """Return what mechanisms may ask for."""
        p = self.plant
        return frozenset(one for one, there in {
            'compliant': not self.rigid, 'load': 'load_position' in self.noise,
            'torque': 'torque' in self.noise, 'current': 'current' in self.noise,
            'temperature': 'temperature' in self.noise, 'voltage_drive': p.resistance > 0.0,
            'current_drive': p.resistance == 0.0, 'coulomb': True, 'closed': True,
            'external': 'load_steps' in self.families}.items() if there)

    def scale(self, site: str, way: float = 1.0) -> Scale:
        """Return the sizes that its faults at a site are counted in, more or less."""
        orders = tuple(one.values['order'] for one in self.known if 'order' in one.values)
        return Scale(self.plant, site, way, self.torque, self.speed, self.travel, self.seconds,
                     self.hung, orders)

    def sensor_noise(self, channel: str) -> float:
        """Return the noise of a channel with that of its counts and instants, rms."""
        p = self.plant
        count = {'motor_position': p.motor_count, 'load_position': p.load_count,
                 'torque': p.torque_count, 'current': p.current_count}.get(channel, 0.0)
        moved = {'motor_position': p.ratio, 'load_position': 1.0}.get(channel, 0.0)
        return float(np.sqrt(self.noise[channel]**2 + count**2 / 12
                             + (0.3 * moved * self.speed * self.jitter)**2))


def within_tolerance(machine: Machine, chance: np.random.Generator) -> Machine:
    """Return one machine of a class: each value drawn within 0.8 of its tolerance."""
    def about(value: float, share: float) -> float:
        return value * (1.0 + share * chance.uniform(-0.8, 0.8))

    p = machine.plant
    values = {name: about(getattr(p, name), share) for name, share in machine.tolerance.items()}
    if p.back_emf:  # one flux makes both
        values['back_emf'] = p.back_emf * values['torque_constant'] / p.torque_constant
    known = tuple(replace(one, values=one.values | {
        name: about(one.values[name], share) for name, share in one.tolerance.items()})
        for one in machine.known)
    values['gap'] = sum(one.values['width'] for one in known if one.effect == 'backlash')
    return replace(machine, plant=p._replace(**values), known=known)


def known_effects(machine: Machine) -> Change:
    """Return what the effects of the servo file do, in terms of this rig."""
    whole = Change()
    for one in machine.known:
        m, v = machine.scale('load' if one.site == 'mesh' else one.site), one.values
        if one.effect == 'stribeck_friction':
            whole += m.resists(v['excess'] / m.torque, speed=lambda x, m=m, v=v: np.exp(
                -(x * m.speed / v['fade'])**v['exponent']))
        elif one.effect in ('cogging', 'transmission_error', 'gravity'):
            port = {'cogging': 'motor_torque', 'gravity': 'load_torque'}.get(
                one.effect, 'load_error')
            waves = list(zip(np.atleast_1d(v['cosine']), np.atleast_1d(v['sine']), strict=True))
            whole += m.adds(port, m.turn(lambda p, waves=waves: sum(
                c * np.cos(k * p) + s * np.sin(k * p) for k, (c, s) in enumerate(waves, 1)),
                v.get('order', 1.0)))
    return whole
