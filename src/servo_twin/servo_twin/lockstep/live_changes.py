"""What may change while a twin runs: values that the same kernel runs, and the mode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ..physics.curve_ends import check_curves
from ..physics.element_names import split_name
from ..physics.servo import Servo, ServoError, Value
from ..physics.step_limit import check_step
from ..recording.joined_samples import reference_of
from .live_modes import LIVE_MODES


def changed(servo: Servo, changes: Mapping[str, Value], source: str | None = None) -> Servo:
    """
    Return a servo with values changed that the same kernel runs; ``source`` is their provenance.

    A value that leaves its tolerance has none any more. Raises ServoError.
    """
    new = servo.with_values(changes, source)
    for path in {split_name(name)[0] for name in changes}:
        now, then = new.values[path], servo.values[path]
        if isinstance(then, tuple) and len(now) != len(then):
            raise ServoError(f'{servo.name}: {path} has {len(then)} numbers, not {len(now)}; '
                             f'another length is another servo file')
    tolerance = {path: (low, high) for path, (low, high) in new.tolerance.items()
                 if low <= new.number(path) <= high}
    new = replace(new, tolerance=tolerance)
    check_curves(new)
    check_step(new)
    return new


def check_mode(servo: Servo | None, mode: str) -> None:
    """Raise ServoError for a mode that there is not, or that a servo, if any, cannot run in."""
    if mode not in LIVE_MODES:
        raise ServoError(f'there is no mode {mode!r}; there are {list(LIVE_MODES)}')
    if servo is None:
        return
    if mode == 'closed_loop' and reference_of(servo) is None:
        raise ServoError(f'{servo.name}: closed_loop needs a controller; '
                         f'the servo file has none')
    if mode == 'observer' and not servo.mechanism.correctable:
        raise ServoError(f'{servo.name}: the mode observer needs a mechanism whose angles and '
                         f'speeds can be pulled, and this one is an FMU; there are '
                         f'{[m for m in LIVE_MODES if m != "observer"]}')
