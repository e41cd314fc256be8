"""What a diagnosis answered to one case, held against what is true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
import json
from pathlib import Path
from typing import Any

from .cases import Case
from .fault_tables import Fault

SAYS_UNKNOWN = ('unknown', 'partly_explained')


@dataclass(frozen=True)
class Named:
    """A cause that was named: effect, site ('' where none is said), what it may be taken for."""

    effect: str
    site: str = ''
    alike: tuple[str, ...] = ()
    predicted: float | None = None
    realised: float | None = None
    interval: tuple[float, float] | None = None

    def is_(self, fault: Fault) -> bool:
        """Whether it names a fault, on its side where both say one."""
        same_side = not (self.site and fault.site) or self.site == fault.site
        return self.effect in fault.accepted and same_side

    def holds(self, fault: Fault) -> bool:
        """Whether a fault is it, or among what it may be taken for."""
        return self.is_(fault) or bool(set(self.alike) & fault.accepted)

    @property
    def size(self) -> int:
        """How many names its ambiguity set has, itself included."""
        return len({self.effect, *self.alike})


@dataclass(frozen=True)
class Outcome:
    """One answer to one case. ``status`` is that of report.json, or 'failed'."""

    case: Case
    status: str
    named: tuple[Named, ...]
    balance: str
    seconds: float | None = None
    sentence: str = ''
    confidence: float = 0.0
    resolved: Mapping[str, Any] | None = None  # by what is proposed, by a random recording

    @property
    def false(self) -> tuple[Named, ...]:
        """Causes named that are none of the truths."""
        return tuple(n for n in self.named if not any(n.is_(t) for t in self.case.faults))

    @property
    def first_right(self) -> bool:
        """Whether the first cause named is a truth."""
        return bool(self.named) and any(self.named[0].is_(t) for t in self.case.faults)

    @property
    def in_set(self) -> bool:
        """Whether a truth is in the ambiguity set of the first cause named."""
        return bool(self.named) and any(self.named[0].holds(t) for t in self.case.faults)

    @property
    def located(self) -> bool:
        """Whether the balance blamed most is one in which a truth lies."""
        return any(self.balance in t.balances for t in self.case.faults)

    @property
    def exact(self) -> bool:
        """Whether every truth was named and nothing else."""
        return not self.false and all(any(n.is_(t) for n in self.named) for t in self.case.faults)

    @property
    def says_unknown(self) -> bool:
        """Whether it says that something is there that it does not know."""
        return self.status in SAYS_UNKNOWN

    @property
    def verdict(self) -> str:
        """One word for a table."""
        if self.status == 'failed':
            return 'failed'
        if self.case.kind == 'null':
            return 'wrong' if self.named else 'right' if self.status == 'no_gap' else 'unknown'
        if self.case.kind in ('removed', 'foreign'):
            return 'wrong' if self.named else 'right' if self.says_unknown else 'unseen'
        if self.exact:
            return 'right'
        if not self.named:
            return 'unknown' if self.says_unknown else 'unseen'
        return 'partly' if not self.false else 'wrong'


def outcome_of(case: Case, place: Path) -> Outcome | None:
    """Read the answer in the folder of a case; None where it was not asked yet."""
    report = place / 'diagnosis' / 'report.json'
    clock = place / 'diagnosis' / 'seconds.json'
    seconds = float(clock.read_text()) if clock.is_file() else None
    if (place / 'failed.txt').is_file():
        said = (place / 'failed.txt').read_text().strip().splitlines()
        return Outcome(case, 'failed', (), '', seconds, said[-1] if said else '')
    if not report.is_file():
        return None
    resolved = place / 'resolved.json'
    return replace(judged(case, json.loads(report.read_text()), seconds), resolved=json.loads(
        resolved.read_text()) if resolved.is_file() else None)


def judged(case: Case, report: Mapping[str, Any], seconds: float | None = None) -> Outcome:
    """Return the outcome of a case whose diagnosis answered ``report`` (as of report.json)."""
    named = tuple(Named(
        row['effect'], row.get('site') or '',
        tuple(other.partition(' (')[0] for other in row.get('ambiguous_with', ())),
        row.get('shrink_predicted'), row.get('shrink_realised'),
        tuple(row['interval']) if _numbers(row.get('interval')) else None)
        for row in report.get('which', ()))
    verdict = report['verdict']
    gaps = [row for row in report.get('where', ()) if row.get('verdict') == 'gap']
    largest = max(gaps, key=lambda row: row['share'] or 0.0, default={'balance': ''})
    confidence = (named[0].predicted if named else None) or 0.0
    return Outcome(case, verdict['status'], named, verdict.get('balance') or largest['balance'],
                   seconds, verdict.get('sentence', ''), confidence)


def _numbers(pair: Any) -> bool:
    return bool(pair) and len(pair) == 2 and all(isinstance(x, int | float) for x in pair)
