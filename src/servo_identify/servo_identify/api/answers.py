"""What the front door answers: frozen, printable, and a table or a page in a notebook."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

from servo_twin.description.whole_file import write_whole

from ..data.finding import Finding
from ..diagnose.answer.patch import difference, patched
from ..diagnose.answer.report import GapReport
from ..diagnose.diagnosis import Diagnosis
from ..diagnose.page.document import document_of
from ..diagnose.page.page import page_of
from ..fit.estimate import Estimate
from .extras import needed
from .html_table import html_table
from .servo_text import ServoFile


@dataclass(frozen=True, repr=False)
class Checked:
    """What a check found, red findings first. True where none is red."""

    findings: tuple[Finding, ...]

    def __bool__(self) -> bool:
        return not self.red

    @property
    def red(self) -> tuple[Finding, ...]:
        """Findings with which an answer would be wrong."""
        return tuple(one for one in self.findings if one.level == 'red')

    def __repr__(self) -> str:
        return '\n'.join(f'{one.level:5}  {one.sentence}'
                         + (f'\n       {one.action}' if one.action else '')
                         for one in self.findings)

    def _repr_html_(self) -> str:
        return html_table(('', 'finding', 'what to do'),
                          [(one.level, one.sentence, one.action) for one in self.findings])


@dataclass(frozen=True, repr=False)
class Fitted:
    """
    What a fit found.

    ``estimate`` has the values by path with ``std``, ``units``, ``correlation``, and the residual
    of each channel before and after; ``given`` is the servo file that it began with.
    """

    estimate: Estimate
    given: ServoFile

    @property
    def values(self) -> dict[str, float]:
        """The fitted values by path, in the unit of the servo file."""
        return dict(self.estimate.values)

    @property
    def std(self) -> dict[str, float]:
        """One standard error by path; NaN where the data do not tell the value."""
        return dict(self.estimate.std)

    @cached_property
    def servo(self) -> ServoFile:
        """The servo file with the fitted values, its comments kept."""
        found = self.estimate.servo
        return ServoFile(found, patched(self.given.text, self.given.servo, found))

    def __repr__(self) -> str:
        return str(self.estimate)

    def _repr_html_(self) -> str:
        one = self.estimate
        rows = [(name, f'{one.values[name]:.6g}', f'{one.std[name]:.2g}', one.units[name])
                for name in one.names]
        warned = ''.join(f'<p>{escape(said)}</p>' for said in one.warnings)
        return html_table(('parameter', 'value', 'standard error', 'unit'), rows) + warned


@dataclass(frozen=True, repr=False)
class Answer:
    """
    What a diagnosis answers. Printing it gives the sentence; in a notebook it is the page.

    ``diagnosis`` has the report and the evidence; ``given`` is the servo file as given. A pickle
    keeps all but ``diagnosis``: its hypotheses are functions.
    """

    diagnosis: Diagnosis
    given: ServoFile

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in (
            'given', 'report', 'augmented', 'refit', 'page')}

    @cached_property
    def report(self) -> GapReport:
        """The answer as report.json has it: where, which, gap, next_experiment and more."""
        return self.diagnosis.report

    @property
    def sentence(self) -> str:
        """The verdict as one sentence."""
        return str(self.report)

    @property
    def effects(self) -> tuple[str, ...]:
        """The names of the missing effects, in the order in which they were accepted."""
        return tuple(one.effect for one in self.report.which)

    @cached_property
    def augmented(self) -> ServoFile:
        """The servo file with what was missing, its comments kept."""
        return self._changed(self.diagnosis.augmented)

    @cached_property
    def refit(self) -> ServoFile:
        """The augmented servo file with values within tolerance moved as well."""
        return self._changed(self.diagnosis.refit)

    def _changed(self, servo: Any) -> ServoFile:
        return ServoFile(servo, patched(self.given.text, self.given.servo, servo))

    @cached_property
    def page(self) -> str:
        """The page of the diagnosis: HTML that refers to nothing outside itself."""
        patch = difference(self.given.text, self.augmented.text)
        return page_of(document_of(self.diagnosis, patch))

    def save(self, folder: str | Path) -> Path:
        """Write report.json, report.html and augmented.yaml into a folder; return it."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self.report.save(folder / 'report.json')
        self.augmented.save(folder / 'augmented.yaml')
        write_whole(folder / 'report.html', self.page)
        return folder

    def plot(self, what: str = 'curve', effect: str | None = None) -> Any:
        """
        Draw the curve of a missing effect with its band; return the matplotlib figure.

        ``effect`` is one of :attr:`effects`, left out the first that has a curve. Raises
        ValueError where ``what`` is not ``curve`` or no such effect has one, ImportError without
        matplotlib.
        """
        if what != 'curve':
            raise ValueError(f"plot({what!r}): there is 'curve'")
        drawable = {one.effect: one.curve for one in self.report.which if one.curve}
        name = effect or next(iter(drawable), None)
        if name not in drawable:
            raise ValueError(f'{effect or "this answer"} has no curve; with one are '
                             f'{list(drawable)}')
        with needed('matplotlib', 'answer.plot'):
            from .drawing import curve_drawing

        return curve_drawing(name, drawable[name])

    def __repr__(self) -> str:
        return self.sentence

    def _repr_html_(self) -> str:
        return (f'<iframe srcdoc="{escape(self.page)}" style="width:100%;height:48em;border:0" '
                'sandbox="allow-scripts"></iframe>')
