"""The command that records what a diagnosis asks for next, whole: it runs as it is pasted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
import shlex
from typing import Any

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .reach import reached
from .usual_limits import USUAL

PROCEDURES = {'speed_ladder': 'speed_ladder', 'slow_reversals': 'slow_reversals',
              'load_steps': 'load_steps', 'chirp': 'chirp', 'multisine': 'multisine',
              'sine': 'open_loop_sine'}
"""The procedure of `servo-identify experiment` that records a family."""
EMULATED = 'emulated rig: '
"""What the note of a recording of an emulated rig begins with; the options of the rig follow."""
ROOM = 1.2  # times what was reached, that the next recording may reach


def next_command(chosen: Mapping[str, Any], servo: Servo, path: Path,
                 recordings: Sequence[Recording], output: str = 'next') -> str:
    """
    Return the command line that records a chosen ``family`` with its ``settings``; '' for none.

    ``path`` is the servo file. Limits are those that the recordings reached, where the usual ones
    are smaller, or nothing is usual because the load moves straight. A recording of an emulated
    rig has its options in the note, which are kept.
    """
    family, settings = chosen.get('family', ''), chosen.get('settings', {})
    if family not in PROCEDURES:
        return ''
    words = ['servo-identify', 'experiment', PROCEDURES[family], '-o', output, '--servo',
             _named(path)]
    for option, values in _choices(settings).items():
        words += [f'--{option}', *(f'{value:.4g}' for value in values)]
    rate = 1.0 / recordings[0].period
    if abs(rate - 1000.0) > 0.5:
        words += ['--rate', f'{rate:.6g}']
    for name, most in _limits(settings, servo, recordings).items():
        if most > USUAL[name] or servo.linear and name != 'current' and most > 0.0:
            words += [f'--max-{name}', f'{most:.3g}']
    return shlex.join(words) + _emulated(recordings[0].note)


def emulated_note(rig: Path, turned: Sequence[str]) -> str:
    """Return the note of a recording that the emulated rig played without its bus."""
    words = ['--headless', '--rig', _named(rig)]
    for one in turned:
        words += ['--set', one]
    return EMULATED + shlex.join(words)


def _emulated(note: str) -> str:
    return ' ' + note[len(EMULATED):] if note.startswith(EMULATED) else ''


def _choices(settings: Mapping[str, Any]) -> dict[str, list[float]]:
    """Return the options of the command and their values, by the settings of a family."""
    speeds = settings.get('speeds', [settings['speed']] if 'speed' in settings else [])
    found = {'speeds': list(speeds), 'duration': [settings['duration']]}
    for name in ('torque', 'amplitude'):
        found[f'{name}s'] = [settings[name]] if name in settings else []
    if 'from' in settings:
        found['frequencies'] = [settings['from'], settings['to']]
    elif 'frequency' in settings:
        found['frequencies'] = [settings['frequency']]
    elif 'period' in settings:
        found['frequencies'] = [1.0 / settings['period']]
    return {option: values for option, values in found.items() if values}


def _limits(settings: Mapping[str, Any], servo: Servo, recordings: Sequence[Recording]
            ) -> dict[str, float]:
    """Return speed, torque, travel (at the load) and current that the recording may reach."""
    travel, speed, torque = reached(list(recordings))
    if not any(one.has('load_position') for one in recordings):
        travel, speed = (size / servo.values['mechanism.ratio'] for size in (travel, speed))
    current = max((float(abs(one['current'][one['current'] == one['current']]).max(initial=0.0))
                   for one in recordings), default=0.0)
    if 'amplitude' in settings and 'drive.resistance' not in servo.values:
        current = max(current, settings['amplitude'] * abs(servo.values.get('drive.gain', 0.0)))
    found = {'speed': max(speed, *_choices(settings).get('speeds', [0.0]), 0.0),
             'torque': max(torque, abs(settings.get('torque', 0.0))), 'travel': travel,
             'current': current}
    return {name: ROOM * float(size) for name, size in found.items()}


def _named(path: Path) -> str:
    """Return a file as one types it: the name of a shipped one, else its path."""
    from servo_twin.description.shipped import shipped

    try:
        ours = shipped(f'{path.parent.name}/{path.name}')
    except ValueError:
        return str(path)
    return path.stem if path.resolve() == ours.resolve() else str(path)
