"""
Measure the change detector: seconds to the alarm of each effect, and false alarms an hour.

  servo-identify watch -o DIR

has the emulated rig play a sine of speed, switches an effect on in the middle of it, and gives the
residuals of the twin to the detector as they would come live. Eight seconds after the first alarm
it asks for the place of the change. Then it watches as long as --hours says with nothing switched
on. DIR/watch.json and DIR/watch.png hold what came of it. No recording of yours takes part:
`check` says what drifts from one recording of a motion to the next, `online` follows values over
one, and the identify node watches a rig that runs.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
import json
from pathlib import Path
import tempfile
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import named_servo, new_folder, plain, say, tell

if TYPE_CHECKING:
    from servo_twin.physics.servo import Servo
    from servo_twin.recording.recording import Recording

    from ..watch.changes.change_detector import Settings

EFFECTS = {
    'friction.load_level': (1.4, ('load',)), 'withheld.load_drag': (5.0, ('load',)),
    'withheld.gravity': (8.0, ('load',)), 'withheld.quadratic_drag': (30.0, ('load',)),
    'withheld.motor_drag': (0.03, ('motor',)), 'withheld.torque_constant': (0.05, ('motor',)),
    'withheld.drive_gain': (0.03, ('drive',)), 'withheld.drive_offset': (0.1, ('drive',)),
    'withheld.current_sensor_offset': (0.05, ('drive', 'motor')),
    'withheld.torque_sensor_gain': (0.05, ('motor', 'load')),
    'withheld.load_sensor_delay': (0.003, ('transmission', 'sensor')),
    'mesh.backlash': (3.0, ('transmission',)), 'withheld.controller_gain': (0.1, ('controller',)),
}
"""Property of the rig: what it is switched to, and the balances that it enters directly."""

_AHEAD = 20.0  # s that are watched before the switch
_PIECE = 300.0  # s watched at a stretch with nothing switched on


@dataclass(frozen=True)
class Seen:
    """
    What was said of one effect; ``seconds`` from the switch, NaN: nothing within the time.

    ``places`` are the probabilities of those that are named, none where it is not known.
    """

    effect: str
    value: float
    enters: tuple[str, ...]
    balance: str
    seconds: float
    then: tuple[tuple[str, float], ...]
    too_early: bool
    places: dict[str, float]
    place: str


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('recording', nargs='*', type=_refused, help=argparse.SUPPRESS)
    parser.add_argument('-o', '--output', type=Path, required=True, metavar='DIR')
    parser.add_argument('--servo', type=named_servo, default='rv_bench', metavar='S.yaml',
                        help='servo file of the twin (default %(default)s)')
    parser.add_argument('--rig', type=Path, metavar='R.yaml',
                        help='rig file (default: the shipped rv_bench)')
    parser.add_argument('--effects', nargs='*', metavar='PATH', default=list(EFFECTS),
                        help='properties to switch on (default: all it knows)')
    parser.add_argument('--learn', type=float, default=40.0, metavar='S',
                        help='how long the detector learns (default %(default)g)')
    parser.add_argument('--false-alarms', type=float, default=0.1, metavar='1/H',
                        help='stated rate (default %(default)g)')
    parser.add_argument('--wait', type=float, default=30.0, metavar='S',
                        help='for an alarm (default %(default)g)')
    parser.add_argument('--hours', type=float, default=1.0,
                        help='to watch with nothing switched on (default %(default)g)')
    parser.add_argument('--seed', type=int, default=0, help='of the sensor noise')


def _refused(path: str) -> str:
    """Say of a recording which command takes one."""
    raise argparse.ArgumentTypeError(
        f'{path!r}: watch takes none, it measures the detector on the emulated rig. '
        '`servo-identify check` says what drifts from one recording of a motion to the next, '
        '`online` follows values of the servo file over one, `diagnose` names the effect')


def main(arguments: argparse.Namespace) -> int:
    """Measure, print and write."""
    from servo_twin.description import servo_file
    from servo_twin.description.shipped import shipped

    from ..watch.changes.change_detector import Settings

    unknown = [name for name in arguments.effects if name not in EFFECTS]
    if unknown:
        raise ValueError(f'{unknown} cannot be switched on here; there are {list(EFFECTS)}')
    servo = servo_file.load(arguments.servo)
    rig = (arguments.rig or shipped('rigs/rv_bench.yaml')).read_text()
    settings = Settings(learn=arguments.learn, false_alarms=arguments.false_alarms)
    new_folder(arguments.output, arguments.force, 'watch.json', 'watch.png')
    seen = []
    for name in arguments.effects:
        seen.append(_switched(name, servo, rig, settings, arguments.wait, arguments.seed))
        say(arguments, _line(seen[-1]))
    if seen:
        right = sum(one.balance in one.enters for one in seen)
        late = max((one.seconds for one in seen if one.balance), default=float('nan'))
        say(arguments, f'{right} of {len(seen)} named rightly first, the latest after '
            f'{late:.2f} s')
    watched, alarms = _nothing(servo, rig, settings, arguments.hours, arguments.seed,
                               lambda line: say(arguments, line))
    at_most = _upper(alarms) / watched if watched else None
    if watched:
        say(arguments, f'nothing switched on: {alarms} false alarms in {watched:.2f} h (at most '
            f'{at_most:.2g} an hour with 95 % confidence; stated {settings.false_alarms:g})')
    found = {
        'stated_false_alarms_per_hour': settings.false_alarms, 'hours_watched': watched,
        'false_alarms': alarms, 'upper_95': at_most, 'effects': [asdict(s) for s in seen]}
    (arguments.output / 'watch.json').write_text(
        json.dumps(plain(found), indent=1, allow_nan=False) + '\n')
    tell(arguments, **found, written=[arguments.output])
    if seen:
        _draw(seen, arguments.output / 'watch.png')
    return 0


def _switched(name: str, servo: Servo, rig: str, settings: Settings, wait: float, seed: int
              ) -> Seen:
    from ..watch.changes.in_a_recording import located, watch

    value, enters = EFFECTS[name]
    at = settings.learn + _AHEAD
    recording = _played(servo, rig.replace(
        'switches: []', f'switches:\n  - {{at: {at}, set: {{{name}: {value}}}}}'), at + wait, seed)
    alarms = watch(servo, recording, settings)
    later = [alarm for alarm in alarms if alarm.sequence * recording.period > at]
    true = [(one.balance, round(one.sequence * recording.period - at, 2)) for one in later]
    first = true[0] if true else ('', float('nan'))
    found = located(servo, recording, settings, later[0]) if later else None
    places = {} if found is None else {one: found.probability[one] for one in found.places}
    return Seen(name, value, enters, *first, tuple(true[1:]), len(later) < len(alarms), places,
                '' if found is None else str(found))


def _nothing(servo: Servo, rig: str, settings: Settings, hours: float, seed: int,
             told: Callable[[str], None]) -> tuple[float, int]:
    """
    Watch a rig where nothing changes; return hours watched and alarms.

    It does not warm up, and the zero of its torque sensor does not wander: both are changes, and
    are found in the end.
    """
    from ..watch.changes.in_a_recording import watch

    alarms, pieces = 0, round(hours * 3600.0 / _PIECE)
    for number in range(pieces):
        recording = _played(servo, rig, settings.learn + _PIECE, seed + 1 + number,
                            'thermal.heating=0', 'sensors.wander=0')
        alarms += len(watch(servo, recording, settings))
        told(f'  {(number + 1) * _PIECE / 3600.0:.2f} h: {alarms} false alarms')
    return pieces * _PIECE / 3600.0, alarms


def _played(servo: Servo, rig: str, seconds: float, seed: int, *turned: str) -> Recording:
    """Have the rig play 0.5 rad/s at 0.25 Hz."""
    import numpy as np

    from servo_twin.bag import read_recording
    from servo_twin.description import servo_file

    from ..experiment.offline_bench import make
    from ..experiment.procedures import Run

    period = 1e-3
    time = np.arange(round(seconds / period)) * period
    wave = 0.5 * np.sin(2.0 * np.pi * 0.25 * time)
    run = Run('watched', 'sine', 'velocity', period, wave, np.zeros(len(time)), 1)
    with tempfile.TemporaryDirectory(prefix='servo_identify_') as scratch:
        file = Path(scratch) / 'rig.yaml'
        file.write_text(rig)
        return read_recording(make(run, Path(scratch), file, servo.name, servo_file.dumps(servo),
                                   turned, seed))


def _upper(count: int) -> float:
    """Return the mean below which so few events have a chance of 5 %."""
    from scipy.stats import chi2
    return float(chi2.ppf(0.95, 2 * (count + 1)) / 2.0)


def _line(one: Seen) -> str:
    text = f'{one.effect} {one.value:g}: ' + (
        f'{one.balance} after {one.seconds:.2f} s' if one.balance else 'no alarm')
    if one.then:
        text += ', then ' + ', '.join(f'{name} {seconds:.2f} s' for name, seconds in one.then)
    text += f'; in: {one.place}' if one.place else ''
    return text + ('; a false alarm before' if one.too_early else '')


def _draw(seen: Sequence[Seen], path: Path) -> None:
    import matplotlib

    from servo_twin.recording.recording import BALANCES
    matplotlib.use('Agg')
    from matplotlib import pyplot

    known = [one for one in reversed(seen) if one.balance]
    figure, axis = pyplot.subplots(figsize=(7.5, 0.32 * len(known) + 1.0))
    colours = {name: f'C{k}' for k, name in enumerate(BALANCES)}
    axis.barh([f'{one.effect} {one.value:g}' for one in known], [one.seconds for one in known],
              color=[colours[one.balance] for one in known])
    for row, one in enumerate(known):
        axis.text(one.seconds, row, f' {one.balance}', va='center', fontsize=8)
    axis.set_xlabel('s from the switch to the alarm; the balance named first')
    axis.margins(x=0.2)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
