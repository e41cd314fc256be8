"""Says where an encoder leaps: its counter was reset, lost turns, or a frame was spoilt."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, isnan, nan, pi, tau

from .rig_health import RigHealth
from .sample_blocks import SampleBlock

FASTEST = 2e5
"""rad/s2 that no shaft exceeds: the quickest small motors reach half of it without a load. Within
10 ms that is 20 rad, so that who samples slowly says what the own shaft can do."""
MEANING = ('Acceleration that no shaft of the rig exceeds, of the motor and of the load; an angle '
           'that departs by more within a sample, and by 1 rad or more, is told as a leap of its '
           'encoder')
LEAST = 1.0
"""rad that an angle may depart in any case."""
BREAK = 0.1
"""s without a sample after which nobody knows how a shaft has turned meanwhile."""


@dataclass
class _Angle:
    """The last sample measured: its number, its angle (rad), the step to it; NaN: not known."""

    number: int
    angle: float
    step: float = nan


class EncoderLeaps:
    """
    Looks at the angles of a rig in the order of their samples.

    From one sample to the next a shaft goes on at its speed, up to a hard stop that throws it
    back as fast, and an acceleration of ``fastest``, rad/s2. What departs further is no motion.
    After a break the angle may be anywhere that the speed before it leads to, and half a turn
    around that.
    """

    ANGLES = ('motor_position', 'load_position')

    def __init__(self, health: RigHealth, fastest: float = FASTEST) -> None:
        self.health, self.fastest = health, fastest
        self._last: dict[str, _Angle] = {}

    def take(self, block: SampleBlock) -> frozenset[str]:
        """Take the next block; return which of ANGLES leapt in it, and say so."""
        leapt = set()
        for name in self.ANGLES:
            for k, angle in enumerate(block.columns[name]):
                if isfinite(angle) and self._next(name, block, k, angle):
                    leapt.add(name)
        return frozenset(leapt)

    def _next(self, name: str, block: SampleBlock, k: int, angle: float) -> bool:
        number = block.sequence + k
        last = self._last.get(name)
        if last is None or number <= last.number:  # samples began again
            self._last[name] = _Angle(number, angle)
            return False
        steps = number - last.number
        if steps * block.period > BREAK:
            travel = (0.0 if isnan(last.step) else last.step) * steps
            off = angle - last.angle - min(max(angle - last.angle, min(0.0, travel)),
                                           max(0.0, travel))
            leaps = abs(off) > pi
            last.step = nan
        elif isnan(last.step):
            last.step = (angle - last.angle) / steps
            leaps, off = False, 0.0
        else:
            off = angle - last.angle - last.step * steps
            leaps = abs(off) > 2.0 * abs(last.step) * steps + max(
                LEAST, self.fastest * (steps * block.period) ** 2)
            if not leaps:
                last.step = (angle - last.angle) / steps
        if leaps:
            self._say(name, block, k, angle, off, steps)
        last.number, last.angle = number, angle
        return leaps

    def _say(self, name: str, block: SampleBlock, k: int, angle: float, off: float,
             steps: int) -> None:
        now = block.stamp + round(k * block.period * 1e9)
        what = name.replace('_position', ' encoder')
        size = f'{off:+.4g} rad ({off / tau:+.4g} turns)'
        before = self._last[name].angle
        if steps * block.period > BREAK:
            said = (f'the {what} tells {angle:.4g} rad after a break of '
                    f'{steps * block.period:.3g} s, and told {before:.4g} rad before it: {size} '
                    'off. If the shaft was not turned meanwhile, the encoder lost its turns: '
                    'reference the axis')
        else:
            said = (f'the {what} leapt by {size} within {steps * block.period * 1e3:.3g} ms, from '
                    f'{before:.4g} to {angle:.4g} rad, which is no motion: its counter was reset '
                    'or lost turns, or a frame was spoilt. Where it stays so, reference the axis; '
                    'angles before and after do not belong together')
        self.health.event(f'samples.{name}_leapt', said, now)
