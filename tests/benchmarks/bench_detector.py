"""
The change detector of the identify node, judged: false changes an hour, and changes found.

    python tests/benchmarks/bench_detector.py [SEED] [--hours 2] [--times 1] [--most N] [--jobs 1]

The emulated rigs of detector_cases.py work at 1 kHz, warm up and drift as they do; the shipped
servo file of each runs beside as its twin. The detector has the settings of the identify node.
First nothing changes, and every change that is named is false; the detector learns again then.
Then each change comes once a rig, at once and slowly, --times over, at a random instant. A
change is found when a balance is named within 30 s after it is complete. Its balance is right when
the balance that is named first is one that the change enters directly. Its place is asked for 8 s
after the alarm. The place is right when it is named alone, or with the one that the channels of
the rig cannot tell from it: motor and load without a torque sensor. Intervals are Wilson's,
and of the rate Poisson's, both of 95 %.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path
import zlib

from detector_cases import Change, CHANGES, MACHINES, PERIOD, played, RAMP
import numpy as np
from scipy.stats import chi2

from servo_identify.watch.changes.alarm import Alarm
from servo_identify.watch.changes.change_detector import ChangeDetector, Settings
from servo_identify.watch.changes.change_place import AFTER, ChangePlace, Located
from servo_identify.watch.changes.equation_changes import Equations
from servo_identify.watch.changes.in_a_recording import watched
from servo_twin.description import servo_file
from servo_twin.description.shipped import shipped
from servo_twin.recording.joined_samples import CHANNELS, samples_of
from servo_twin.recording.recording import BALANCES

WITHIN = 30.0  # s after a change is complete
PIECE = 600.0  # s that a rig is watched at a stretch with nothing changed
GIVEN = 100  # samples that the detector is given at once, as in the node
ALIKE = {'motor', 'load'}  # friction of one is that of the other without a torque sensor


@dataclass(frozen=True)
class Case:
    """One recording: a rig, a seed of motion and noise, and perhaps a change at an instant, s."""

    rig: str
    seed: int
    seconds: float
    change: Change | None = None
    at: float = np.inf
    slow: bool = False

    @property
    def name(self) -> str:
        """What it is called on a line."""
        what = self.change.name if self.change else 'nothing'
        return f'{self.rig} {what}{" slowly" if self.slow else ""} {self.seed}'


@dataclass
class Outcome:
    """What the detector said: false alarms in ``watched`` s, and alarms after the change."""

    case: Case
    watched: float = 0.0
    false: list[Alarm] = field(default_factory=list)
    true: list[Alarm] = field(default_factory=list)
    located: Located | None = None
    passed_over: float = 0.0

    @property
    def after(self) -> float:
        """Seconds from the begin of the change to the first alarm; NaN: none in time."""
        if not self.true:
            return np.nan
        after = self.true[0].sequence * PERIOD - self.case.at
        return after if after <= WITHIN + RAMP * self.case.slow else np.nan

    @property
    def right(self) -> bool:
        """Whether the first balance named is one that the change enters."""
        return self.after > 0.0 and self.true[0].balance in self.case.change.balances

    @property
    def placed(self) -> bool:
        """Whether the place that is named is that of the change, and no other beside."""
        places = set(self.located.places) if self.located else set()
        alone = {self.case.change.place} if 'torque' in _sensed(self.case.rig) else (
            ALIKE if self.case.change.place in ALIKE else set())
        return self.within and (len(places) == 1 or bool(alone) and places <= alone)

    @property
    def within(self) -> bool:
        """Whether the place of the change is among those that are named."""
        return (self.after > 0.0 and self.located is not None
                and self.case.change.place in self.located.places)


def judged(case: Case, keep: Path | None) -> Outcome:
    """Have the detector watch a recording."""
    residuals, covariates, rows = _signals(case, keep)
    settings = Settings()
    detector = ChangeDetector(BALANCES, PERIOD, settings)
    servo = servo_file.load(shipped(f'servos/{case.rig}.yaml'))
    place = ChangePlace(servo, PERIOD, settings.block, settings.learn)
    outcome, passed = Outcome(case), 0
    for at in range(0, len(residuals), GIVEN):
        found = detector.push(at, residuals[at:at + GIVEN], covariates[at:at + GIVEN])
        place.push(at, rows[at:at + GIVEN + 2 * place.half])
        if detector.state == 'learning':
            continue
        outcome.watched += GIVEN * PERIOD if at * PERIOD < case.at else 0.0
        late = [alarm for alarm in found if alarm.sequence * PERIOD > case.at]
        outcome.true += late
        outcome.false += [alarm for alarm in found if alarm not in late]
        if found and not late:
            passed += detector.passed_over
            detector.relearn()
            place.relearn()
    if outcome.true:
        first = outcome.true[0]
        outcome.located = place.locate(first.since, first.sequence + round(AFTER / PERIOD))
    outcome.passed_over = (passed + detector.passed_over) * settings.block
    return outcome


def _sensed(rig: str) -> set[str]:
    """Return the channels that a rig's servo file has sensors of."""
    servo = servo_file.load(shipped(f'servos/{rig}.yaml'))
    return {sensor.channel for sensor in servo.sensors}


