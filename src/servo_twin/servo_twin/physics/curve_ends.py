"""Whether the curves of a servo go from a lower end to a higher one."""

from __future__ import annotations

from .servo import Servo, ServoError


def check_curves(servo: Servo) -> None:
    """
    Raise ServoError for a curve whose ends are the wrong way round, or alike.

    One over an angle whose ends are alike repeats each turn, so that is no fault.
    """
    for placed in servo.effects:
        effect = placed.effect
        if not {'curve', 'low', 'high'} <= effect.parameters.keys():
            continue
        path = f'effects.{placed.name}'
        low, high = (servo.numbers[f'{path}.{end}'] for end in ('low', 'high'))
        turns = 'over_angle' in effect.law.__code__.co_names
        if low < high or (turns and low == high):
            continue
        unit = servo.unit(f'{path}.high')
        more = ', or the same for a curve that repeats each turn' if turns else ''
        raise ServoError(f'{path}.high = {high:g} {unit} is not above {path}.low = {low:g} '
                         f'{unit}: a curve goes from its lower end to its higher one. Give a '
                         f'higher end{more}')
