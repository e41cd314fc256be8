"""
Units, scales, signs and shafts of recordings, held against the servo file.

Each known mistake is a hypothesis: the channels without it must close the equations of
:mod:`.rough_balances` so much better that the mistake is worth its rarity. Nothing is named by
a threshold on a factor; where two mistakes close them alike, both are told.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass, field

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .current_factor import current_findings
from .finding import Finding
from .likelihood import Closed, closed
from .looked_over import LookedOver, SURE
from .mistakes import Mistake, mistakes, unread
from .own_units import own_units
from .plausibility import contradiction, factor_apart
from .rough_balances import balances
from .shown_drift import drift_findings
from .shown_factor import reference_findings, unnamed
from .shown_inertia import inertia_findings, NEAR
from .shown_parting import parted, parting_findings
from .shown_ratio import FORM, ratio_findings
from .shown_winding import winding_findings
from .signals import ANGLES, Signals

ALIKE = 3.0
"""Nats within which two mistakes are told together."""
MOST_MISTAKES = 3


@dataclass
class Evidence:
    """Recordings of one machine under a hypothesis, with what was already closed."""

    servo: Servo
    known: dict[tuple[object, ...], Closed] = field(default_factory=dict)

    def of(self, at: Signals, key: int) -> dict[str, Closed]:
        """Return how each equation of one recording (``key``) closes."""
        answer = {}
        for one in balances(at, self.servo):
            columns = (one.seen, *(term.column for term in one.terms.values()))
            found = (key, one.name, *(float(np.linalg.norm(column[::7])) for column in columns),
                     *(float(column[::7].sum()) for column in columns))
            if found not in self.known:
                self.known[found] = closed(one)
            answer[one.name] = self.known[found]
        return answer


def scale_findings(over: LookedOver) -> list[Finding]:
    """Return what units, scales, signs and shafts look wrong; none where all is well."""
    servo = over.servo
    in_one_unit = _of_both_angles(over)
    if in_one_unit:
        return in_one_unit
    apart = parting_findings(over.parted, servo)
    if not over.usable:
        return apart
    if unnamed(over.off, servo):
        return [*apart, *reference_findings(over.off)]
    evidence = Evidence(servo)
    every = _findings('', [at for _, at in over.usable], evidence)
    if every:
        return [*apart, *every]
    if len(over.usable) > 1:
        open_now = [_nats(evidence.of(at, 0).values()) for _, at in over.usable]
        for k, (one, at) in enumerate(over.usable):
            others = max(open_now[:k] + open_now[k + 1:])
            every += _findings(one.name, [at], evidence, others)
    if every:
        return [*apart, *every]
    return [*apart, *reference_findings(over.off), *sum(over.astray.values(), []),
            *inertia_findings(over.recordings, over.shown, servo),
            *current_findings(over.shown, servo, SURE),
            *ratio_findings([at for _, at in over.usable], servo, SURE),
            *drift_findings(over.families, servo, SURE),
            *winding_findings(over.families, servo, SURE)]


def _of_both_angles(over: LookedOver) -> list[Finding]:
    """Return the unit that both angles are in, where encoders part that hold once it is mended."""
    if not over.parted:
        return []
    seen, evidence = [at for _, at in over.every], Evidence(over.servo)
    best = _likeliest(seen, evidence, set())
    if not best or not {*ANGLES} <= best[0].touches or any(
            parted(best[0].undone(at), over.servo) for at in seen):
        return []
    return _findings('', seen, evidence)


def contradicting(looked: Sequence[Recording], servo: Servo) -> list[Finding]:
    """
    Return where the angles of both shafts contradict each other, as an import refuses it.

    A factor of a mistake that has a name is left to what names it.
    """
    ratio = servo.values['mechanism.ratio']
    known = [ratio**2, *(one.factors.get(ANGLES[0], 1.0) / one.factors.get(ANGLES[1], 1.0)
                         for one in mistakes(ANGLES, servo))]
    found = []
    for one in looked:
        apart = (factor_apart({'t': one.time, **one.columns}, servo)
                 if all(one.has(name) for name in ANGLES) else 1.0)
        if apart != 1.0 and not any(abs(np.log(abs(each) * apart)) < NEAR for each in known):
            found.append(Finding('red', f'{one.name}: {contradiction(apart, servo)}.',
                                 'look at units, ratio and encoders', one.name))
    return found


def untold(over: LookedOver) -> list[Finding]:
    """
    Return which mistakes these recordings cannot tell from none, where they all share one.

    No equation closes worse once such a mistake is undone: the channels are alike, or hardly move.
    A reference that the controller does not read raises no question, nor does one that is off by
    a factor of its own or that the angle does not follow. Two channels that are alike do no harm
    where they are exchanged.
    """
    if not over.usable:
        return []
    servo, seen, evidence = over.servo, [at for _, at in over.usable], Evidence(over.servo)
    unused = unread(servo) | {off.channel for off in over.off} | over.astray.keys()
    alike = []
    for one in mistakes(set.intersection(*(set(at.plain) for at in seen)), servo):
        if one.touches <= unused or all(_same(one, at) for at in seen):
            continue
        if all(_gain(evidence.of(at, key), evidence.of(one.undone(at), key)) > -ALIKE
               for key, at in enumerate(seen)):
            alike.append(one.what)
    if not alike:
        return []
    return [Finding('amber', 'These recordings cannot tell whether ' + '; or whether '.join(alike)
                    + '.', 'hold their units and names against the channel list of the logger')]


def _same(one: Mistake, at: Signals) -> bool:
    """Tell whether the channels that a mistake exchanges are alike, or those it scales are 0."""
    if one.factors and not any(np.any(at.plain[name]) for name in one.factors):
        return True
    return len(one.renamed) > 1 and all(
        np.linalg.norm(at.plain[old] - at.plain[new]) < FORM * np.linalg.norm(at.plain[old])
        for old, new in one.renamed.items())


def _findings(name: str, seen: list[Signals], evidence: Evidence,
              others: float = np.inf) -> list[Finding]:
    """
    Return the mistakes that all of these recordings share, the likeliest first.

    ``others``, nats, is what the worst of the recordings beside one leaves open. One that was
    written with them, and closes no better than they do once a mistake is undone, shows a motion
    that the rough equations do not cover rather than a mistake: that is no ground to stop.
    """
    found: list[Finding] = []
    mended: set[str] = set()
    for _ in range(MOST_MISTAKES):
        best = _likeliest(seen, evidence, mended)
        if not best:
            break
        undone = [best[0].undone(at) for at in seen]
        left = _nats(evidence.of(undone[0], 0).values())
        found.append(_told(name, best, seen, evidence, left <= others + ALIKE))
        seen = undone
        mended |= best[0].touches
    return found


def _likeliest(seen: list[Signals], evidence: Evidence, mended: Set[str]) -> list[Mistake]:
    """
    Return mistakes that explain the recordings alike, the best first; none if none is sure.

    Several recordings of one machine count as one, since what its servo file has wrong shows in
    each. Channels that are ``mended`` already are left as they are.
    """
    now = [evidence.of(at, key) for key, at in enumerate(seen)]
    closed_all = sum(one.least for table in now for one in table.values())
    if sum(_nats(table.values()) for table in now) - closed_all < SURE * len(now):
        return []  # nothing that could be mended would gain enough
    channels = set.intersection(*(set(at.plain) for at in seen))
    scored = []
    for one in (*mistakes(channels, evidence.servo), *own_units(seen, evidence.servo)):
        if one.touches & mended:
            continue
        gained = [_gain(before, evidence.of(one.undone(at), key))
                  for (key, at), before in zip(enumerate(seen), now, strict=True)]
        scored.append((sum(gained) / len(gained) - one.cost, one))
    scored.sort(key=lambda pair: -pair[0])
    if not scored or scored[0][0] < SURE:
        return []
    return [one for nats, one in scored if nats > scored[0][0] - ALIKE]


def _gain(before: dict[str, Closed], after: dict[str, Closed]) -> float:
    return _nats(before.values()) - _nats(after.values())


def _nats(several: Iterable[Closed]) -> float:
    return sum(one.nats for one in several)


def _told(name: str, best: list[Mistake], seen: list[Signals], evidence: Evidence,
          sure: bool) -> Finding:
    """
    Return the finding: what closes how much of which equation, and what to do.

    ``sure``: nothing but the mistake explains it, as a motion beyond the equations may.
    """
    closes, share, equation = 0.0, 0.0, ''
    for key, at in enumerate(seen):
        before, after = evidence.of(at, key), evidence.of(best[0].undone(at), key)
        for which in before.keys() & after.keys():
            was, now = before[which].left, after[which].left
            gain = before[which].nats - after[which].nats
            if was > now and gain * (1.0 - now / was) > closes:
                closes, equation = gain * (1.0 - now / was), which
                share = 100.0 * (1.0 - now / was)
    what = '; or '.join(dict.fromkeys(one.what for one in best))
    said = (f'{best[0].factor} closes {share:.0f} % of the {EQUATIONS[equation]}: '
            if equation and share > 50.0 else
            f'{best[0].factor} makes the values those of the servo file: ')
    doubt = '' if sure else (', or this motion is one that the rough equations do not cover. The '
                             'other recordings show nothing of it')
    return Finding('red' if sure else 'amber', f'{name and f"{name}: "}{said}{what}{doubt}.',
                   '; or '.join(dict.fromkeys(one.action for one in best)), name)


EQUATIONS = {
    'angles': 'equation of the two angles', 'reference': 'tracking of the reference',
    'reference speed': 'tracking of the reference speed', 'drive': 'equation of the drive',
    'torque': 'torque balance', 'sensor': 'balance at the torque sensor',
    'load': 'torque balance of the load'}

