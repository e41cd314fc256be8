r"""
Channels that hold no measurement of their own: another one over again, or a value that is held.

.. math:: y_k = a\,x_{k-d} + b

A sensor has noise, and two shafts have a transmission between them. What leaves less than that
between two channels was computed, copied, or read from one sensor, perhaps some rows later.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .finding import Finding
from .signals import ANGLES, MOST

COMPUTED = 1e-3  # share that a current leaves of another torque or current that it was made of
ROUNDED = 1e-6  # the same of two angles: rounding of numbers, where no noise is given
STEADY = 0.25  # share of its mean within which a command stays that is that of a supply
ONE_SIGN = 0.02  # share of its range by which a current of one sign may cross zero: noise
BACK = 0.5  # share of its range by which a shaft turns to and fro
LATEST = 50  # rows by which a copy may be late
FEWEST = 3  # steps of a ramp that say whether they are even
SEVERAL = 20  # steps of several counts from which on it is judged whether a channel is held
_ONCE = 0.02  # share of them that another one may follow at once: a late packet
_RAMP = 0.5  # share of the rows that a value is held for, up to which it may go to the next one
_EVEN = 0.2  # share of their mean by which the steps of such a ramp may differ, beside a count

_COMMANDED = ('was no encoder read?', 'record the encoder: a command shows neither friction nor '
              'backlash')
_TOLD = ('is it a copy of what was told, and was no current measured?',
         'record the measured current, or leave the column out')
_EXPECTED = {
    'torque': {'current': ('was it computed from it?',
                           'leave the column out where no sensor measured it')},
    'current': {'voltage': _TOLD, 'current_reference': _TOLD},
    'motor_position': {'reference_position': _COMMANDED},
    'load_position': {'reference_position': _COMMANDED,
                      'motor_position': ('are both columns of one sensor?',
                                         'leave the one out that no sensor of its own measured: '
                                         'it hides backlash, stiffness and transmission error')},
}
_WORDS = {'current': 'the current', 'voltage': 'the command (voltage)'}


@dataclass(frozen=True)
class Copy:
    """A channel that is ``factor`` times another, ``late`` rows later (before: negative)."""

    factor: float
    late: int


def measured_alone(one: Recording, servo: Servo) -> Recording:
    """
    Return a recording without a torque or a command that no sensor told.

    Of a torque that was made of the current, or of the voltage of the supply, the equations of the
    servo say nothing about units.
    """
    gone = ['torque'] if one.has('torque') and copied(one, 'torque', 'current', servo) else []
    gone += ['voltage'] if of_supply(one) else []
    nothing = np.full(len(one), np.nan)
    return replace(one, columns={**one.columns, **dict.fromkeys(gone, nothing)}) if gone else one


def supply_findings(one: Recording) -> list[Finding]:
    """Return whether the command may be the voltage of the supply."""
    if not (while_ := of_supply(one)):
        return []
    return [Finding('amber', f'{one.name}: the command stays near {np.nanmin(one["voltage"]):.3g} '
                    f'while the {while_}: is it the voltage of the supply?',
                    'record what the drive was told, or the voltage at the motor', one.name)]


def of_supply(one: Recording) -> str:
    """Return what changes its sign while the command stays near one value, or ''."""
    told = one['voltage'][np.isfinite(one['voltage'])]
    if not told.any() or np.ptp(told) >= STEADY * abs(told.max() + told.min()) / 2.0:
        return ''
    if one.has('current'):
        current = one['current'][np.isfinite(one['current'])]
        small = ONE_SIGN * np.ptp(current)
        return 'current changes its sign' if current.min() < -small < small < current.max() else ''
    ways = [one[name][np.isfinite(one[name])] for name in ANGLES if one.has(name)]
    back = np.ptp(told) == 0.0 and any(
        min(np.max(np.maximum.accumulate(x) - x), np.max(x - np.minimum.accumulate(x)))
        > BACK * np.ptp(x) > 0.0 for x in ways)
    return 'shaft turns to and fro' if back else ''


def copied_findings(one: Recording, servo: Servo) -> list[Finding]:
    """Return which channels of a recording are another one over again, a sentence each."""
    found = []
    for name, sources in _EXPECTED.items():
        for source, (question, action) in sources.items():
            copy = copied(one, name, source, servo)
            if copy:
                found.append(Finding(
                    'amber', f'{one.name}: {name} is {_said(copy, one, name)}'
                    f'{_WORDS.get(source, source)} in all samples: {question}', action, one.name))
                break
    return found


def copied(one: Recording, name: str, source: str, servo: Servo) -> Copy | None:
    """Return how a channel follows from another where it leaves less than a sensor would."""
    y, x = one[name][:MOST], one[source][:MOST]
    known = np.isfinite(y) & np.isfinite(x)
    if known.sum() <= 4 * LATEST or not (_varies(y) and _varies(x)):
        return None
    y, x = y[known], x[known]
    least = COMPUTED * np.std(y)
    if name in ANGLES:
        noise = servo.noise(name)
        least = max(ROUNDED * float(np.std(y)), 0.5 * noise if np.isfinite(noise) else 0.0)
    middle = y[LATEST:-LATEST]
    middle = middle - middle.mean()
    size, best = float(middle @ middle), (np.inf, Copy(0.0, 0))
    for late in sorted(range(-LATEST, LATEST + 1), key=abs):
        other = x[LATEST - late:len(x) - LATEST - late]
        other = other - other.mean()
        power, shared = float(other @ other), float(middle @ other)
        if power > 0.0 and size - shared**2 / power < best[0]:
            rest = middle - shared / power * other  # a difference of large squares is none
            best = min(best, (float(rest @ rest), Copy(shared / power, late)),
                       key=lambda pair: pair[0])
    return best[1] if best[0] < least**2 * len(middle) else None


def held_findings(one: Recording) -> list[Finding]:
    """Return which measured channels of a recording are updated less often than it has rows."""
    found = []
    for name in (*ANGLES, 'current', 'torque'):
        rows = held(one[name][:MOST])
        if rows > 1.0:
            found.append(Finding(
                'amber', f'{one.name}: {name} changes in one row of {rows:.3g} alone and is held '
                f'for {1e3 * rows * one.period:.3g} ms: it comes late by half of that.',
                'record it as often as the rows, or import what is held at its own rate: '
                f'--period {rows * one.period:.3g}', one.name))
    return found


def held(values: np.ndarray) -> float:
    """
    Return for how many rows each value of a channel is held, 1 for one that is not.

    What moves by several counts in a row moves in the next one, too. By a single count it may not.
    A held value that was interpolated since goes to the next one within some rows, in even steps,
    and stays. A shaft that sticks and slips does, too, but it speeds up and slows down.
    """
    steps = np.diff(values)
    moves = np.concatenate([[False], np.nan_to_num(steps) != 0.0, [False]])
    begins, ends = np.flatnonzero(~moves[:-1] & moves[1:]), np.flatnonzero(moves[:-1] & ~moves[1:])
    sizes, gaps = np.abs(values[ends] - values[begins])[:-1], np.diff(begins)
    fast = sizes > 2.5 * sizes.min(initial=np.inf)
    if fast.sum() < SEVERAL:
        return 1.0
    rows, rests = float(np.median(gaps[fast])), (begins[1:] - ends[:-1])[fast]
    # of rows that are held it goes on in the one beside a step for a late packet alone
    goes_on = (ends - begins)[:-1][fast] > _RAMP * rows
    slips = [_uneven(steps[begin + 1:end - 1]) for begin, end in zip(
        begins[:-1][fast], ends[:-1][fast], strict=True)]
    return rows if max(np.mean(goes_on), np.mean(slips)) < _ONCE and (
        np.quantile(rests, _ONCE) >= 1.0) else 1.0


def _uneven(steps: np.ndarray) -> bool:
    """Tell whether the steps of a ramp, (rows,), without its first and last, are no ramp's."""
    if len(steps) < FEWEST:
        return False
    sizes = np.abs(steps)
    return bool(np.ptp(steps) > _EVEN * sizes.mean() + 2.0 * sizes.min())


def _varies(values: np.ndarray) -> bool:
    return bool(np.nanstd(values) > 0.0) if np.isfinite(values).any() else False


def _said(copy: Copy, one: Recording, name: str) -> str:
    unit = ' N m/A' if name == 'torque' else ''
    if not copy.late:
        return f'{copy.factor:.4g}{unit} times '
    way = 'later than' if copy.late > 0 else 'before'
    return (f'{copy.factor:.4g}{unit} times, and {1e3 * abs(copy.late) * one.period:.3g} ms '
            f'{way}, ')
