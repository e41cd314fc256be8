"""Recordings held against a servo file before anything is fitted."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from threadpoolctl import threadpool_limits

from servo_twin.physics.servo import Servo

from .clipped import clipped_findings, normalised_findings
from .coarse_counts import coarse_findings
from .copies import copies
from .excitation import Excitation, excitation
from .fill_values import fill_findings
from .finding import each_once, Finding, LEVELS
from .long_bags import Long, looked_at
from .looked_over import looked_over, SURE
from .one_sign import magnitude_findings, sign_findings
from .oversized import size_findings
from .raw_encoder import wrapped_findings
from .reader_advice import READER
from .scales import contradicting, scale_findings, untold
from .signals import ANGLES
from .survey import limit_of, Survey, survey
from .temperatures import temperature_findings
from .time_units import LONGEST, unit_of_times, WORDS
from .told_by_another import (
    copied_findings,
    held_findings,
    measured_alone,
    supply_findings,
)

SHORTEST = 1.0  # s
LOST = 0.01  # share of samples without a number from which on it is said
PURPOSES = 3  # a diagnosis selects, accepts and reports, each on a recording of its own
SATURATED = 0.6  # share of samples at the largest command
EXCITED = 0.02  # share of the torque that a term must explain to be found from a recording
WEIGHTS = ('gravity', 'constant_torque')
"""Effects that measure the torque of a motor, where the servo file knows their size."""


@threadpool_limits.wrap(limits=1, user_api='blas')  # of short products most wait
def check(recordings: Sequence[Long], servo: Servo) -> tuple[Finding, ...]:
    """
    Return what is wrong, and what is well, with recordings of one machine; red findings first.

    Looks at units, scales and signs against the servo file, sampling, saturation, excitation,
    replicates, and at what these channels cannot answer. Of a long recording every part is looked
    at, and some for scales and excitation (:mod:`.long_bags`). Pure: nothing is changed or fitted.
    """
    if not recordings:
        return (Finding('red', 'There is no recording.', 'name at least one bag or table'),)
    surveys = [survey(one, servo) for one in recordings]
    fills = [finding for one in surveys for finding in fill_findings(one.name, one.fills)]
    if fills:  # nothing else can be said of such numbers
        return tuple(each_once(fills))
    found = each_once([replace(finding, recording=one.name) for one in surveys
                       for finding in _of_one(one, servo)])
    looked = []
    for one, seen in zip(recordings, surveys, strict=True):
        parts = looked_at(one)
        looked += [part for part in parts if len(part)]
        if len(parts) > 1:
            found.append(Finding('green', f'{parts[0].warnings[-1]}. These tell scales and '
                                 'excitation, all parts the rest: nothing moves in '
                                 f'{seen.still} of them.'))
    found += each_once([finding for one in looked for finding in (
        *supply_findings(one), *copied_findings(one, servo), *held_findings(one),
        *magnitude_findings(one, servo, SURE), *clipped_findings(one, servo),
        *normalised_findings(one), *temperature_findings(one))])
    found += copies(looked)
    looked = [measured_alone(one, servo) for one in looked]
    shown = {id(one): excitation(one, servo) for one in looked}
    over = looked_over(looked, servo, shown)
    if not any(one.level == 'red' for one in found):
        scales = contradicting(looked, servo) or scale_findings(over)
        found += scales
    if not any(one.level == 'red' for one in found):
        open_ = untold(over)
        if not open_ and not scales and any(one.duration >= SHORTEST for one in surveys):
            found.append(Finding('green',
                                 'No unit, scale or sign contradicts the servo file.'))
        found += open_
    if not any(one.level == 'red' for one in found):
        found += _excitation(shown.values())
        found += each_once([finding for one in looked for finding in coarse_findings(
            one, servo)])
    found += [*replicates(recordings), *_channels(surveys, servo)]
    return tuple(sorted(found, key=lambda one: LEVELS.index(one.level)))


def _of_one(one: Survey, servo: Servo) -> list[Finding]:
    if not one.samples:
        return [Finding('red', f'{one.name} holds no sample.', 'record again')]
    angles = [name for name in ANGLES if name in one.measured]
    if not angles:
        return [Finding('red', f'{one.name} has neither motor_position nor load_position.',
                        'map the column of an encoder to one of them')]
    if not one.moves:
        return [Finding('red', f'{one.name}: nothing moves.',
                        'record with a command that moves the machine')]
    found = _sampling(one, angles[0])
    found += [Finding('red', f'{one.name}: {name} holds whole numbers alone: counts of an '
                      'encoder?', 'give counts a turn in the header or the mapping: '
                      f'{name} [1/4096 rev]') for name in one.whole_numbers]
    found += wrapped_findings(one.name, one.wrapped)
    found += [Finding('amber', f'{one.name}: {name} jumps within a sample, first after '
                      f'{first:.6g} s, in {count} rows: a sensor or a link that dropped out?',
                      'leave those rows empty, or cut them') for name, (count, first) in
              one.jumps.items()]
    found += [*sign_findings(one), *size_findings(one, servo)]
    limit = limit_of(servo)
    if one.at_limit > SATURATED:
        found.append(Finding('amber', f'{one.name}: the command is at its limit of {limit:g} in '
                             f'{100 * one.at_limit:.0f} % of the samples.',
                             'record with a smaller reference'))
    return found


def _sampling(one: Survey, angle: str) -> list[Finding]:
    found = []
    if one.duration < SHORTEST:
        found.append(Finding('amber', f'{one.name} lasts {one.duration:.3g} s.',
                             f'record at least {SHORTEST:g} s; is the time in the right unit?'))
    unit = unit_of_times(one.period, one.start)
    if one.period > LONGEST or unit not in ('', 's'):
        slow = 'slow' if one.period > LONGEST else 'fast'
        meant = f'; the time may be in {WORDS[unit]}' if unit else ''
        found.append(Finding('red', f'{one.name}: one sample every {one.period:.3g} s is too '
                             f'{slow} for a servo{meant}.',
                             f'give the unit of the time: t [{unit or "ms"}]'))
    lost = one.lost[angle]
    if lost > LOST:
        found.append(Finding('amber', f'{one.name}: {angle} is missing in {100 * lost:.1f} % of '
                             'the samples.', 'look at the link that lost them'))
    told = any(finding.level == 'red' for finding in found)
    found += [Finding('amber', f'{one.name}: {said}', _to_do(said)) for said in one.warnings
              if not (told and 'is unusual; is t in' in said)]
    return found


def _to_do(warning: str) -> str:
    """Return what to do about a warning of the reader."""
    for words, action in READER.items():
        if words in warning:
            return action
    return 'docs/recordings.md says what happens with such data'


def _excitation(shown: Iterable[Excitation | None]) -> list[Finding]:
    best: dict[str, float] = {}
    for one in shown:
        for name, share in (one.share if one else {}).items():
            best[name] = max(best.get(name, 0.0), share)
    tells = {'inertia': 'record faster accelerations', 'Coulomb friction': 'record reversals',
             'viscous friction': 'record several speeds'}
    found = []
    for name, share in best.items():
        if share < EXCITED:
            found.append(Finding('amber', f'The {name} is hardly excited: it explains '
                                 f'{100 * share:.1f} % of the torque that is left without it.',
                                 tells[name]))
        else:
            found.append(Finding('green', f'The {name} is excited.'))
    return found


def replicates(recordings: Sequence[Long]) -> list[Finding]:
    """Return whether motions are repeated as often as a diagnosis needs."""
    counts: dict[str, int] = {}
    for one in recordings:
        counts[one.family] = counts.get(one.family, 0) + 1
    if counts.get('', 0) > 1:
        return [Finding('amber', f'{counts[""]} recordings do not say their family, the motion '
                        'that they are of: those that repeat one motion cannot be told.',
                        'give it on import: --family NAME; or write recordings.yaml beside the '
                        f'tables, with {recordings[0].name}: {{family: NAME, replicate: 1}}')]
    if len(recordings) > 1 and max(counts.values()) < PURPOSES:
        told = ', '.join(f'{name or "not said"} {count}' for name, count in counts.items())
        judges = ('cuts each in time to judge itself.' if len(recordings) < PURPOSES else
                  'holds out those of other motions to judge itself, and misses an effect that '
                  'only they excite.')
        return [Finding('amber', f'No family has {PURPOSES} recordings ({told}): the diagnosis '
                        f'{judges}', f'record one motion {PURPOSES} times')]
    single = sorted(name or 'not said' for name, count in counts.items() if count == 1)
    if not single:
        return [Finding('green', 'Each family has more than one recording.')]
    told = 'There is one recording only' if len(recordings) == 1 else (
        f'One recording only of the {"family" if len(single) == 1 else "families"} '
        f'{", ".join(single)}')
    cut = ' A diagnosis goes on with it, cut in time.' if len(recordings) == 1 else ''
    return [Finding('amber', f'{told}: what repeats cannot be told from chance.{cut}',
                    f'record each motion {PURPOSES} times: a diagnosis selects, accepts and '
                    'reports')]


def _channels(surveys: Sequence[Survey], servo: Servo) -> list[Finding]:
    def all_have(*names: str) -> bool:
        return all(name in one.measured for one in surveys for name in names)

    found = []
    both = all_have('motor_position', 'load_position')
    if both and not any(one.measured & {'voltage', 'current', 'torque'} for one in surveys):
        return [Finding('amber', 'Two encoders alone tell the transmission between them; the '
                        "motor's encoder leads the twin. Nothing can be said about drive, motor "
                        'and load.', 'record the motor current')]
    if not both:
        found.append(Finding('amber', 'With one encoder the transmission is told by what the '
                             'other shaft asks for alone: a stiffness by its resonance, a '
                             'transmission error at speed; the other shaft is where the twin has '
                             'it.', 'record both encoders'))
    if not all_have('current'):
        found.append(Finding('amber', 'Without the current, drive and motor cannot be told '
                             'apart.', 'record the motor current'))
    if not all_have('voltage'):
        found.append(Finding('amber', 'Without the command (voltage) nothing can be said about '
                             'the drive; the measured current drives the twin.' if all_have(
                                 'current') else 'Without the command (voltage) the twin cannot '
                             'be driven.', 'record what the drive received'))
    if not all_have('torque'):
        weighs = any(placed.effect.name in WEIGHTS for placed in servo.effects)
        found.append(Finding('amber', 'Without a torque sensor, friction of motor and load cannot '
                             'be told apart' + ('.' if weighs else ', nor a torque constant from '
                                                'inertias and friction.'),
                             'add a torque sensor, or take their sum'))
    return found