def _signals(case: Case, keep: Path | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return residuals, covariates, and samples with half a window of none on both sides."""
    file = keep / f'{zlib.crc32(repr(case).encode()):08x}.npz' if keep else None
    if file and file.exists():
        with np.load(file) as kept:
            return (kept['residuals'].astype(float), kept['covariates'].astype(float),
                    kept['rows'])
    servo = servo_file.load(shipped(f'servos/{case.rig}.yaml'))
    recording = played(case.rig, case.seconds, case.seed, case.change, case.at, case.slow)
    residuals, covariates = watched(servo, recording)
    half = Equations(servo, PERIOD).half
    rows = np.full((len(residuals) + 2 * half, len(CHANNELS)), np.nan)
    rows[half:-half] = samples_of(recording.columns)
    if file:
        np.savez(file, residuals=residuals.astype(np.float32),
                 covariates=covariates.astype(np.float32), rows=rows)
    return residuals, covariates, rows


def quiet(rigs: Iterable[str], hours: float, seed: int) -> list[Case]:
    """Return recordings in which nothing changes, of so many hours in all."""
    rigs = list(rigs)
    count = ceil(hours * 3600.0 / PIECE / len(rigs))
    return [Case(rig, 1000 * seed + n, PIECE + Settings().learn) for rig in rigs
            for n in range(count)]


def changed(rigs: Iterable[str], times: int, seed: int) -> list[Case]:
    """Return recordings with one change each."""
    random, found = np.random.default_rng(seed), []
    for change in CHANGES:
        for rig in (rig for rig in change.rigs if rig in set(rigs)):
            for n in range(times):
                for slow in (False, True):
                    if slow and change.column and not change.added:
                        continue  # a sensor sticks at once
                    at = round(Settings().learn + random.uniform(20.0, 60.0), 3)
                    found.append(Case(rig, 1000 * seed + 500 + len(found) + n,
                                      round(at + WITHIN + RAMP * slow), change, at, slow))
    return found


def drawn(cases: list[Case], most: int | None, seed: int) -> list[Case]:
    """Return ``most`` of the cases, drawn by the seed, all without ``most``."""
    order = np.random.default_rng(seed).permutation(len(cases))
    return cases if most is None else [cases[k] for k in order[:most]]


def wilson(right: int, of: int) -> str:
    """Return a share and its interval of 95 %, in percent."""
    if not of:
        return 'none'
    z, share = 1.96, right / of
    middle = (share + z * z / 2 / of) / (1 + z * z / of)
    half = z / (1 + z * z / of) * (share * (1 - share) / of + z * z / 4 / of / of) ** 0.5
    return f'{right} of {of}, {100 * share:.0f} % [{100 * (middle - half):.0f}, ' \
           f'{100 * (middle + half):.0f}]'


def _line(one: Outcome) -> str:
    said = ', '.join(f'{a.balance} {a.sequence * PERIOD:.1f} s ({a.feature} {a.deviations:+.1f})'
                     for a in (*one.false, *one.true))
    if not one.case.change:
        verdict = f'{len(one.false)} false'
    else:
        verdict = ('missed' if not one.after > 0.0 else
                   f'{"right" if one.right else "WRONG"} after {one.after:.1f} s')
        verdict += f', {len(one.false)} false before' if one.false else ''
    if one.case.change:
        verdict += f'; place {"right" if one.placed else "WRONG"}: {one.located}'
    return f'{one.case.name}: {verdict}; changed at {one.case.at:.1f} s; {said}; ' \
           f'{one.passed_over:.0f} s passed over'


def _report(outcomes: list[Outcome]) -> None:
    watched = sum(one.watched for one in outcomes) / 3600.0
    false = sum(len(one.false) for one in outcomes)
    low, high = (chi2.ppf(0.025, 2 * false) / 2 if false else 0.0,
                 chi2.ppf(0.975, 2 * false + 2) / 2)
    print(f'false changes: {false} in {watched:.2f} h, {false / watched:.2f} an hour '
          f'[{low / watched:.2f}, {high / watched:.2f}]')
    for rig in MACHINES:
        for free in (False, True):
            part = [one for one in outcomes
                    if one.case.rig == rig and bool(one.case.seed % 2) == free]
            if part:
                print(f'  {rig} {"free" if free else "cycle"}: '
                      f'{sum(len(one.false) for one in part)} in '
                      f'{sum(one.watched for one in part) / 3600.0:.2f} h')
    cases = [one for one in outcomes if one.case.change]
    if not cases:
        return
    for name in dict.fromkeys(one.case.change.name for one in cases):
        part = [one for one in cases if one.case.change.name == name]
        print(f'  {name}: found {sum(one.after > 0.0 for one in part)}, balance right '
              f'{sum(one.right for one in part)}, place right '
              f'{sum(one.placed for one in part)} of {len(part)}')
    table = Counter((one.case.change.place, ' or '.join(one.located.places))
                    for one in cases if one.after > 0.0 and one.located)
    for (was, said), count in sorted(table.items()):
        print(f'  in {was}, named {said}: {count}')
    for slow in (False, True):
        part = [one for one in cases if one.case.slow == slow]
        print(f'{"slowly" if slow else "at once"}: found '
              f'{wilson(sum(one.after > 0.0 for one in part), len(part))}; balance right '
              f'{wilson(sum(one.right for one in part), len(part))}; place right '
              f'{wilson(sum(one.placed for one in part), len(part))}; among those named '
              f'{wilson(sum(one.within for one in part), len(part))}')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('seed', type=int, nargs='?', default=1)
    parser.add_argument('--hours', type=float, default=2.0, help='in which nothing changes')
    parser.add_argument('--times', type=int, default=1, help='each change, rig and speed')
    parser.add_argument('--most', type=int, metavar='N',
                        help='judge N of the changes, drawn by the seed')
    parser.add_argument('--rigs', nargs='+', choices=MACHINES, default=list(MACHINES))
    parser.add_argument('--jobs', type=int, default=1)
    parser.add_argument('--keep', type=Path, metavar='FOLDER', help='for recordings, to use again')
    told = parser.parse_args()
    if told.keep:
        told.keep.mkdir(parents=True, exist_ok=True)
    cases = (quiet(told.rigs, told.hours, told.seed) if told.hours else []) + (
        drawn(changed(told.rigs, told.times, told.seed), told.most, told.seed)
        if told.times else [])
    outcomes = []
    with ProcessPoolExecutor(told.jobs) as pool:
        for one in pool.map(judged, cases, [told.keep] * len(cases)):
            outcomes.append(one)
            print(_line(one), flush=True)
    _report(outcomes)


if __name__ == '__main__':
    main()
